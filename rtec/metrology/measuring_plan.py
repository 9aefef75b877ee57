"""The plan of a laser measurement: what the operator enters, checked as the thesis's macro checks it."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field

import numpy as np

from rtec.errors import ArgumentError
from rtec.metrology.number_format import vb_format
from rtec.metrology.readings import Floats

NEAR_ZERO_INCH = 0.0001
"""What the macro calls NearZero."""
POSITION_PATTERN = "##0.0###"
"""The macro's pattern for positions: one to four decimals."""
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
    minimum_inch, maximum_inch
        Limits of the axis in machine coordinates. The thesis does not print those of its lathe; the default leaves
        room for its overshoots to 0.9 and 40.1 inch.
    measure
        Diameter axes get a G07 first.
    inch_mode
        G-code of inches on this control.

    Raises
    ------
    ArgumentError
        Limits that are not finite, beyond 10 000 inch, or not in order.

    Examples
    --------
    >>> MachineAxis().letter, MachineAxis(number=1).letter
    ('Z', 'X')
    """

    number: int = 3
    letters: str = "XZ"
    minimum_inch: float = 0.0
    maximum_inch: float = 41.0
    measure: AxisMeasure = AxisMeasure.RADIUS
    inch_mode: InchMode = InchMode.G70

    def __post_init__(self) -> None:
        for name in ("minimum_inch", "maximum_inch"):
            _refuse_not_finite(name, getattr(self, name))
            if abs(getattr(self, name)) > 10_000:
                raise ArgumentError(name, getattr(self, name), "-10000 to 10000 inch")
        if self.minimum_inch >= self.maximum_inch:
            raise ArgumentError("maximum_inch", self.maximum_inch, f"more than minimum_inch ({self.minimum_inch})")

    @property
    def letter(self) -> str:
        """Letter of the axis."""
        return "XYZ"[self.number - 1]


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuringPlan:
    """The parameters of a bidirectional laser measurement, checked in the order of the thesis's macro.

    Parameters
    ----------
    start_inch, end_inch
        First and last target, in machine coordinates.
    increment_inch
        Distance between targets; it divides the travel evenly.
    dwell_s
        Rest at each target, 1 to 99 s. The program holds whole seconds: the macro rounds half up.
    runs
        Number of bidirectional runs, 1 to 99.
    feed_inch_min
        0.1 to 50 inch/min.
    overshoot_inch
        How far the axis goes beyond the ends to take up backlash, above 0 to 1 inch.
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
    >>> plan = MeasuringPlan(start_inch=1, end_inch=40, increment_inch=0.025, dwell_s=6, runs=4,
    ...                      feed_inch_min=50, overshoot_inch=0.1)
    >>> plan.number_of_readings
    12488
    >>> plan.targets_inch[:3].tolist(), float(plan.targets_inch[-1])
    ([1.0, 1.025, 1.05], 40.0)
    """

    start_inch: float
    end_inch: float
    increment_inch: float
    dwell_s: float
    runs: int
    feed_inch_min: float
    overshoot_inch: float
    axis: MachineAxis = field(default_factory=MachineAxis)

    def __post_init__(self) -> None:
        for name in (
            "start_inch",
            "end_inch",
            "increment_inch",
            "dwell_s",
            "runs",
            "feed_inch_min",
            "overshoot_inch",
        ):
            _refuse_not_finite(name, getattr(self, name))
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
        if self.start_inch >= self.end_inch:
            raise ArgumentError("start_inch", self.start_inch, f"a position below end_inch ({self.end_inch:g})")
        if not axis.minimum_inch <= self.start_inch <= axis.maximum_inch:
            raise ArgumentError("start_inch", self.start_inch, f"{axis.minimum_inch:g} to end_inch")
        if not axis.minimum_inch <= self.end_inch <= axis.maximum_inch:
            raise ArgumentError("end_inch", self.end_inch, f"start_inch to {axis.maximum_inch:g}")

    def _check_increment(self) -> None:
        travel = self.end_inch - self.start_inch
        if not NEAR_ZERO_INCH <= self.increment_inch <= travel:
            raise ArgumentError("increment_inch", self.increment_inch, f"{NEAR_ZERO_INCH} to {travel}, the travel")
        if travel / self.increment_inch > MAX_TARGETS:
            raise ArgumentError("increment_inch", self.increment_inch, f"at most {MAX_TARGETS} targets in a pass")
        if not _divides_evenly(self.start_inch, self.end_inch, self.increment_inch):
            raise ArgumentError("increment_inch", self.increment_inch, f"a whole part of the travel, {travel:g} inch")

    def _check_cycle(self) -> None:
        if not 1 <= self.dwell_s <= 99:
            raise ArgumentError("dwell_s", self.dwell_s, "1 to 99 s")
        if not 1 <= self.runs <= 99 or self.runs != int(self.runs):
            raise ArgumentError("runs", self.runs, "a whole number, 1 to 99")
        if not 0.1 <= self.feed_inch_min <= 50:
            raise ArgumentError("feed_inch_min", self.feed_inch_min, "0.1 to 50 inch/min")

    def _check_overshoot(self) -> None:
        if not 0 < self.overshoot_inch <= 1:
            raise ArgumentError("overshoot_inch", self.overshoot_inch, "more than 0, up to 1 inch")
        if self.start_inch - self.overshoot_inch < self.axis.minimum_inch:
            room = f"at most {self.start_inch - self.axis.minimum_inch:g}, the room before start_inch"
            raise ArgumentError("overshoot_inch", self.overshoot_inch, room)
        if self.end_inch + self.overshoot_inch > self.axis.maximum_inch:
            room = f"at most {self.axis.maximum_inch - self.end_inch:g}, the room behind end_inch"
            raise ArgumentError("overshoot_inch", self.overshoot_inch, room)

    @property
    def targets_inch(self) -> Floats:
        """Targets of a forward pass as the program holds them, to four decimals, shape (targets,)."""
        forward = [self.start_inch, *forward_positions(self)]
        return np.array([float(vb_format(position, POSITION_PATTERN)) for position in forward])

    @property
    def number_of_readings(self) -> int:
        """Readings of the whole measurement: every target in both directions of every run."""
        return int(self.runs) * 2 * (1 + len(forward_positions(self)))


def forward_positions(plan: MeasuringPlan) -> list[float]:
    """Return the positions of the forward pass behind the start, added up as the macro does.

    Examples
    --------
    >>> forward_positions(MeasuringPlan(start_inch=1, end_inch=2, increment_inch=0.5, dwell_s=2, runs=1,
    ...                                 feed_inch_min=50, overshoot_inch=0.1))
    [1.5, 2.0]
    """
    positions: list[float] = []
    position = plan.start_inch + plan.increment_inch
    while not positions or position <= plan.end_inch + NEAR_ZERO_INCH:
        positions.append(position)
        position += plan.increment_inch
    return positions


def return_positions(plan: MeasuringPlan) -> list[float]:
    """Return the positions of the return pass, from the end to the start, added up as the macro does.

    Examples
    --------
    >>> return_positions(MeasuringPlan(start_inch=1, end_inch=2, increment_inch=0.5, dwell_s=2, runs=1,
    ...                                feed_inch_min=50, overshoot_inch=0.1))
    [2, 1.5, 1.0]
    """
    positions: list[float] = []
    position = plan.end_inch
    while not positions or position >= plan.start_inch - NEAR_ZERO_INCH:
        positions.append(position)
        position -= plan.increment_inch
    return positions


def _divides_evenly(start: float, end: float, increment: float) -> bool:
    """Return whether steps of ``increment`` from each end meet the other within NearZero (CheckIncrement)."""
    up = start + increment
    while abs(end - up) >= NEAR_ZERO_INCH and up <= end:
        up += increment
    if up > end and abs(end - up) > NEAR_ZERO_INCH:
        return False
    down = end - increment
    while abs(start - down) >= NEAR_ZERO_INCH and down >= start:
        down -= increment
    return not (down < start and abs(start - down) > NEAR_ZERO_INCH)


def _refuse_not_finite(name: str, value: object) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise ArgumentError(name, repr(value), "a number")
    if not math.isfinite(value):
        raise ArgumentError(name, value, "a finite number")
