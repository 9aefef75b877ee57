"""An error that grows steadily in time: instrument, support or axis move slowly against each other."""

from __future__ import annotations

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Effect, Over, Per, Shape


class Drift(Effect):
    """A straight line in time, or in row order where the data have no time.

    Notes
    -----
    ``deviation = rate * clock``, with the clock in seconds since the first reading or in readings.

    Examples
    --------
    >>> c = Conditions(position=np.zeros(3), position_unit="mm", run=np.ones(3, dtype=np.int64))
    >>> Drift().contribution(c, Shape(), [0.5]).tolist()
    [0.0, 0.5, 1.0]
    """

    name = "drift"
    amplitude = "rate"
    amplitude_per = Per.CLOCK
    over = Over.TIME
    in_time = True

    def untestable(self, conditions: Conditions) -> str | None:
        return None if np.ptp(conditions.clock) > 0 else "one moment only"

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        return conditions.clock[:, None].astype(float)
