"""A reversal error that is the same everywhere: play between drive and slide.

>>> from rtec.effects import Conditions, Shape
>>> import numpy as np
>>> way = np.array([1.0, -1.0])
>>> c = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64), direction=way)
>>> backlash.contribution(c, Shape(), [-0.02]).tolist()
[-0.01, 0.01]
"""

from __future__ import annotations

from rtec.effects.conditions import Floats, one_way
from rtec.effects.own import effect
from rtec.effects.protocol import Card, Observable


@effect(
    over="direction",
    observable=Observable.DEVIATION,
    data_checks=(one_way,),
    card=Card(
        title="Backlash (reversal error)",
        formula="`backlash/2 · d`",
        needs="both directions",
        plot="Forward and backward curves are a constant distance apart along the whole axis.",
        cause=(
            "Play between drive and slide: worn nut or gears, loose thrust bearing, lost preload. The opposite sign: "
            "the control corrects play that is not there."
        ),
        consequence="A position depends on the side of approach; contours show a step where an axis reverses.",
        action=(
            "Remove the play (nut preload, bearing, coupling), then set the control's backlash compensation to what "
            "is left."
        ),
        invariant_to="position, time, distance since the reversal, and feed (what shrinks with the feed is a lag).",
        source=(
            "Thesis, sections 2.3.4, 3.1.1 and 5.1: maximum reversal error 0.004181 inch; ISO 230-2, reversal value "
            "B."
        ),
    ),
)
def backlash(direction: Floats) -> Floats:
    """Return half of the lost motion, with the sign of the direction of approach.

    Notes
    -----
    ``deviation = backlash / 2 * direction``, so that the amplitude is the distance between the forward and the
    backward curve (positive where the forward curve lies higher; play itself leaves the slide behind, which is
    negative). Where a moving log is at rest its direction is 0, and so is the contribution.
    """
    return direction / 2
