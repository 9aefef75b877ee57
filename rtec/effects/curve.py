"""A smooth curve over whatever an error depends on: no physics and no name, learned where nothing else fits."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from rtec.effects._smooth import smooth_columns
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Amplitude, Card, Effect, Over, Quantity, Shape, Units, own_shape, parameter
from rtec.effects.quantities import PHASES, is_slow, meant, missing, quantity_of, unit_of
from rtec.errors import ArgumentError

PREFIX = "curve"
"""Name of the effect, and what stands in front of what a curve is over: ``curve:velocity``."""
_COUNTS = (4, 5, 6, 7, 8, 10, 12, 14, 17, 20, 24, 28, 34, 40, 50, 60, 80)
"""Nodes that are tried of a curve over one quantity."""
_SIDES = (2, 4, 6, 10, 17, 28, 40)
"""Nodes that are tried along each side of a surface over two."""
_MOST_NODES = 200
"""Of a surface."""
_VALUES_A_NODE = 1.6
"""Distinct values of a quantity that a node needs at least: what is left has to show whether the curve fits."""
_MOST_IN_A_PERIOD = 12
"""Nodes over the phase of a period: with more it follows each target, as the phases of targets are scattered."""
_REPEATS, _MOST_IN_TABLE = 4.0, 170
"""Readings of each value of a quantity from which a node stands at each as well, and most of such values."""
_REACH = 2.0
"""Nodes over which a curve is correlated beforehand."""
_MOST_RUNS = 12
"""Runs that have a node each."""
_CROWDED = frozenset({"velocity", "acceleration", "since_reversal"})
"""What happens near zero matters most: nodes stand closer there, at the squares of even steps."""
_BY = {"position": Over.POSITION, "velocity": Over.VELOCITY, "acceleration": Over.ACCELERATION,
       "since_reversal": Over.REVERSAL, "direction": Over.REVERSAL, "run": Over.RUN}  # fmt: skip


@dataclass(frozen=True, slots=True)
class CurveShape(Shape):
    """What a curve is over, and where its nodes stand, in the units inside of its quantities."""

    over: str = field(default="position", metadata=parameter(Quantity.TEXT, "quantity"))
    across: str = field(default="", metadata=parameter(Quantity.TEXT, "second quantity", optional=True))
    by_direction: bool = field(default=False, metadata=parameter(Quantity.CHOICE, "another curve for each direction"))
    nodes: tuple[float, ...] = field(default=(), metadata=parameter(Quantity.NUMBER, "nodes"))
    nodes_across: tuple[float, ...] = field(
        default=(), metadata=parameter(Quantity.NUMBER, "nodes of the second quantity", optional=True)
    )

    @property
    def said_of_it(self) -> str:
        """What it is over."""
        ways = " by direction" if self.by_direction else ""
        return f"over {self.over.replace('_', ' ')}{f' and {self.across}' if self.across else ''}{ways}"


class Curve(Effect):
    """A natural cubic spline through nodes over one quantity, or the product of two over two.

    Parameters
    ----------
    text
        What it is over, as behind ``curve:``: ``velocity``, ``position*direction``, ``position*time``.

    Raises
    ------
    ArgumentError
        More than two quantities, or one twice.

    Examples
    --------
    >>> c = Conditions(position=np.array([0.0, 5.0, 10.0]), position_unit="mm", run=np.ones(3, dtype=np.int64))
    >>> Curve("position").contribution(c, CurveShape("position", nodes=(0.0, 10.0)), [0.0, 0.004]).round(5).tolist()
    [0.0, 0.00124, 0.00248]
    """

    name = PREFIX
    observable = None
    shape_type = CurveShape
    is_map = True
    card = Card(
        title="Learned curve",
        formula="`s(q)`, or `s(q, r)`",
        needs="a column of what it is over",
        plot="A smooth curve over any quantity, with a band of two standard errors.",
        cause="Unknown: it is what the data show, and no physics.",
        consequence="As that of any error that is not understood: the curve corrects it where it was measured only.",
        action="Look at its form, think of what does that, and write it as an effect of your own.",
        invariant_to="everything that it is not over.",
        source="Wahba (1990), chapter 1: smoothing splines.",
    )

    def __init__(self, text: str = "") -> None:
        parts = [part.strip() for part in text.split("*")] if text else []
        self.by_direction = "direction" in parts and len(parts) > 1
        self.quantities = [part for part in parts if not (part == "direction" and self.by_direction)]
        if len(self.quantities) > 2 or len(set(self.quantities)) < len(self.quantities) or not all(parts):
            allowed = "one quantity or two, such as curve:velocity, curve:position*direction, curve:position*time"
            raise ArgumentError("effect", repr(f"{PREFIX}:{text}")[:60], allowed)
        self.in_time = any(is_slow(name) for name in self.quantities)
        if self.quantities:
            self.over = _BY.get(self.quantities[0], Over.TEMPERATURE if "temp" in self.quantities[0] else Over.TIME)

    @property
    def text(self) -> str:
        """What it is over, as behind ``curve:``."""
        return "*".join([*self.quantities, *(["direction"] if self.by_direction else [])])

    def untestable(self, conditions: Conditions) -> str | None:
        if not self.quantities:
            return "a curve is over something: curve:velocity, curve:position*time"
        for name in self.quantities:
            values = quantity_of(conditions, name)
            if values is None:
                return missing(conditions, name)
            if _distinct(conditions, name) < 2:
                return f"{name} never changes"
        if self.by_direction and not conditions.both_directions:
            return "one direction only"
        return None if self.shapes(conditions) else f"too few values of {' and '.join(self.quantities)}"

    def shapes(self, conditions: Conditions) -> Sequence[CurveShape]:
        """Return nodes to try, from few to many."""
        if not self.quantities or any(quantity_of(conditions, name) is None for name in self.quantities):
            return ()
        each = conditions.rows / (6.0 if self.by_direction else 3.0)
        ladders = [
            _ladder(conditions, name, _COUNTS if len(self.quantities) == 1 else _SIDES) for name in self.quantities
        ]
        if len(self.quantities) == 1:
            (over,) = self.quantities
            every = [_nodes(conditions, over, n) for n in ladders[0] if n <= each]
            if over not in PHASES and 2 <= _distinct(conditions, over) <= min(each / _REPEATS * 3.0, _MOST_IN_TABLE):
                every.append(_values(conditions, over))
            return [CurveShape(over, by_direction=self.by_direction, nodes=nodes) for nodes in every]
        over, across = self.quantities
        grids = itertools.product(*ladders)
        return [
            CurveShape(over, across, self.by_direction, _nodes(conditions, over, a), _nodes(conditions, across, b))
            for a, b in sorted(grids, key=lambda grid: (grid[0] * grid[1], grid))
            if a * b <= min(each, _MOST_NODES)
        ]

    def variants(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        return self.shapes(conditions)

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return smooth columns that span the splines through the nodes; of two quantities their products."""
        own = own_shape(shape, CurveShape)
        needed = [own.over, *([own.across] if own.across else []), *(["direction"] if own.by_direction else [])]
        values = {name: self._needed(quantity_of(conditions, name), meant(name)) for name in needed}
        nothing = np.zeros(conditions.rows)
        return curve_columns(own, values[own.over], values.get(own.across, nothing), values.get("direction", nothing))

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        own = own_shape(shape, CurveShape)
        count = max(len(own.nodes), 1) * max(len(own.nodes_across), 1) * (2 if own.by_direction else 1)
        return tuple(Amplitude(f"part_{k + 1}", *units.shown) for k in range(count))

    def summary(self, shape: Shape, amplitudes: Sequence[float], units: Units) -> tuple[tuple[str, float, str], ...]:
        """Return the number of nodes, and the difference of the largest and the least value at them."""
        own, (unit, factor) = own_shape(shape, CurveShape), units.shown
        grid = [np.asarray(nodes or (0.0,)) for nodes in (own.nodes, own.nodes_across)]
        at, across = (values.ravel() for values in np.meshgrid(*grid, indexing="ij"))
        ways = (1.0, -1.0) if own.by_direction else (0.0,)
        values = [curve_columns(own, at, across, np.full(at.size, way)) @ np.asarray(amplitudes) for way in ways]
        return ("nodes", float(len(amplitudes)), ""), ("peak_to_peak", factor * float(np.ptp(values)), unit)


