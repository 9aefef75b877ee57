"""An error that is largest just after a reversal and dies away: friction that is overcome late."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rtec.effects._ladders import ladder
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Card, Quantity, Shape, Tunable, own_shape, parameter
from rtec.effects.windup import FEWEST_DISTANCES, AfterReversal, distances


@dataclass(frozen=True, slots=True)
class SpikeShape(Shape):
    """Over which distance the error dies away to 37 %."""

    distance: float = field(default=1.0, metadata=parameter(Quantity.POSITION, "distance"))


class ReversalSpike(AfterReversal):
    """Half of a reversal error that falls to 37 % one distance after the reversal.

    Notes
    -----
    ``deviation = spike / 2 * direction * exp(-since_reversal / distance)``. Beside a constant reversal error the same
    curve is a wind-up: what grows towards a larger error is called ``windup``, what falls towards a smaller one a
    spike.

    Examples
    --------
    >>> way, gone = np.array([1.0, 1.0, -1.0]), np.array([0.0, 2.0, 2.0])
    >>> c = Conditions(
    ...     position=gone, position_unit="mm", run=np.ones(3, dtype=np.int64), direction=way, since_reversal=gone
    ... )
    >>> ReversalSpike().contribution(c, SpikeShape(2.0), [-0.02]).round(5).tolist()
    [-0.01, -0.00368, 0.00368]
    """

    name = "reversal_spike"
    amplitude = "spike"
    shape_type = SpikeShape
    card = Card(
        title="Reversal spike",
        formula="`spike/2 · d · exp(−r/distance)`",
        needs=(
            "both directions, or runs in one that begin at several places, with readings at four distances at least "
            "in the first quarter after a reversal"
        ),
        plot="After each reversal the deviation jumps and decays over a distance; on a circle four spikes.",
        cause=(
            "Static friction: the drive must build up force before the slide follows. Or a compensation of backlash "
            "or friction that is too large."
        ),
        consequence="Marks on contours where an axis reverses.",
        action=(
            "Tune the friction compensation, stiffen the velocity loop, lubricate. A spike of the other sign: the "
            "compensation is too large."
        ),
        invariant_to="position of the reversal, and time.",
        source="ISO 230-4; Erwinski et al. (2019), section 3: friction drops after standstill.",
    )

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return distances from half the shortest seen to a fifth of the span; longer: collinear with scale."""
        gone = distances(conditions)
        if gone.size < FEWEST_DISTANCES:
            return []
        return [SpikeShape(distance) for distance in ladder(gone[0] / 2, max(conditions.span / 5, gone[0]))]

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        """Return the distance, free by a half, up to a fifth of the span: beyond, it is collinear with a scale."""
        distance = own_shape(shape, SpikeShape).distance
        top = max(conditions.span / 5, distance)
        return (Tunable("distance", distance / 1.5, min(distance * 1.5, top)),)

    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        way = self._needed(conditions.direction, "directions of approach")
        gone = self._needed(conditions.since_reversal, "distances since the last reversal")
        over = np.array([own_shape(shape, SpikeShape).distance for shape in shapes])
        left: Floats = (way / 2) * np.exp(-gone / over[:, None])
        return left[:, None, :]
