"""A reversal error that is the same everywhere: play between drive and slide."""

from __future__ import annotations

from rtec.effects.conditions import Conditions, Floats, one_way
from rtec.effects.protocol import Effect, Over, Shape


class Backlash(Effect):
    """Half of the lost motion, with the sign of the direction of approach.

    Notes
    -----
    ``deviation = backlash / 2 * direction``, so that the amplitude is the distance between the forward and the
    backward curve (positive where the forward curve lies higher; play itself leaves the slide behind, which is
    negative). Where a moving log is at rest its direction is 0, and so is the contribution.

    Examples
    --------
    >>> import numpy as np
    >>> way = np.array([1.0, -1.0])
    >>> c = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64), direction=way)
    >>> Backlash().contribution(c, Shape(), [-0.02]).tolist()
    [-0.01, 0.01]
    """

    name = "backlash"
    over = Over.REVERSAL
    data_checks = (one_way,)

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        return self._needed(conditions.direction, "directions of approach")[:, None] / 2