def curve_columns(shape: CurveShape, at: Floats, across: Floats, way: Floats) -> Floats:
    """Return the columns of a curve at values of its quantities and directions, shape (rows, amplitudes).

    Beyond the outer nodes a curve stays what it is there.
    """
    table = _along(shape.over, shape.nodes, at)
    if shape.across:
        other = _along(shape.across, shape.nodes_across, across)
        table = (table[:, :, None] * other[:, None, :]).reshape(at.size, -1)
    return np.hstack([table, table * way[:, None]]) if shape.by_direction else table


def _along(name: str, nodes: tuple[float, ...], at: Floats) -> Floats:
    """Return the columns of a curve over one quantity, shape (rows, nodes)."""
    table = smooth_columns(np.clip(at, nodes[0], nodes[-1]), nodes)
    return table if name == "run" else table @ _root(len(nodes))


@lru_cache
def _root(count: int) -> Floats:
    """Return the root of the covariance of neighbouring nodes, shape (count, count).

    Amplitudes are held towards zero each by itself; through this a curve is held towards its neighbourhood instead,
    where nothing was measured as well.

    References
    ----------
    C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning (2006), equation 4.17: Matern's
    covariance of order 3/2.
    """
    apart = np.sqrt(3.0) * np.abs(np.subtract.outer(np.arange(count), np.arange(count))) / _REACH
    root: Floats = np.linalg.cholesky((1.0 + apart) * np.exp(-apart))
    return root


