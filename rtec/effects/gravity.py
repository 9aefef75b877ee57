"""A weight: constant on a linear axis; on a rotary one the torque goes once up and down in a turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rtec.effects._harmonics import harmonic_columns, harmonic_names, harmonic_summary
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Amplitude, Card, Effect, Observable, Quantity, Shape, Units, own_shape, parameter

TURN_DEG = 360.0
WIDE_DEG = 270.0
"""Of angles, from which on a second wave can be told from a constant beside the first."""
LEAST_SPAN_DEG = 5.0
"""Below, sine and cosine are a straight line and a constant to 0.1 % of the amplitude."""


@dataclass(frozen=True, slots=True)
class GravityShape(Shape):
    """How many waves a turn there are: a second where another joint turns along."""

    harmonics: int = field(default=1, metadata=parameter(Quantity.COUNT, "harmonics"))


class Gravity(Effect):
    """Sine and cosine of the angle of a rotary axis, and of twice that where another joint turns along; a constant.

    Notes
    -----
    ``torque = sin_1 sin(angle) + cos_1 cos(angle)``, which is ``m g r sin(angle + phase)`` of a mass m at a distance
    r from an axis of rotation that lies horizontally; the phase says where the arm hangs. An arm on a second joint
    that is moved by the same angle adds the same of twice the angle. On a linear axis a weight is a constant,
    ``force = weight``: its column is that of ``force_offset``, beside which it is listed and not ranked.

    Examples
    --------
    >>> import numpy as np
    >>> q = np.array([0.0, 90.0, 210.0])
    >>> c = Conditions(position=q, position_unit="deg", run=np.ones(3, dtype=np.int64))
    >>> Gravity().contribution(c, GravityShape(), [3.0, 0.0]).round(9).tolist()
    [0.0, 3.0, -1.5]
    """

    name = "gravity"
    observable = Observable.DRIVE
    shape_type = GravityShape
    card = Card(
        title="Gravity",
        formula="`Σ sin_k sin(kx) + cos_k cos(kx)`, k up to 2",
        needs="a rotary axis that turns by 5 deg at least, or a linear one, where it is a constant",
        plot=(
            "Torque is one wave a turn, the same in both directions and at every speed, largest where the arm is "
            "horizontal; on a linear axis a constant."
        ),
        cause="The weight of arm, tool and load at a distance from the axis of rotation.",
        consequence="The drive holds against it at rest; a move takes more torque up than down.",
        action=(
            "Balance the arm, feed the torque forward by the angle, or enter mass and centre of the load in the "
            "controller."
        ),
        invariant_to="direction, speed, acceleration and time; it changes with load and mounting.",
        source="Swevers et al. (1997); Erwinski et al. (2019), section 3: an inclined motion unit.",
    )

    def untestable(self, conditions: Conditions) -> str | None:
        if conditions.position_unit == "mm":
            return None
        if conditions.position_unit != "deg":
            return "no angles"
        span = conditions.span
        return None if span >= LEAST_SPAN_DEG else f"the axis turns by {span:.3g} deg only: {LEAST_SPAN_DEG:g} needed"

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return the richest form that the data can show, in which the other lies."""
        return self.variants(conditions, GravityShape())[-1:]

    def tried(self, conditions: Conditions, shape: Shape) -> float:
        return float(len(self.variants(conditions, shape)))

    def variants(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        """Return one arm, and an arm on another that turns along."""
        return [GravityShape(harmonics) for harmonics in ((1, 2) if conditions.span >= WIDE_DEG else (1,))]

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return sine and cosine of the angle and its multiples, shape (rows, 2 harmonics); ones on a linear axis."""
        own = own_shape(shape, GravityShape)
        if conditions.position_unit == "mm":
            return np.ones((conditions.rows, 1))
        return harmonic_columns(conditions.position, TURN_DEG, own.harmonics)

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return sin_1, cos_1, ...; on a linear axis the weight."""
        if units.position == "mm":
            return (Amplitude("weight", *units.shown),)
        return harmonic_names(own_shape(shape, GravityShape).harmonics, units)

    def summary(self, shape: Shape, amplitudes: Sequence[float], units: Units) -> tuple[tuple[str, float, str], ...]:
        """Return amplitude and phase of each wave, ``amplitude_k sin(k angle + phase_k)``, or the weight."""
        if units.position == "mm":
            return super().summary(shape, amplitudes, units)
        return harmonic_summary(amplitudes, units)[:-1]
