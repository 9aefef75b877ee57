"""An error proportional to acceleration: the servo or an elastic drive gives way to inertia."""

from __future__ import annotations

from rtec.effects.conditions import Conditions, Floats, no_acceleration
from rtec.effects.protocol import Effect, Over, Per, Shape


class AccelerationLag(Effect):
    """Following error that accelerating takes, on top of that of velocity.

    Notes
    -----
    ``deviation = -lag * acceleration``: of a drive with stiffness k that moves the mass m the lag is m / k, of a
    servo with velocity feed-forward it is 1 / (kp kv).

    Examples
    --------
    >>> import numpy as np
    >>> a = np.array([0.0, 1000.0])
    >>> c = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64), acceleration=a)
    >>> AccelerationLag().contribution(c, Shape(), [2e-6]).tolist()
    [0.0, -0.002]
    """

    name = "acceleration_lag"
    amplitude = "lag"
    amplitude_per = Per.DELAY_SQUARED
    over = Over.ACCELERATION
    data_checks = (no_acceleration,)

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        return -self._needed(conditions.acceleration, "accelerations of a moving axis")[:, None]
