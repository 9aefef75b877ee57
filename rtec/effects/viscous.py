"""A force proportional to velocity: the shearing of lubricant, eddy currents."""

from __future__ import annotations

import numpy as np

from rtec.effects.conditions import Conditions, Floats, no_speed
from rtec.effects.protocol import Card, Effect, Observable, Over, Per, Shape

ONE_SPEED = 0.2
"""Of the usual speed: where half of the way in a direction was gone at speeds closer together, it is one speed."""


class Viscous(Effect):
    """Friction that grows with speed.

    Notes
    -----
    ``force = viscous * velocity``.

    Examples
    --------
    >>> v = np.array([0.0, -50.0])
    >>> c = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64), velocity=v)
    >>> Viscous().contribution(c, Shape(), [0.2]).tolist()
    [0.0, -10.0]
    """

    name = "viscous"
    over = Over.VELOCITY
    observable = Observable.DRIVE
    amplitude_per = Per.SPEED
    not_negative = True
    card = Card(
        title="Viscous friction",
        formula="`viscous · v`",
        needs="moving data; several speeds to tell it from coulomb",
        plot="At constant speeds the force is proportional to the velocity.",
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
            "Erwinski et al. (2016), section I."
        ),
    )

    def untestable(self, conditions: Conditions) -> str | None:
        one_speed = "one speed each way: not identifiable from dry friction"
        return no_speed(conditions) or (one_speed if one_speed_each_way(conditions) else None)

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        return self._needed(conditions.velocity, "a velocity or feed column")[:, None].astype(float)


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
