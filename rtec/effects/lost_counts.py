"""Counts lost or gained at a moment: from then on every position is wrong by the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from rtec.effects.conditions import Conditions, Floats, scheduled, too_few_moments
from rtec.effects.protocol import Card, Over, Quantity, ScannedEffect, Shape, own_shape, parameter

FEWEST_MOMENTS = 5
EDGE = 2
"""Readings before the first and after the last step: one reading alone is an outlier, no step."""
DENSEST = 0.1
"""Of the readings to the nearer end, how far apart moments to try may lie: a cosine of 0.97 between them."""
MOST_MOMENTS = 1000
MOST_NEARBY = 64


@dataclass(frozen=True, slots=True)
class StepShape(Shape):
    """When the counts were lost; spread over a while it is no loss of counts, but what that has to outdo."""

    moment: float = field(default=1.0, metadata=parameter(Quantity.CLOCK, "moment"))
    over: float = field(default=0.0, metadata=parameter(Quantity.CLOCK, "time that the change takes"))


class LostCounts(ScannedEffect):
    """A step in time.

    Notes
    -----
    ``deviation = step`` for readings after the moment, 0 before. A model may hold several.

    Examples
    --------
    >>> t = np.array([0.0, 1.0, 2.0, 3.0])
    >>> c = Conditions(position=np.zeros(4), position_unit="mm", run=np.ones(4, dtype=np.int64), time_s=t)
    >>> LostCounts().contribution(c, StepShape(1.5), [0.004]).tolist()
    [0.0, 0.0, 0.004, 0.004]
    """

    name = "lost_counts"
    amplitude = "step"
    over = Over.TIME
    shape_type = StepShape
    in_time = True
    data_checks = (partial(too_few_moments, fewest=FEWEST_MOMENTS), scheduled)
    card = Card(
        title="Lost counts",
        formula="`step` after a moment",
        needs="a time column",
        plot="A step against time: all later readings are shifted, usually by whole counts.",
        cause="Noise on the lines, an encoder faster than its receiver, a slipping coupling, a bumped target mirror.",
        consequence="All positions are wrong until the axis is referenced again.",
        action=(
            "Check the index after each cycle; check cables, shielding, supply, couplings, and the maximum frequency "
            "of encoder and receiver."
        ),
        invariant_to="position, direction and feed.",
        source=(
            "Yee (1992), altering the position signal: a decoder misses pulses that are too narrow, and each lost "
            "count shifts all later positions."
        ),
    )

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return moments between readings: between all of them, or denser towards both ends where they are many."""
        between = _between(conditions)
        last = between.size
        chosen, index = [], 0
        while index < last:
            chosen.append(index)
            readings = EDGE + min(index, last - index)
            index += max(1, min(int(DENSEST * readings), last // MOST_MOMENTS))
        return [StepShape(moment) for moment in between[chosen].tolist()]

    def variants(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        """Return the moments around the best of the scan that the scan left out, at most 64."""
        between = _between(conditions)
        reach = max(1, between.size // MOST_MOMENTS)
        here = int(np.searchsorted(between, own_shape(shape, StepShape).moment))
        near = between[max(0, here - reach) : here + reach + 1]
        if near.size > MOST_NEARBY:
            near = near[np.linspace(0, near.size - 1, MOST_NEARBY).astype(np.int64)]
        return sorted({shape, *(StepShape(moment) for moment in near.tolist())}, key=_moment)

    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        time = self._needed(conditions.time_s, "a time column")
        moments = np.array([_moment(shape) for shape in shapes])
        after: Floats = (time > moments[:, None]).astype(np.float64)
        for k, shape in enumerate(shapes):
            over = own_shape(shape, StepShape).over
            if over > 0.0:
                after[k] = np.clip((time - moments[k]) / over, 0.0, 1.0)
        return after[:, None, :]


def _moment(shape: Shape) -> float:
    return own_shape(shape, StepShape).moment


def _between(conditions: Conditions) -> Floats:
    """Return the moments half way between readings, without those near the ends, ascending."""
    moments = np.unique(conditions.clock)
    halves: Floats = (moments[1:] + moments[:-1]) / 2
    return halves[EDGE - 1 : halves.size - EDGE + 1]
