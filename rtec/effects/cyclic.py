"""An error that comes back every turn of the screw, tooth of a rack or worm, or pole pitch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rtec.effects import experiments
from rtec.effects._harmonics import harmonic_columns, harmonic_names, harmonic_summary
from rtec.effects._periodic import Periodic, families
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.frequency_grid import ENOUGH_PHASES, frequencies, phases_seen, stated_periods
from rtec.effects.protocol import Amplitude, Card, Quantity, Rival, Shape, Units, own_shape, parameter

PARTS = (1, 2, 3, 4, 5)
"""Which harmonic of its family the strongest line may be."""
BY_DIRECTION = "_by_direction"


@dataclass(frozen=True, slots=True)
class CyclicShape(Shape):
    """Period, number of harmonics, and whether the wave differs by direction."""

    period: float = field(default=1.0, metadata=parameter(Quantity.POSITION, "period"))
    harmonics: int = field(default=1, metadata=parameter(Quantity.COUNT, "harmonics"))
    by_direction: bool = field(default=False, metadata=parameter(Quantity.CHOICE, "by_direction"))


class Cyclic(Periodic):
    """A Fourier series in position, with amplitudes that may differ by direction.

    Notes
    -----
    ``deviation = sum over k of sin_k sin(2 pi k x / period) + cos_k cos(2 pi k x / period)``; where it differs by
    direction, the same again times the direction: the forward wave is the sum, the backward wave the difference. With
    no position in the data, time stands for it, and the period is one in time.

    References
    ----------
    Thesis, section 5.1 and figure 5.2: a cyclic error with the period of one turn of the leadscrew, 0.25 inch.

    Examples
    --------
    >>> x = np.array([0.0, 1.5875, 3.175])
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(3, dtype=np.int64))
    >>> Cyclic().contribution(c, CyclicShape(6.35), [0.01, 0.0]).round(9).tolist()
    [0.0, 0.01, 0.0]
    """

    name = "cyclic"
    needs = "a period that the positions resolve and do not alias: six positions at least"
    shape_type = CyclicShape
    at_most = 3
    contains = frozenset({"eccentricity", "interpolation"})
    rivals = (
        Rival("interpolation", experiments.FRACTIONS_OF_SIGNAL),
        Rival("eccentricity", experiments.SEVERAL_TURNS),
    )
    card = Card(
        title="Cyclic error",
        plot=(
            "A wave along the axis that comes back with every turn of the screw (worm, pinion, pole pitch), often "
            "with two humps a turn; in the spectrum a line at one cycle a turn and its multiples. Forward and "
            "backward waves may differ."
        ),
        cause=(
            "Eccentric or tilted mounting of screw, bearing, coupling, pulley or encoder; an error of the thread "
            "within a turn."
        ),
        consequence=(
            "Short distances are wrong although long ones are right; surfaces show a pattern with the pitch of the "
            "screw."
        ),
        action=(
            "Look at coupling, thrust bearing and mounting of screw and encoder. A compensation table needs some ten "
            "points a turn; targets at whole turns hide the error altogether."
        ),
        invariant_to=(
            "shifts of the targets by whole periods, feed, time, temperature; its amplitude does not depend on where "
            "along the axis it is seen."
        ),
        source=(
            "Thesis, section 5.1, Figure 5.2: 0.00145 inch peak to peak with the 0.25 inch pitch of the "
            "leadscrew, double-humped; section 5.2: an interval that the pitch does not divide brings it out."
        ),
    )

    def untestable(self, conditions: Conditions) -> str | None:
        """Return why no period can be seen, or None."""
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
        """Return families of harmonics that hold the wave found, each also with a difference by direction."""
        found = []
        for base, harmonics in families(conditions, 1.0 / own_shape(shape, CyclicShape).period, PARTS):
            found.append(CyclicShape(1.0 / base, harmonics))
            if conditions.both_directions:
                found.append(CyclicShape(1.0 / base, harmonics, by_direction=True))
        return found

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return sine and cosine of each harmonic, then each times the direction, shape (rows, amplitudes)."""
        own = own_shape(shape, CyclicShape)
        waves = harmonic_columns(conditions.position, own.period, own.harmonics)
        if not own.by_direction:
            return waves
        return np.hstack([waves, waves * self._needed(conditions.direction, "directions of approach")[:, None]])

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return sin_1, cos_1, sin_2, ...; then sin_1_by_direction, ..."""
        own = own_shape(shape, CyclicShape)
        names = harmonic_names(own.harmonics, units)
        return names + harmonic_names(own.harmonics, units, BY_DIRECTION) if own.by_direction else names

    def summary(self, shape: Shape, amplitudes: Sequence[float], units: Units) -> tuple[tuple[str, float, str], ...]:
        """Return period, harmonics, amplitude and phase of each, and peak to peak; forward and backward apart."""
        own = own_shape(shape, CyclicShape)
        head = (("period", own.period, units.position), ("harmonics", float(own.harmonics), ""))
        values = np.asarray(amplitudes, dtype=np.float64)
        if not own.by_direction:
            return head + harmonic_summary(values, units)
        both, differing = values[: 2 * own.harmonics], values[2 * own.harmonics :]
        forward = harmonic_summary(both + differing, units, "_forward")
        return head + forward + harmonic_summary(both - differing, units, "_backward")

    def _more_than_one_wave(self, shape: Shape) -> bool:
        own = own_shape(shape, CyclicShape)
        return own.harmonics > 1 or own.by_direction
