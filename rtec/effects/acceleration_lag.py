"""An error proportional to acceleration: the servo or an elastic drive gives way to inertia.

>>> from rtec.effects import Conditions, Shape
>>> import numpy as np
>>> a = np.array([0.0, 1000.0])
>>> c = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64), acceleration=a)
>>> acceleration_lag.contribution(c, Shape(), [2e-6]).tolist()
[0.0, -0.002]
"""

from __future__ import annotations

from rtec.effects.conditions import Floats, no_acceleration
from rtec.effects.own import effect
from rtec.effects.protocol import Card, Observable, Per


@effect(
    over="acceleration",
    amplitude="lag",
    amplitude_per=Per.DELAY_SQUARED,
    observable=Observable.DEVIATION,
    data_checks=(no_acceleration,),
    card=Card(
        title="Acceleration lag",
        formula="`−lag · a`",
        needs="moving data with accelerations",
        plot=(
            "In a log the deviation peaks where the axis speeds up and slows down, with opposite signs, and vanishes "
            "at constant speed."
        ),
        cause=(
            "The drive yields to inertia (compliance m/k), or velocity feed-forward lacks acceleration feed-forward."
        ),
        consequence="Overshoot and undercut at the ends of moves and in sharp curves.",
        action="Add acceleration feed-forward, limit jerk, stiffen the drive, lighten the slide.",
        invariant_to="position, direction, constant speed, time and temperature.",
        source="Erwinski et al. (2016), section I: inertia and elastic coupling.",
    ),
)
def acceleration_lag(acceleration: Floats) -> Floats:
    """Return the following error that accelerating takes, on top of that of velocity.

    Notes
    -----
    ``deviation = -lag * acceleration``: of a drive with stiffness k that moves the mass m the lag is m / k, of a
    servo with velocity feed-forward it is 1 / (kp kv).
    """
    return -acceleration
