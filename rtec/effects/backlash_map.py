"""A reversal error that varies along the axis: play where the screw is worn, friction that winds it up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from rtec.effects._smooth import node_ladder, smooth_columns
from rtec.effects.conditions import Conditions, Floats, one_way
from rtec.effects.pitch_map import MapShape, PitchMap
from rtec.effects.protocol import Card, Quantity, Shape, own_shape, parameter
from rtec.errors import ArgumentError


@dataclass(frozen=True, slots=True)
class ReversalMapShape(MapShape):
    """Where the nodes stand, and whether one approach is right: else either is off by half of the reversal error.

    Raises
    ------
    ArgumentError
        Both of them.
    """

    forward_right: bool = field(default=False, metadata=parameter(Quantity.CHOICE, "right if approached forward"))
    backward_right: bool = field(default=False, metadata=parameter(Quantity.CHOICE, "right if approached backward"))

    def __post_init__(self) -> None:
        if self.forward_right and self.backward_right:
            raise ArgumentError("backward_right", "true beside forward_right", "one of the two: the other is off")

    @property
    def said_of_it(self) -> str:
        """Which approach is right."""
        return {1: "backward right", -1: "forward right"}.get(self.side, "")

    @property
    def side(self) -> int:
        """1 or -1 where only what is approached forward or backward is off, 0 where either is.

        Examples
        --------
        >>> ReversalMapShape(backward_right=True).side, ReversalMapShape().side
        (1, 0)
        """
        return int(self.backward_right) - int(self.forward_right)


class BacklashMap(PitchMap):
    """A natural cubic spline through nodes, times half of the direction of approach.

    Notes
    -----
    ``deviation = s(position) / 2 * direction``; the amplitudes are the reversal errors at the nodes. One-sided, the
    other approach is right everywhere: ``s(position) / 2 * (direction + side)``. Beside a ``pitch_map``, which may
    have half of any ``s``, the side says nothing.

    Examples
    --------
    >>> import numpy as np
    >>> x, way = np.array([0.0, 50.0, 100.0]), np.array([1.0, 1.0, -1.0])
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(3, dtype=np.int64), direction=way)
    >>> both = ReversalMapShape((0.0, 50.0, 100.0))
    >>> BacklashMap().contribution(c, both, [0.02, 0.03, 0.05]).round(9).tolist()
    [0.01, 0.015, -0.025]
    >>> back = ReversalMapShape((0.0, 50.0, 100.0), forward_right=True)
    >>> BacklashMap().contribution(c, back, [0.02, 0.03, 0.05]).round(9).tolist()
    [0.0, 0.0, -0.05]
    """

    name = "backlash_map"
    shape_type = ReversalMapShape
    card = Card(
        title="Backlash that varies along the axis",
        formula="`s(x)/2 · d`, or `s(x)/2 · (d ± 1)` where one approach is right",
        needs="both directions, at three positions at least",
        plot="The distance between forward and backward curve changes along the axis.",
        cause=(
            "Thread and nut worn where the machine works most; wind-up that changes along the screw; gibs tight at "
            "one end."
        ),
        consequence="One backlash value in the control is right at one place only.",
        action=(
            "Use a bidirectional compensation table; repair screw, nut or gibs where the reversal error has grown."
        ),
        invariant_to="time, feed and the distance since the reversal.",
        source=(
            "Thesis, section 3.1.2, Figure 3.2 and Table 3-3: variations of the backlash ask for separate tables by "
            "direction."
        ),
    )

    def untestable(self, conditions: Conditions) -> str | None:
        return super().untestable(conditions) or one_way(conditions)

    def tried(self, conditions: Conditions, shape: Shape) -> float:
        """Return the number of maps of both approaches, and three times that of a one-sided one: of each side."""
        own = own_shape(shape, ReversalMapShape)
        return super().tried(conditions, shape) * (3.0 if own.side else 1.0)

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return maps of few to many nodes, of both approaches."""
        return [ReversalMapShape(nodes) for nodes in node_ladder(conditions)]

    def variants(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        """Return maps of few to many nodes of the same approaches."""
        return [replace(own_shape(shape, ReversalMapShape), nodes=nodes) for nodes in node_ladder(conditions)]

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return the splines times half of the direction, shape (rows, nodes)."""
        own = own_shape(shape, ReversalMapShape)
        way = self._needed(conditions.direction, "directions of approach")
        return smooth_columns(conditions.position, own.nodes) * ((way + own.side) / 2)[:, None]
