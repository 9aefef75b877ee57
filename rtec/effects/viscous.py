"""A force that grows with velocity: the shearing of lubricant, eddy currents."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rtec.effects._ladders import ladder
from rtec.effects.conditions import Conditions, Floats, no_speed
from rtec.effects.protocol import (
    Card,
    Observable,
    Over,
    Per,
    Quantity,
    ScannedEffect,
    Shape,
    Tunable,
    own_shape,
    parameter,
)

ONE_SPEED = 0.2
"""Of the usual speed: where half of the way in a direction was gone at speeds closer together, it is one speed."""
FLATTEST, STRAIGHTEST = 1.0, 5.0
"""Fade speeds that are tried, over the highest speed: friction that grows throughout, and 4 % less at the end."""
STEP = 1.5
"""Of the ladder of fade speeds."""


@dataclass(frozen=True, slots=True)
class ViscousShape(Shape):
    """At which speed half of the friction that a straight line foretells is left; 0 for a straight line."""

    fade: float = field(default=0.0, metadata=parameter(Quantity.SPEED, "speed that halves the coefficient"))


class Viscous(ScannedEffect):
    """Friction that grows with speed, in proportion or less.

    Notes
    -----
    ``force = viscous * velocity``, or ``viscous * velocity / (1 + (velocity / fade)**2)``, which is largest at the
    speed ``fade``: the drag of eddy currents (Wouterse 1991). A lubricant that thins as it is sheared flattens, too;
    the law says nothing of which it is.

    Examples
    --------
    >>> v = np.array([0.0, -50.0])
    >>> c = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64), velocity=v)
    >>> Viscous().contribution(c, ViscousShape(), [0.2]).tolist()
    [0.0, -10.0]
    >>> Viscous().contribution(c, ViscousShape(fade=100.0), [0.2]).tolist()
    [0.0, -8.0]
    """

    name = "viscous"
    over = Over.VELOCITY
    observable = Observable.DRIVE
    amplitude_per = Per.SPEED
    not_negative = True
    shape_type = ViscousShape
    card = Card(
        title="Viscous friction",
        formula="`viscous · v`, or `viscous · v / (1 + (v/fade)²)`",
        needs="moving data; several speeds to tell it from coulomb",
        plot="At constant speeds the force is proportional to the velocity, or flattens towards high speeds.",
        cause="Shearing of grease and oil in guideways, nut and bearings; eddy currents and back EMF of a motor.",
        consequence="Fast moves take force and make heat; vibrations are damped.",
        action=(
            "Enter it as velocity feed-forward. Much more than before: too much or too stiff grease; it falls as the "
            "machine warms up."
        ),
        invariant_to=(
            "position and acceleration; it changes with the lubricant's temperature. It cannot be below zero."
        ),
        source=(
            "Erwinski et al. (2019), section 3 and Figure 5: linear up to 500 mm/s, 20 % less than that at 2 m/s; "
            "Erwinski et al. (2016), section I; Wouterse (1991): the drag of eddy currents over speed."
        ),
    )

    def untestable(self, conditions: Conditions) -> str | None:
        one_speed = "one speed each way: not identifiable from dry friction"
        return no_speed(conditions) or (one_speed if one_speed_each_way(conditions) else None)

    def shapes(self, conditions: Conditions) -> Sequence[ViscousShape]:
        """Return a straight line, and fade speeds from the highest speed on."""
        top = _top_speed(conditions)
        return [ViscousShape(), *(ViscousShape(top * by) for by in ladder(FLATTEST, STRAIGHTEST, STEP) if top > 0.0)]

    def tried(self, conditions: Conditions, shape: Shape) -> float:
        """Return the number of shapes; a straight line is no choice."""
        return float(len(self.shapes(conditions))) if own_shape(shape, ViscousShape).fade > 0.0 else 1.0

    def variants(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        return self.shapes(conditions)

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        fade = own_shape(shape, ViscousShape).fade
        least = min(fade, FLATTEST * _top_speed(conditions))
        return (Tunable("fade", max(fade / STEP, least), fade * STEP),) if fade > 0.0 else ()

    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        velocity = self._needed(conditions.velocity, "a velocity or feed column").astype(float)
        fades = np.array([own_shape(shape, ViscousShape).fade or np.inf for shape in shapes])[:, None]
        found: Floats = (velocity / (1.0 + (velocity / fades) ** 2))[:, None, :]
        return found


def _top_speed(conditions: Conditions) -> float:
    whole = conditions.whole or conditions
    return 0.0 if whole.velocity is None else float(np.abs(whole.velocity).max())


def one_speed_each_way(conditions: Conditions) -> bool:
    """Return whether the axis moves at a single speed in each of two directions, but for starts, stops and noise."""
    if conditions.velocity is None or conditions.direction is None or not conditions.both_directions:
        return False
    for way in (-1.0, 1.0):
        speed = np.sort(np.abs(conditions.velocity[conditions.direction == way]))
        gone = np.cumsum(speed)  # not the time: a slow speed fills most of that
        low, usual, high = speed[np.searchsorted(gone, np.array([0.25, 0.5, 0.75]) * gone[-1])]
        if high - low > ONE_SPEED * usual:
            return False
    return True
