"""An error that is a smooth function of position: the screw's or the scale's own map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rtec.effects._smooth import node_ladder, node_names, smooth_columns
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Amplitude, Card, Effect, Quantity, Shape, Units, own_shape, parameter

CIRCLE = (0.75, 1.5)
"""Turns of a rotary axis over which a map is none: the end of the turn is its beginning."""
_FINE = 50
"""Places for each node at which a map is looked at."""


@dataclass(frozen=True, slots=True)
class MapShape(Shape):
    """Where the nodes of a map stand."""

    nodes: tuple[float, ...] = field(default=(), metadata=parameter(Quantity.POSITION, "nodes"))


class PitchMap(Effect):
    """A natural cubic spline through nodes.

    Notes
    -----
    ``deviation = s(position)``; the amplitudes are the values of ``s`` at the nodes. With at most twelve targets a
    node stands at each, and the map is the table of a bidirectional compensation's mean (thesis 3.1.1); beyond the
    outer nodes it goes on straight.

    Examples
    --------
    >>> x = np.array([0.0, 50.0, 100.0])
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(3, dtype=np.int64))
    >>> PitchMap().contribution(c, MapShape((0.0, 50.0, 100.0)), [0.0, 0.004, 0.001]).round(9).tolist()
    [0.0, 0.004, 0.001]
    """

    name = "pitch_map"
    shape_type = MapShape
    is_map = True
    card = Card(
        title="Pitch map",
        formula="`s(x)`",
        needs="positions dense enough: three at least",
        plot="A smooth curve against position, the same in both directions and every run.",
        cause=(
            "The screw's lead or the scale's graduation varies along its length, or the guideways are not straight "
            "(Abbe error)."
        ),
        consequence="The error of a length depends on where along the axis it lies.",
        action=(
            "Remove errors of heat, direction and time from the measurement, then load a compensation table with "
            "enough points."
        ),
        invariant_to="direction, feed, time and mostly temperature.",
        source="Thesis, section 3.1.1, Figure 3.1 and Table 3-1; Yee (1992), introduction: leadscrew nonlinearity.",
    )

    def untestable(self, conditions: Conditions) -> str | None:
        if conditions.time_is_coordinate:
            return "no positions: time stands for them, and what is smooth in time is a drift or a warm-up"
        if closes(conditions):
            return "one turn of a rotary axis closes: what is smooth over it comes back every turn (cyclic)"
        count = conditions.places.size
        return (
            None if node_ladder(conditions) else f"{count} position{'s' if count > 1 else ''} only: at least 3 needed"
        )

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        return [MapShape(nodes) for nodes in node_ladder(conditions)]

    def variants(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        return self.shapes(conditions)

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return the splines that are 1 at one node, shape (rows, nodes)."""
        return smooth_columns(conditions.position, own_shape(shape, MapShape).nodes)

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        return tuple(Amplitude(name, *units.shown) for name in node_names(own_shape(shape, MapShape).nodes))

    def summary(self, shape: Shape, amplitudes: Sequence[float], units: Units) -> tuple[tuple[str, float, str], ...]:
        """Return how many nodes there are, and mean, ends of the range and peak to peak value along the axis."""
        unit, factor = units.shown
        nodes = own_shape(shape, MapShape).nodes
        places = np.union1d(nodes, np.linspace(nodes[0], nodes[-1], _FINE * len(nodes)))
        along = factor * (smooth_columns(places, nodes) @ np.asarray(amplitudes))
        mean = float(np.average((along[1:] + along[:-1]) / 2.0, weights=np.diff(places)))
        low, high = float(along.min()), float(along.max())
        numbers = {"mean": mean, "least": low, "largest": high, "peak_to_peak": high - low}
        return ("nodes", float(len(nodes)), ""), *((name, value, unit) for name, value in numbers.items())


def closes(conditions: Conditions) -> bool:
    """Return whether the data are of about one turn of a rotary axis, whose end is its beginning."""
    turn = conditions.revolution
    return turn is not None and CIRCLE[0] * turn <= conditions.span <= CIRCLE[1] * turn
