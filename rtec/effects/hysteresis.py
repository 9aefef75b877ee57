"""Presliding with memory: what a reversal undoes depends on all reversals before it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rtec.effects._ladders import ladder
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Card, Over, Quantity, ScannedEffect, Shape, Tunable, own_shape, parameter
from rtec.effects.windup import shortest

ELEMENTS = 24
"""Springs that slip one after the other, each at the same force: their curve is an exponential within 0.4 %."""
FEWEST_STROKES = 4
DIFFERENT = 2.0
"""How many times as long as a short stroke a long one has to be: of equal strokes each loop is the same."""
LONGEST = 100.0
"""Distances in the longest stroke that is looked into. Ten make them forget all before; the first stroke tells."""


@dataclass(frozen=True, slots=True)
class HysteresisShape(Shape):
    """Over which distance the springs slip, and whether a log begins with all of them bent by the motion before."""

    distance: float = field(default=1.0, metadata=parameter(Quantity.POSITION, "distance"))
    settled: bool = field(default=False, metadata=parameter(Quantity.CHOICE, "bent before the log began"))


class Hysteresis(ScannedEffect):
    """Springs in parallel, each of which slips at a limit of its own.

    Notes
    -----
    ``deviation = hysteresis / 2 * h``, where h is the mean of elements that follow the way until they slip, from -1
    to 1 where all of them do; the ways to slip are spread (a gamma distribution of order 2 over force) so that from
    nothing ``h = 1 - exp(-way / distance)``. A reversal within a loop makes a smaller loop that closes where it began
    (Masing's rules), which ``windup`` does not.

    Examples
    --------
    >>> x = np.concatenate([np.linspace(0.0, 20.0, 81), np.linspace(20.0, 0.0, 81)])
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(162, dtype=np.int64), moving=True)
    >>> Hysteresis().contribution(c, HysteresisShape(2.0), [-0.02])[[0, 8, 80, 161]].round(4).tolist()
    [0.0, -0.0063, -0.01, 0.0099]
    """

    name = "hysteresis"
    over = Over.REVERSAL
    shape_type = HysteresisShape
    card = Card(
        title="Hysteresis with memory",
        formula="`hysteresis/2 · h`, h from −1 to 1, by all earlier reversals",
        needs="moving data with reversals of different lengths",
        plot=(
            "Deviation against position is a leaf; a short stroke within a long one draws a smaller leaf that closes "
            "where it began."
        ),
        cause=(
            "Presliding: asperities, seals, balls and gear teeth bend like springs before they slip, each at its own "
            "force."
        ),
        consequence="A short move comes to rest elsewhere than a long one.",
        action=(
            "Approach from one side with long strokes, reduce friction and preload, or compensate with a model that "
            "remembers the turning points."
        ),
        invariant_to="feed, time, and position along the axis.",
        source="Iwan (1966); Al-Bender, Lampaert and Swevers (2005).",
    )

    def untestable(self, conditions: Conditions) -> str | None:
        if not conditions.moving or conditions.time_is_coordinate:
            return "no moving data"
        ways = strokes(conditions)
        if ways.size < FEWEST_STROKES:
            return f"{ways.size} strokes between reversals only: at least {FEWEST_STROKES} needed"
        short, long = np.quantile(ways, [0.1, 0.9])
        return None if long >= DIFFERENT * short else "all strokes are of one length: confounded with windup"

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return distances from a hundredth of a short stroke to half the longest; longer: collinear with scale."""
        ways = strokes(conditions)
        if not ways.size:
            return []
        least = max(float(np.quantile(ways, 0.1)) / LONGEST, _least(conditions))
        scanned = ladder(least, max(float(ways.max()) / 2, least))
        return [HysteresisShape(distance, settled) for distance in scanned for settled in (False, True)]

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        distance = own_shape(shape, HysteresisShape).distance
        return (Tunable("distance", min(max(distance / 1.5, _least(conditions)), distance), distance * 1.5),)

    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        from scipy.special import gammaincinv  # noqa: PLC0415 - as the next, for logs only

        from rtec.effects._hysteresis_kernels import bend  # noqa: PLC0415 - loads numba, for logs only

        own = [own_shape(shape, HysteresisShape) for shape in shapes]
        # springs with the share (1 + w) exp(-w) of the force slip beyond w distances: the curve is 1 - exp(-w)
        slips = gammaincinv(2.0, (np.arange(ELEMENTS) + 0.5) / ELEMENTS)
        ways_to_slip = np.array([shape.distance for shape in own])[:, None] * slips
        whole, rows = conditions.path
        ways = np.diff(whole.position)
        first = float(np.sign(ways[np.flatnonzero(ways)[:1]]).sum())
        begin = np.array([first if shape.settled else 0.0 for shape in own])
        found = np.empty((len(own), whole.rows))
        bend(whole.position, whole.motion_begins, begin, ways_to_slip, np.empty(ELEMENTS), found)
        return found[:, None, rows] / 2.0


def _least(conditions: Conditions) -> float:
    """Return the shortest distance that readings show: after a reversal the springs bend over twice the distance."""
    return shortest(conditions) / 2.0


def strokes(conditions: Conditions) -> Floats:
    """Return how far the axis goes between two reversals, shape (strokes,), in the unit of position."""
    conditions, _ = conditions.path
    if conditions.direction is None:
        return np.empty(0)
    way = conditions.direction
    turned = np.flatnonzero((np.diff(way) != 0.0) | conditions.motion_begins[1:])
    ends = conditions.position[np.concatenate([[0], turned, [conditions.rows - 1]])]
    gone = np.abs(np.diff(ends))
    found: Floats = gone[gone > 0.0]
    return found
