"""An error proportional to position: the lead of the screw or the factor of the scale is wrong.

>>> from rtec.effects import Conditions, Shape
>>> import numpy as np
>>> c = Conditions(position=np.array([0.0, 500.0]), position_unit="mm", run=np.ones(2, dtype=np.int64))
>>> scale.contribution(c, Shape(), [20e-6]).tolist()
[0.0, 0.01]
"""

from __future__ import annotations

from rtec.effects.conditions import Conditions, Floats, one_place
from rtec.effects.own import effect
from rtec.effects.protocol import Card, Observable, Per


def _nowhere(conditions: Conditions) -> str | None:
    if conditions.time_is_coordinate:
        return "no positions: time stands for them, and what is proportional to time is a drift"
    return None


@effect(
    over="position",
    amplitude_per=Per.LENGTH,
    observable=Observable.DEVIATION,
    data_checks=(
        _nowhere,
        one_place,
    ),
    card=Card(
        title="Scale error (lead)",
        formula="`scale · x`",
        needs="spread of positions",
        plot="The deviation is a straight line against position, the same in both directions.",
        cause=(
            "The screw's lead or the scale's graduation is off by a constant factor: stretched or warm, wrong factor "
            "in the control, or wrong weather data of the laser."
        ),
        consequence="Lengths are wrong in proportion to their size.",
        action=(
            "Check the laser's air and material temperature, pressure and humidity; then correct the factor or load "
            "a linear compensation."
        ),
        invariant_to="direction, feed and time; a shifted zero adds only an offset.",
        source='Thesis, section 5.1: the machine positions "long" by about 0.0012 inch over 39 inch.',
    ),
)
def scale(position: Floats) -> Floats:
    """Return a straight line through position zero.

    Notes
    -----
    ``deviation = scale * position``; on a linear axis in um/m, which is parts in a million.
    """
    return position
