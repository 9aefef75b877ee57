"""A constant error: where the zero of the axis and the zero of the instrument differ."""

from __future__ import annotations

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Effect, Shape


class Offset(Effect):
    """A constant.

    Notes
    -----
    ``deviation = offset``.

    Examples
    --------
    >>> c = Conditions(position=np.array([0.0, 5.0]), position_unit="mm", run=np.ones(2, dtype=np.int64))
    >>> Offset().contribution(c, Shape(), [0.003]).tolist()
    [0.003, 0.003]
    """

    name = "offset"

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        return np.ones((conditions.rows, 1))
