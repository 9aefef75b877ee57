"""A force proportional to acceleration: the moving mass."""

from __future__ import annotations

from rtec.effects.conditions import Conditions, Floats, no_acceleration
from rtec.effects.protocol import Effect, Observable, Over, Per, Shape


class Inertia(Effect):
    """Newton's second law.

    Notes
    -----
    ``force = inertia * acceleration``.

    Examples
    --------
    >>> import numpy as np
    >>> a = np.array([0.0, 2000.0])
    >>> c = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64), acceleration=a)
    >>> Inertia().contribution(c, Shape(), [0.1]).tolist()
    [0.0, 200.0]
    """

    name = "inertia"
    over = Over.ACCELERATION
    observable = Observable.DRIVE
    amplitude_per = Per.ACCELERATION
    not_negative = True
    data_checks = (no_acceleration,)

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return the acceleration, shape (rows, 1)."""
        return self._needed(conditions.acceleration, "accelerations of a moving axis")[:, None].astype(float)
