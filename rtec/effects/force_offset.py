"""A constant force: weight, an inclined axis, the zero of the amplifier."""

from __future__ import annotations

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Effect, Observable, Shape


class ForceOffset(Effect):
    """A constant.

    Notes
    -----
    ``force = force_offset``.

    Examples
    --------
    >>> c = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64))
    >>> ForceOffset().contribution(c, Shape(), [-3.0]).tolist()
    [-3.0, -3.0]
    """

    name = "force_offset"
    observable = Observable.DRIVE

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        return np.ones((conditions.rows, 1))