def axis_label(conditions: Conditions, name: str) -> str:
    """Return how an axis of a picture is labelled: a quantity with its unit."""
    unit = unit_of(conditions, name)
    return f"{name.replace('_', ' ')} ({unit})" if unit else name.replace("_", " ")


def _values(conditions: Conditions, name: str) -> tuple[float, ...]:
    values = quantity_of(conditions, name)
    return () if values is None else tuple(np.unique(values[np.isfinite(values)]).tolist())


def _distinct(conditions: Conditions, name: str) -> int:
    return len(_values(conditions, name))


def _ladder(conditions: Conditions, name: str, counts: Sequence[int]) -> list[int]:
    """Return the numbers of nodes to try over a quantity; over the run one for each."""
    distinct = _distinct(conditions, name)
    if name == "run":
        return [distinct] if 2 <= distinct <= _MOST_RUNS else []
    most = min(distinct / _VALUES_A_NODE, _MOST_IN_A_PERIOD if name in PHASES else np.inf)
    return [n for n in counts if n <= most]


def _nodes(conditions: Conditions, name: str, count: int) -> tuple[float, ...]:
    values = quantity_of(conditions, name)
    assert values is not None  # noqa: S101 - asked before
    known = values[np.isfinite(values)]
    low, high = float(known.min()), float(known.max())
    step = np.linspace(0.0, 1.0, count)
    if name in _CROWDED:
        reach = max(abs(low), abs(high))
        ends = np.sign([low, high]) * np.sqrt(np.abs([low, high]) / reach)
        even = ends[0] + (ends[1] - ends[0]) * step
        return tuple(np.unique(np.sign(even) * even**2 * reach).tolist())
    return tuple((low + (high - low) * step).tolist())
