"""An error that comes back every turn of a rotary encoder: its disc turns about another point than the shaft."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from rtec.effects._harmonics import Waves, WavesShape
from rtec.effects._periodic import WAVES_A_TARGET
from rtec.effects.conditions import Conditions
from rtec.effects.frequency_grid import resolved_harmonics
from rtec.effects.protocol import Card, Quantity, Shape, own_shape, parameter

LEAST_TURN = 0.5
FEWEST_PLACES = 4
MOST_HARMONICS = 4
"""A disc off centre, oval, and products of the two; the third harmonic of a magnet's field comes four times a turn.
Richer errors are a matter of gears and screws: ``cyclic``."""


@dataclass(frozen=True, slots=True)
class EccentricityShape(WavesShape):
    """A turn of the encoder, and how many waves of it there are: a second for an oval or tilted disc."""

    period: float = field(default=360.0, metadata=parameter(Quantity.POSITION, "a turn of the encoder"))
    harmonics: int = field(default=1, metadata=parameter(Quantity.COUNT, "harmonics"))


class Eccentricity(Waves):
    """A wave with the period of a turn, and up to three harmonics of it.

    Notes
    -----
    ``deviation = sum over k of sin_k sin(2 pi k x / period) + cos_k cos(2 pi k x / period)``, k up to 4. A disc off
    centre by e, read by one head at the radius r, gives ``arctan((e/r) sin a / (1 + (e/r) cos a))``: the amplitude
    e / r in radians, and half of its square twice a turn. A disc whose diameters differ by the share q, or that is
    tilted, adds a second wave of q / 2 radians. Because a turn closes, one turn is enough for all of them, where for
    an unstated period five cycles are asked for. The first wave has to take part: two waves a turn alone
    are no disc off centre, and ``cyclic``.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.array([0.0, 90.0, 180.0])
    >>> c = Conditions(position=x, position_unit="deg", run=np.ones(3, dtype=np.int64), revolution=360.0)
    >>> Eccentricity().contribution(c, Eccentricity().shapes(c)[0], [0.01, 0.0]).round(9).tolist()
    [0.0, 0.01, 0.0]
    """

    name = "eccentricity"
    shape_type = EccentricityShape
    card = Card(
        title="Eccentricity of a rotary encoder",
        formula="as `cyclic`, with the period of a turn, four harmonics at most",
        needs="a rotary axis, half a turn of it at least",
        plot="One wave a turn against the angle, often a second, little of a third and fourth, nothing higher.",
        cause=(
            "The disc's centre is off the shaft's: e at the radius r gives e/r radians, 4.1 arcsec for 1 um at 50 "
            "mm. An oval or tilted disc gives two waves a turn."
        ),
        consequence="Angles are wrong by a sine; an axis behind a screw gets a cyclic error with its pitch.",
        action=(
            "Centre the disc or magnet, or read it with two opposite heads; four heads remove the second wave too."
        ),
        invariant_to="whole turns, direction, speed and time.",
        source=(
            "Geometry of a disc off centre; Yee (1992), position feedback signals (rotary encoders on ball-screws)."
        ),
    )

    def untestable(self, conditions: Conditions) -> str | None:
        if conditions.revolution is None:
            return "no rotary axis, or its counts_per_rev is not stated"
        if conditions.places.size < FEWEST_PLACES:
            return f"{conditions.places.size} positions only: at least {FEWEST_PLACES} needed"
        if conditions.span >= LEAST_TURN * conditions.revolution * (1.0 - 1e-9):
            return None
        return f"{conditions.span / conditions.revolution:.2g} turns only: at least {LEAST_TURN:g} needed"

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return the richest form that the data can show, in which the others lie."""
        turn = conditions.revolution
        return [] if turn is None else self.variants(conditions, EccentricityShape(turn))[-1:]

    def tried(self, conditions: Conditions, shape: Shape) -> float:
        return float(len(self.variants(conditions, shape)))

    def variants(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        """Return one wave a turn, and with as many more as the places resolve: fewer where the turn is not full."""
        turn = own_shape(shape, EccentricityShape).period
        whole = round(MOST_HARMONICS * min(conditions.span / turn, 1.0))  # over a part more waves draw any curve
        few = int(WAVES_A_TARGET * conditions.places.size) // 2
        most = max(1, min(whole, few, resolved_harmonics(conditions, turn)))
        return [EccentricityShape(turn, harmonics) for harmonics in range(1, most + 1)]
