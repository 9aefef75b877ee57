"""An error proportional to velocity: the servo follows late, or position is read late."""

from __future__ import annotations

from rtec.effects.conditions import Conditions, Floats, no_speed
from rtec.effects.protocol import Effect, Over, Per, Shape


class ServoLag(Effect):
    """A delay.

    Notes
    -----
    ``deviation = -lag * velocity``: of a proportional position loop with gain kv the lag is 1 / kv, and a late
    reading of the position gives the same. In a test with stops the velocity is that of the approach.

    Examples
    --------
    >>> import numpy as np
    >>> v = np.array([0.0, 100.0])
    >>> c = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64), velocity=v)
    >>> ServoLag().contribution(c, Shape(), [0.002]).tolist()
    [0.0, -0.2]
    """

    name = "servo_lag"
    amplitude = "lag"
    amplitude_per = Per.DELAY
    over = Over.VELOCITY
    data_checks = (no_speed,)

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        return -self._needed(conditions.velocity, "a velocity or feed column")[:, None]
