"""The plan of a laser measurement, in mm: what the operator enters, checked as the thesis's macro checks it."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from rtec.checks import number_within, whole_within
from rtec.errors import ArgumentError
from rtec.metrology.readings import Floats
from rtec.units import MM_PER_INCH

_NEAR_ZERO_MM = 0.0001 * MM_PER_INCH
"""What the macro calls NearZero."""
_FEEDS_MM_S = 0.1 * MM_PER_INCH / 60.0, 50.0 * MM_PER_INCH / 60.0
_FARTHEST_MM = 10_000 * MM_PER_INCH
_LEAST = 1e-9
"""By which lengths and feeds may differ that were inches before."""
_DIGITS = 9
"""Decimals of a length in its unit; what is behind them is round-off."""
PROGRAM_DECIMALS = {MM_PER_INCH: 4, 1.0: 3}
"""Decimals to which programs state a length, by its unit in mm; those of inches are the macro's."""
LATHE_MM = 41.0 * MM_PER_INCH
"""How far the axis of the thesis's lathe goes at least."""
MAX_TARGETS = 1_000_000
"""Bound on the targets of one pass. Ours, not the macro's: it would loop for hours."""


class AxisMeasure(enum.Enum):
    """What a number of the axis means to the control."""

    RADIUS = "radius"
    DIAMETER = "diameter"


