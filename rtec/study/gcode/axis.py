"""What is commanded so that one axis reaches a place, and the error that is left of it."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from dataclasses import dataclass, field

import numpy as np

from rtec.effects import Floats
from rtec.predictors import FORWARD, REVERSE, Predictor
from rtec.study.compensation import Compensation

_TIMES = 2
"""Corrections of a correction; an error changes by far less than a tenth of the way."""
_AT_ONCE = 1 << 14


class AxisCorrection:
    """Where an axis has to be sent, along the straight lines of a table.

    Parameters
    ----------
    table
        Errors at nodes.
    zero_mm
        Where the program's zero lies on the axis, in the positions of the table.

    Examples
    --------
    >>> ends = np.array([0.0, 100.0])
    >>> table = Compensation(position_mm=ends, forward_mm=np.array([0.0, 0.01]), reverse_mm=np.array([0.02, 0.03]),
    ...                      interpolation_mm=0.0, left_out=())
    >>> axis = AxisCorrection(table, zero_mm=50.0)
    >>> [round(axis.commanded(0.0, way), 5) for way in (1, -1)], axis.nodes_between(-60.0, 10.0)
    ([-0.005, -0.025], [-50.0])
    """

    def __init__(self, table: Compensation, zero_mm: float = 0.0) -> None:
        self._nodes: list[float] = (table.position_mm - zero_mm).tolist()
        self._errors = {FORWARD: table.forward_mm.tolist(), REVERSE: table.reverse_mm.tolist()}
        self.range_mm = self._nodes[0], self._nodes[-1]

    def error_mm(self, x_mm: float, way: int) -> float:
        """Return the error of a place, held beyond the ends."""
        nodes, errors = self._nodes, self._errors[way]
        k = bisect_right(nodes, x_mm)
        if k == 0:
            return float(errors[0])
        if k == len(nodes):
            return float(errors[-1])
        share = (x_mm - nodes[k - 1]) / (nodes[k] - nodes[k - 1])
        return float(errors[k - 1] + share * (errors[k] - errors[k - 1]))

    def commanded(self, x_mm: float, way: int) -> float:
        """Return what has to be commanded so that the axis comes to ``x_mm`` in a direction."""
        sent = x_mm
        for _ in range(_TIMES):
            sent = x_mm - self.error_mm(sent, way)
        return sent

    def nodes_between(self, begin_mm: float, end_mm: float) -> list[float]:
        """Return the nodes strictly between two places, in the order in which they are passed."""
        if begin_mm <= end_mm:
            return self._nodes[bisect_right(self._nodes, begin_mm) : bisect_left(self._nodes, end_mm)]
        return self._nodes[bisect_right(self._nodes, end_mm) : bisect_left(self._nodes, begin_mm)][::-1]


@dataclass(slots=True)
class Spread:
    """Largest and root mean square of errors as they come."""

    largest_mm: float = 0.0
    count: int = 0
    square: float = 0.0

    def add(self, errors_mm: Floats) -> None:
        """Take errors in, shape (n,)."""
        if errors_mm.size:
            self.largest_mm = max(self.largest_mm, float(np.abs(errors_mm).max()))
            self.count += errors_mm.size
            self.square += float(np.square(errors_mm).sum())

    @property
    def rms_mm(self) -> float:
        """Root mean square, 0 of nothing."""
        return math.sqrt(self.square / self.count) if self.count else 0.0


@dataclass(slots=True)
class ErrorLeft:
    """The error that a machine with the predictor's errors makes of what is commanded.

    Parameters
    ----------
    predictor
        The errors of the machine; not the lines that the correction goes along.
    zero_mm
        As of `AxisCorrection`.
    """

    predictor: Predictor
    zero_mm: float = 0.0
    points: Spread = field(default_factory=Spread)
    """At the ends of the program's moves."""
    between: Spread = field(default_factory=Spread)
    """Along its feed moves."""
    before: Spread = field(default_factory=Spread)
    """At both, without a correction."""
    _waiting: list[tuple[float, float, int, bool]] = field(default_factory=list)
    _on_arcs: list[tuple[float, float, int, float, float, float]] = field(default_factory=list)

    def see(self, sent_mm: float, wanted_mm: float, way: int, *, along: bool) -> None:
        """Take in one place: what was commanded, and where the axis should be."""
        self._waiting.append((sent_mm, wanted_mm, way, along))
        if len(self._waiting) >= _AT_ONCE:
            self.settle()

    def see_on_arc(
        self, sent_mm: float, other_mm: float, way: int, arc: tuple[float, float, float], wanted_mm: float
    ) -> None:
        """Take in one place of an arc: both axes from its centre, the axis first; its radius; where the axis is."""
        self._on_arcs.append((sent_mm, other_mm - arc[1], way, arc[0], arc[2], wanted_mm))
        if len(self._on_arcs) >= _AT_ONCE:
            self.settle()

    def settle(self) -> None:
        """Judge what is waiting."""
        if self._waiting:
            sent, wanted, ways, along = np.array(self._waiting).T
            left = sent + self._errors(sent, ways) - wanted
            self.points.add(left[along == 0.0])
            self.between.add(left[along == 1.0])
            self.before.add(self._errors(wanted, ways))
        if self._on_arcs:
            sent, other, ways, centre, radius, wanted = np.array(self._on_arcs).T
            self.between.add(np.hypot(sent + self._errors(sent, ways) - centre, other) - radius)
            self.before.add(self._errors(wanted, ways))
        self._waiting.clear()
        self._on_arcs.clear()

    def _errors(self, places_mm: Floats, ways: Floats) -> Floats:
        return self.predictor.error_mm(places_mm + self.zero_mm, ways)
