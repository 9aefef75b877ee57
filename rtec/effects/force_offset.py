"""A constant force: weight, an inclined axis, the zero of the amplifier."""

from __future__ import annotations

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Card, Effect, Observable, Shape


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
    card = Card(
        title="Constant force",
        formula="`force_offset`",
        needs="nothing",
        plot="Force is shifted by the same amount in both directions and at rest.",
        cause=(
            "Weight of an axis that is not fully balanced, a cable or spring that pulls, the zero of the current "
            "sensor."
        ),
        consequence="The drive holds against it at rest and heats up.",
        action="Set the zero of the amplifier, balance the weight, or enter it as feed-forward.",
        invariant_to="position, direction, speed and acceleration.",
        source="Erwinski et al. (2019), section 3: an inclined motion unit.",
    )

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        return np.ones((conditions.rows, 1))