class InchMode(enum.Enum):
    """G-code by which the control is set to inches."""

    G70 = 70
    G20 = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class MachineAxis:
    """The axis to be measured, as the control describes it.

    Parameters
    ----------
    number
        1 = X, 2 = Y, 3 = Z.
    letters
        Axes that the machine has: ``XZ`` for a lathe, ``XYZ`` for a mill.
    minimum_mm, maximum_mm
        Limits of the axis in machine coordinates. The thesis does not print those of its lathe; the default leaves
        room for its overshoots to 0.9 and 40.1 inch.
    measure
        Diameter axes get a G07 first.
    inch_mode
        G-code of inches on this control.

    Raises
    ------
    ArgumentError
        Limits that are not finite, beyond 10 000 inches, or not in order.

    Examples
    --------
    >>> MachineAxis().letter, MachineAxis(number=1).letter
    ('Z', 'X')
    """

    number: int = 3
    letters: str = "XZ"
    minimum_mm: float = 0.0
    maximum_mm: float = LATHE_MM
    measure: AxisMeasure = AxisMeasure.RADIUS
    inch_mode: InchMode = InchMode.G70

    def __post_init__(self) -> None:
        for name in ("minimum_mm", "maximum_mm"):
            number_within(name, getattr(self, name), -_FARTHEST_MM, _FARTHEST_MM)
        if self.minimum_mm >= self.maximum_mm:
            raise ArgumentError(
                "maximum_mm", f"{self.maximum_mm:g} mm", f"more than minimum_mm ({self.minimum_mm:g} mm)"
            )

    @property
    def letter(self) -> str:
        """Letter of the axis."""
        return "XYZ"[self.number - 1]


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuringPlan:
    """The parameters of a bidirectional laser measurement, checked in the order of the thesis's macro.

    Parameters
    ----------
    start_mm, end_mm
        First and last target, in machine coordinates.
    increment_mm
        Distance between targets; it divides the travel into equal parts.
    dwell_s
        Rest at each target, 1 to 99 s.
    runs
        Number of bidirectional runs, 1 to 99.
    feed_mm_s
        0.1 to 50 inch/min, in mm/s.
    overshoot_mm
        How far the axis goes beyond the ends to take up backlash, above 0 to 25.4 mm.
    axis
        The axis measured.

    Raises
    ------
    ArgumentError
        The first parameter that the macro would refuse; or one that is not finite, or more than a million targets.

    References
    ----------
    Thesis, Figure 4.3 (parameters) and Appendix B (the macro LaserMotion, its checks and CheckIncrement).

    Examples
    --------
    >>> plan = MeasuringPlan(start_mm=25.4, end_mm=1016, increment_mm=0.635, dwell_s=6, runs=4,
    ...                      feed_mm_s=20, overshoot_mm=2.54)
    >>> plan.number_of_readings
    12488
    >>> plan.targets_mm.round(3)[[0, 1, -1]].tolist()
    [25.4, 26.035, 1016.0]
    """

    start_mm: float
    end_mm: float
    increment_mm: float
    dwell_s: float
    runs: int
    feed_mm_s: float
    overshoot_mm: float
    axis: MachineAxis = field(default_factory=MachineAxis)

    def __post_init__(self) -> None:
        for name in ("start_mm", "end_mm", "increment_mm", "dwell_s", "runs", "feed_mm_s", "overshoot_mm"):
            number_within(name, getattr(self, name), -_FARTHEST_MM, _FARTHEST_MM)
        self._check_axis_and_ends()
        self._check_increment()
        self._check_cycle()
        self._check_overshoot()

    def _check_axis_and_ends(self) -> None:
        axis = self.axis
        if axis.number not in (1, 2, 3):
            raise ArgumentError("axis.number", axis.number, "1 (X), 2 (Y) or 3 (Z)")
        if axis.letter not in axis.letters:
            raise ArgumentError("axis.number", axis.number, f"an axis of this machine, which has {axis.letters}")
        if self.start_mm >= self.end_mm:
            raise self._refused("start_mm", f"a position below the end, {self.end_mm:g} mm")
        if not axis.minimum_mm - _LEAST <= self.start_mm <= axis.maximum_mm + _LEAST:
            raise self._refused("start_mm", f"{axis.minimum_mm:g} mm to end_mm")
        if not axis.minimum_mm - _LEAST <= self.end_mm <= axis.maximum_mm + _LEAST:
            raise self._refused("end_mm", f"start_mm to {axis.maximum_mm:g} mm")

    def _refused(self, name: str, allowed: str, unit: str = "mm") -> ArgumentError:
        return ArgumentError(name, f"{getattr(self, name):g} {unit}", allowed)

    def _check_increment(self) -> None:
        travel = self.end_mm - self.start_mm
        if not _NEAR_ZERO_MM - _LEAST <= self.increment_mm <= travel + _LEAST:
            raise self._refused("increment_mm", f"{_NEAR_ZERO_MM:g} to {travel:g} mm, the travel")
        if travel / self.increment_mm > MAX_TARGETS:
            raise self._refused("increment_mm", f"at most {MAX_TARGETS} targets in a pass")
        if abs(travel - self._intervals * self.increment_mm) > _NEAR_ZERO_MM:
            raise self._refused("increment_mm", f"a whole part of the travel, {travel:g} mm")

    def _check_cycle(self) -> None:
        number_within("dwell_s", self.dwell_s, 1, 99)
        whole_within("runs", self.runs, 1, 99)
        slowest, fastest = _FEEDS_MM_S
        if not slowest - _LEAST <= self.feed_mm_s <= fastest + _LEAST:
            raise self._refused("feed_mm_s", "0.1 to 50 inch/min", "mm/s")

    def _check_overshoot(self) -> None:
        if not 0 < self.overshoot_mm <= MM_PER_INCH + _LEAST:
            raise self._refused("overshoot_mm", "more than 0, up to 25.4 mm")
        if self.start_mm - self.overshoot_mm < self.axis.minimum_mm - _LEAST:
            room = f"at most {self.start_mm - self.axis.minimum_mm:g} mm, the room before start_mm"
            raise self._refused("overshoot_mm", room)
        if self.end_mm + self.overshoot_mm > self.axis.maximum_mm + _LEAST:
            room = f"at most {self.axis.maximum_mm - self.end_mm:g} mm, the room behind end_mm"
            raise self._refused("overshoot_mm", room)

    @property
    def unit_mm(self) -> float:
        """Unit of the lengths, in mm: an inch where four decimals of it state them exactly, else a millimetre."""
        lengths = np.array([self.start_mm, self.increment_mm, self.overshoot_mm]) / MM_PER_INCH
        exact = np.allclose(lengths, lengths.round(PROGRAM_DECIMALS[MM_PER_INCH]), rtol=0.0, atol=_LEAST)
        return MM_PER_INCH if exact else 1.0

    def _in_unit(self, lengths_mm: npt.ArrayLike) -> Floats:
        """Return lengths without the digits that a conversion from their unit leaves."""
        return (np.asarray(lengths_mm) / self.unit_mm).round(_DIGITS) * self.unit_mm

    @property
    def targets_mm(self) -> Floats:
        """Targets of a forward pass, from ``start_mm`` to ``end_mm``, shape (targets,)."""
        return self._in_unit(np.linspace(self.start_mm, self.end_mm, self._intervals + 1))

    @property
    def turns_mm(self) -> Floats:
        """Where the axis turns, beyond the start and beyond the end, shape (2,)."""
        return self._in_unit([self.start_mm - self.overshoot_mm, self.end_mm + self.overshoot_mm])

    @property
    def programmed_feed_mm_s(self) -> float:
        """Feed of every move, as programs state it: per minute."""
        return float(self._in_unit(60.0 * self.feed_mm_s)) / 60.0

    @property
    def number_of_readings(self) -> int:
        """Readings of the whole measurement: every target in both directions of every run."""
        return self.runs * 2 * (self._intervals + 1)

    @property
    def _intervals(self) -> int:
        return round((self.end_mm - self.start_mm) / self.increment_mm)
