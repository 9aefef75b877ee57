"""An error proportional to velocity: the servo follows late, or position is read late.

>>> from rtec.effects import Conditions, Shape
>>> import numpy as np
>>> v = np.array([0.0, 100.0])
>>> c = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64), velocity=v)
>>> servo_lag.contribution(c, Shape(), [0.002]).tolist()
[0.0, -0.2]
"""

from __future__ import annotations

from rtec.effects.conditions import Floats, no_speed
from rtec.effects.own import effect
from rtec.effects.protocol import Card, Observable, Per


@effect(
    over="velocity",
    amplitude="lag",
    amplitude_per=Per.DELAY,
    observable=Observable.DEVIATION,
    data_checks=(no_speed,),
    card=Card(
        title="Servo lag (delay)",
        formula="`−lag · v`",
        needs="a velocity or feed column, or moving data; several speeds to tell it from backlash",
        plot=(
            "In a log the deviation is proportional to velocity; in readings on the fly the two curves are twice the "
            "lag times the feed apart."
        ),
        cause=(
            "A position loop without feed-forward follows late by 1/kv; so does a reference, filter or bus that "
            "reads late."
        ),
        consequence="Corners are cut, circles shrink; unequal lags make ellipses.",
        action="Raise kv, match the axes, add velocity feed-forward; synchronise instrument and axis.",
        invariant_to="position, time, temperature and order of the moves; zero at standstill.",
        source="Erwinski et al. (2016), sections I and II.",
    ),
)
def servo_lag(velocity: Floats) -> Floats:
    """Return a delay.

    Notes
    -----
    ``deviation = -lag * velocity``: of a proportional position loop with gain kv the lag is 1 / kv, and a late
    reading of the position gives the same. In a test with stops the velocity is that of the approach.
    """
    return -velocity
