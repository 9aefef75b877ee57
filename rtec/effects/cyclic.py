"""An error that comes back every turn of the screw, tooth of a rack or worm, or pole pitch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rtec.effects._harmonics import POINTS_A_PERIOD, WavesShape, harmonic_columns, harmonic_names, harmonic_summary
from rtec.effects._periodic import Periodic, families
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.frequency_grid import ENOUGH_PHASES, frequencies, phases_seen, stated_base, stated_periods
from rtec.effects.protocol import Amplitude, Card, Quantity, Shape, Tunable, Units, own_shape, parameter
from rtec.errors import ArgumentError

PARTS = (1, 2, 3, 4, 5)
"""Which harmonic of its family the strongest line may be."""
BY_DIRECTION = "_by_direction"
ROUNDING = 1e-9
"""Of a period that is read from a file in another unit."""
PHASES_BESIDE = 4
"""Phases of a turn, more than twice the harmonics, that have to be seen: fewer tell no step from another harmonic."""
LEAST_GAP = 1e-4
"""Of a turn, between neighbouring phases: readings nearer to each other stand at the same phase."""
STRETCHES = 100
"""Of a turn, in each of which a step is looked for in one place at first."""
AROUND = 0.05
"""Of a turn, to either side of a step that is known: there it is looked for again."""


@dataclass(frozen=True, slots=True)
class CyclicShape(WavesShape):
    """Period, number of harmonics, whether the wave differs by direction, and where in the period it has a step.

    ``step_at`` lies above zero and at most at the period; 0 stands for a wave without a step.
    """

    by_direction: bool = field(default=False, metadata=parameter(Quantity.CHOICE, "by_direction"))
    step_at: float = field(default=0.0, metadata=parameter(Quantity.POSITION, "step_at"))

    def __post_init__(self) -> None:
        if not 0.0 <= self.step_at <= self.period * (1.0 + ROUNDING):
            raise ArgumentError("step_at", self.step_at, f"0 (no step) to the period, {self.period:g}")

    @property
    def is_one_wave(self) -> bool:
        """Whether it is a single wave, the same in both directions and without a step."""
        return self.harmonics == 1 and not self.by_direction and self.step_at == 0.0

    @property
    def waves(self) -> int:
        """Amplitudes of the waves, without those of the step."""
        return 2 * self.harmonics * (2 if self.by_direction else 1)


class Cyclic(Periodic):
    """A Fourier series in position, with amplitudes that may differ by direction, and a step once a turn.

    Notes
    -----
    ``deviation = sum over k of sin_k sin(2 pi k x / period) + cos_k cos(2 pi k x / period)``; where it differs by
    direction, the same again times the direction: the forward wave is the sum, the backward wave the difference. With
    no position in the data, time stands for it, and the period is one in time.

    A step is a sawtooth beside the waves: it rises by 1 at the step and falls evenly over the turn. It is looked for
    in a stated turn or pitch of which enough phases are seen, halfway between neighbouring phases of the readings,
    which do not tell its place closer: at first in the widest gap of each hundredth of the turn.

    Examples
    --------
    >>> x = np.array([0.0, 1.5875, 3.175])
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(3, dtype=np.int64))
    >>> Cyclic().contribution(c, CyclicShape(6.35), [0.01, 0.0]).round(9).tolist()
    [0.0, 0.01, 0.0]
    """

    name = "cyclic"
    shape_type = CyclicShape
    card = Card(
        title="Cyclic error",
        formula=(
            "`Σ sin_k sin(2πkx/period) + cos_k cos(2πkx/period) + step · (½ − ((x − step_at)/period mod 1))`, and "
            "the same times `d`"
        ),
        needs="a period that the positions resolve and do not alias: six positions at least",
        plot=(
            "A wave that repeats with every turn of screw, worm or pinion or every pole pitch, often double-humped; "
            "forward and backward waves may differ."
        ),
        cause=(
            "Eccentric or tilted screw, bearing, coupling, pulley or encoder; an error of the thread within a turn."
        ),
        consequence="Short distances are wrong although long ones are right; surfaces show the pitch of the screw.",
        action=(
            "Check coupling, thrust bearing and mounting of screw and encoder. A table needs about ten points a "
            "turn; targets at whole turns do not show the error."
        ),
        invariant_to="shifts of the targets by whole periods, feed, time and temperature.",
        source=(
            "Thesis, section 5.1, Figure 5.2: 0.00145 inch peak to peak with the pitch of 0.25 inch, double-humped; "
            "section 5.2: the targets' step must not be a multiple of the pitch."
        ),
    )

    def untestable(self, conditions: Conditions) -> str | None:
        pitch = conditions.screw_pitch
        if pitch is not None and conditions.places.size > 1:
            seen = phases_seen(conditions.places, pitch)
            if seen < ENOUGH_PHASES:
                what = f"turns of the screw ({pitch:g} {conditions.position_unit})"
                if seen == 1:
                    return f"targets lie at whole {what}: a cyclic error with that period looks constant here"
                return f"targets lie at two phases of the {what}: a cyclic error with that period cannot be fitted"
        return super().untestable(conditions)

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return single waves: the scan over frequencies, then the stated pitch and its fractions."""
        stated = stated_periods(conditions)
        grid = frequencies(conditions)
        return [CyclicShape(period) for period in np.concatenate([1.0 / grid, stated]).tolist()]

    def variants(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        """Return families of harmonics that hold the wave found, each also with a difference by direction.

        For a family of a whole turn or pitch, the same family with a step as well, and other families with its step.
        """
        own = own_shape(shape, CyclicShape)
        found = []
        for base, harmonics in families(conditions, 1.0 / own.period, PARTS):
            one = CyclicShape(1.0 / base, harmonics)
            found += [one, replace(one, by_direction=True)] if conditions.both_directions else [one]
        if own.step_at > 0.0:
            found += [replace(one, step_at=own.step_at) for one in found if one.period == own.period]
        turn = stated_base(conditions, own.period)
        if turn is None or own.harmonics < 2 or turn not in (conditions.screw_pitch, conditions.revolution):
            return found
        if phases_seen(conditions.places, turn) < 2 * own.harmonics + PHASES_BESIDE:
            return found
        middles, gaps = _gaps(conditions, turn)
        stretch = np.floor(middles * STRETCHES)
        order = np.lexsort((-gaps, stretch))  # the widest gap of each stretch comes first
        first = middles[order[np.unique(stretch[order], return_index=True)[1]]]
        if own.step_at > 0.0:
            first = first[_away(first, own) < AROUND]
        return [*found, *_steps_at(replace(own, period=turn), first)]

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        """Return the period, but of a wave with a step: its turn is stated."""
        return () if own_shape(shape, CyclicShape).step_at > 0.0 else super().tunables(conditions, shape)

    def tried(self, conditions: Conditions, shape: Shape) -> float:
        """Return the number of periods, times that of the places of a step where there is one."""
        own = own_shape(shape, CyclicShape)
        periods = super().tried(conditions, replace(own, step_at=0.0))
        return periods if own.step_at == 0.0 else periods * STRETCHES

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return sine and cosine of each harmonic, then each times the direction, then the step.

        Shape (rows, amplitudes).
        """
        own = own_shape(shape, CyclicShape)
        parts = [harmonic_columns(conditions.position, own.period, own.harmonics)]
        if own.step_at > 0.0:
            parts.append(sawtooth(conditions.position, own)[:, None])
        if own.by_direction:
            way = self._needed(conditions.direction, "directions of approach")[:, None]
            parts = [column for part in parts for column in (part, part * way)]
        return np.hstack(parts)

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return sin_1, cos_1, sin_2, ...; then sin_1_by_direction, ...; then step, step_by_direction."""
        own = own_shape(shape, CyclicShape)
        ways = ("", BY_DIRECTION) if own.by_direction else ("",)
        names = tuple(name for way in ways for name in harmonic_names(own.harmonics, units, way))
        return names + tuple(Amplitude(f"step{way}", *units.shown) for way in ways if own.step_at > 0.0)

    def summary(self, shape: Shape, amplitudes: Sequence[float], units: Units) -> tuple[tuple[str, float, str], ...]:
        """Return period, harmonics, amplitude and phase of each, and peak to peak; forward and backward apart.

        Where there is a step, its place and how much it rises in the positive direction, too; the harmonics are those
        of what is left beside its sawtooth, the peak to peak value that of all together.
        """
        own = own_shape(shape, CyclicShape)
        head = [("period", own.period, units.position), ("harmonics", float(own.harmonics), "")]
        if own.step_at > 0.0:
            head.append(("step_at", own.step_at, units.position))
        values = np.asarray(amplitudes, dtype=np.float64)
        waves, steps = values[: own.waves], values[own.waves :]
        if not own.by_direction:
            return (*head, *_way_summary(own, waves, steps, "", units))
        (both, differing), (step, other) = np.split(waves, 2), np.split(steps, 2)
        forward = _way_summary(own, both + differing, step + other, "_forward", units)
        return (*head, *forward, *_way_summary(own, both - differing, step - other, "_backward", units))


def sawtooth(position: Floats, shape: CyclicShape) -> Floats:
    """Return what rises by 1 at the step of each turn and falls evenly over it, shape (rows,).

    Examples
    --------
    >>> sawtooth(np.array([0.9, 1.0, 1.5]), CyclicShape(1.0, 2, step_at=1.0)).round(9).tolist()
    [-0.4, 0.5, 0.0]
    """
    turns = (position - shape.step_at) / shape.period
    return 0.5 - (turns - np.floor(turns))


def _way_summary(
    shape: CyclicShape, waves: Floats, steps: Floats, suffix: str, units: Units
) -> tuple[tuple[str, float, str], ...]:
    """Return what people read of the wave in one direction."""
    if not steps.size:
        return harmonic_summary(waves, units, suffix)
    unit, factor = units.shown
    turn = sawtooth(np.arange(POINTS_A_PERIOD, dtype=np.float64) * (shape.period / POINTS_A_PERIOD), shape)
    rise = (f"step{suffix}", float(steps[0]) * factor, unit)
    return (rise, *harmonic_summary(waves, units, suffix, beside=float(steps[0]) * turn))


def closer_steps(conditions: Conditions, shape: Shape) -> Sequence[CyclicShape]:
    """Return a family with its step in every gap near the one where it was found."""
    own = own_shape(shape, CyclicShape)
    if own.step_at == 0.0:
        return ()
    middles, _ = _gaps(conditions, own.period)
    return _steps_at(own, middles[_away(middles, own) < 1.0 / STRETCHES])


def _gaps(conditions: Conditions, period: float) -> tuple[Floats, Floats]:
    """Return the middles of the gaps between phases of a period at which readings stand, and how wide they are.

    Both in cycles, shape (gaps,).
    """
    seen = np.unique(np.round(np.mod(conditions.places / period, 1.0), 6) % 1.0)
    gaps = np.diff(seen, append=seen[0] + 1.0)
    wide = gaps > LEAST_GAP
    return np.mod(seen + 0.5 * gaps, 1.0)[wide], gaps[wide]


def _away(phases: Floats, shape: CyclicShape) -> Floats:
    """Return how far phases are from the step of a shape, in cycles."""
    return np.abs(np.mod(phases - shape.step_at / shape.period + 0.5, 1.0) - 0.5)


def _steps_at(shape: CyclicShape, phases: Floats) -> list[CyclicShape]:
    return [replace(shape, step_at=float(phase) * shape.period if phase > 0.0 else shape.period) for phase in phases]
