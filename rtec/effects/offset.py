"""A constant error: where the zero of the axis and the zero of the instrument differ."""

from __future__ import annotations

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Card, Effect, Shape


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
    card = Card(
        title="Offset",
        formula="`offset`",
        needs="nothing",
        plot="All deviations are shifted by the same amount, in both directions and every run.",
        cause="Axis and instrument have different zeros: reference point, laser datum, home position.",
        consequence="Absolute positions are off by this amount; distances are right.",
        action="Zero the instrument at the reference point, or correct the reference point.",
        invariant_to="position, direction, feed, time and temperature.",
        source="ISO 230-2: the datum is free, only differences count.",
    )

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        return np.ones((conditions.rows, 1))
