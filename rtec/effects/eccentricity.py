"""An error that comes back once a turn of a rotary encoder: its disc turns about another point than the shaft."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from rtec.effects import experiments
from rtec.effects._harmonics import harmonic_columns, harmonic_names, harmonic_summary
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Amplitude, Card, Effect, Quantity, Rival, Shape, Units, own_shape, parameter

LEAST_TURN = 0.5
FEWEST_PLACES = 4


@dataclass(frozen=True, slots=True)
class EccentricityShape(Shape):
    """A turn of the encoder."""

    period: float = field(default=360.0, metadata=parameter(Quantity.POSITION, "a turn of the encoder"))


class Eccentricity(Effect):
    """A single wave with the period of a turn.

    Notes
    -----
    ``deviation = sin_1 sin(2 pi x / period) + cos_1 cos(2 pi x / period)``. A disc off centre by e, read at the
    radius r, gives the amplitude e / r in radians.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.array([0.0, 90.0, 180.0])
    >>> c = Conditions(position=x, position_unit="deg", run=np.ones(3, dtype=np.int64), revolution=360.0)
    >>> Eccentricity().contribution(c, Eccentricity().shapes(c)[0], [0.01, 0.0]).round(9).tolist()
    [0.0, 0.01, 0.0]
    """

    name = "eccentricity"
    needs = "a rotary axis, half a turn of it at least"
    shape_type = EccentricityShape
    rivals = (Rival("cyclic", experiments.SEVERAL_TURNS),)
    card = Card(
        title="Eccentricity of a rotary encoder",
        plot="One single wave a turn against angle; no higher harmonics.",
        cause=(
            "The graduated disc turns about another centre than the shaft: e off centre at the radius r gives e/r "
            "radians, 4.1 arcsec for 1 um at 50 mm."
        ),
        consequence=(
            "Angles are wrong by a sine of the angle; an axis behind a screw gets a cyclic error with its pitch."
        ),
        action="Centre the disc, or read it with two opposite heads.",
        invariant_to="whole turns, direction, speed and time.",
        source=(
            "Geometry of a disc off centre; NISTIR 4832, position feedback signals (rotary encoders on ball-screws)."
        ),
    )

    def untestable(self, conditions: Conditions) -> str | None:
        """Return why the data cannot show a wave of one turn, or None."""
        if conditions.revolution is None:
            return "no rotary axis, or its counts_per_rev is not stated"
        if conditions.places.size < FEWEST_PLACES:
            return f"{conditions.places.size} positions only: at least {FEWEST_PLACES} needed"
        if conditions.span >= LEAST_TURN * conditions.revolution * (1.0 - 1e-9):
            return None
        return f"{conditions.span / conditions.revolution:.2g} turns only: at least {LEAST_TURN:g} needed"

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return the wave of one turn."""
        turn = conditions.revolution
        return [] if turn is None else [EccentricityShape(turn)]

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return sine and cosine, shape (rows, 2)."""
        return harmonic_columns(conditions.position, own_shape(shape, EccentricityShape).period, 1)

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return sin_1 and cos_1."""
        return harmonic_names(1, units)

    def summary(self, shape: Shape, amplitudes: Sequence[float], units: Units) -> tuple[tuple[str, float, str], ...]:
        """Return the turn, amplitude and phase, and peak to peak."""
        own = own_shape(shape, EccentricityShape)
        return (("period", own.period, units.position), *harmonic_summary(amplitudes, units))
