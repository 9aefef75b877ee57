"""A move of several axes as a way from 0 to 1, and where it is split for the correction of one of them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from rtec.predictors import FORWARD, REVERSE
from rtec.study.gcode.arcs import Arc, refitted
from rtec.study.gcode.axis import AxisCorrection

_LEAST_ANGLE = 0.01
"""Of an arc in rad: a smaller one is split no more."""
_JUDGED = (0.25, 0.5, 0.75)


@dataclass(frozen=True, slots=True)
class Piece:
    """A part of a move in which the corrected axis has one direction; 0: it stands."""

    begin: float
    end: float
    way: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Path:
    """A move, in mm or degrees."""

    own: str
    """The corrected axis."""
    begin: Mapping[str, float]
    end: Mapping[str, float]
    arc: Arc | None = None
    plane: tuple[str, str] = ("", "")
    """Axes of the arc."""

    @property
    def bent(self) -> bool:
        """Whether the corrected axis moves in the plane of an arc."""
        return self.arc is not None and self.own in self.plane

    def at(self, letter: str, share: float) -> float:
        """Return where an axis is after a share of the move."""
        if share in (0.0, 1.0):
            return (self.begin if share == 0.0 else self.end)[letter]
        if self.arc is not None and letter in self.plane:
            return self.arc.at(share)[self.plane.index(letter)]
        return self.begin[letter] + share * (self.end[letter] - self.begin[letter])

    def pieces(self, correction: AxisCorrection, within_mm: float) -> Iterator[Piece]:
        """Yield the pieces between which straight lines, or arcs, follow what the correction asks for."""
        turns = [] if self.arc is None or not self.bent else self.arc.turns(self.plane.index(self.own))
        for begin, end in itertools.pairwise([0.0, *turns, 1.0]):
            places = self.at(self.own, begin), self.at(self.own, end)
            way = 0 if places[0] == places[1] else FORWARD if places[1] > places[0] else REVERSE
            nodes = correction.nodes_between(*places)
            shares = [begin, *(self.passes(node, begin, end) for node in nodes), end]
            for low, high in itertools.pairwise(shares):
                yield from self._fitting(Piece(low, high, way), correction, within_mm)

    def passes(self, place: float, begin: float, end: float) -> float:
        """Return the share at which the corrected axis passes a place between two shares."""
        if self.arc is not None and self.bent:
            return self.arc.passes(self.plane.index(self.own), place, begin, end)
        first, last = self.at(self.own, begin), self.at(self.own, end)
        return begin + (place - first) / (last - first) * (end - begin)

    def _fitting(self, piece: Piece, correction: AxisCorrection, within_mm: float) -> Iterator[Piece]:
        """Yield a piece, halved until an arc of its own is as near to what is asked for as it must be."""
        if self.arc is None or not self.bent or abs(self.arc.sweep) * (piece.end - piece.begin) < _LEAST_ANGLE:
            yield piece
            return
        ends = [self.asked(share, piece.way, correction) for share in (piece.begin, piece.end)]
        centre = self.centre(piece, correction, ends[0], ends[1])
        radius = math.dist(ends[0], centre)
        inside = (piece.begin + share * (piece.end - piece.begin) for share in _JUDGED)
        off = max(abs(math.dist(self.asked(share, piece.way, correction), centre) - radius) for share in inside)
        if off <= within_mm:
            yield piece
            return
        middle = 0.5 * (piece.begin + piece.end)
        yield from self._fitting(Piece(piece.begin, middle, piece.way), correction, within_mm)
        yield from self._fitting(Piece(middle, piece.end, piece.way), correction, within_mm)

    def asked(self, share: float, way: int, correction: AxisCorrection) -> tuple[float, float]:
        """Return what the plane's axes have to be sent to."""
        point = [self.at(letter, share) for letter in self.plane]
        if self.bent:
            k = self.plane.index(self.own)
            point[k] = correction.commanded(point[k], way or FORWARD)
        return point[0], point[1]

    def centre(
        self, piece: Piece, correction: AxisCorrection, start: tuple[float, float], end: tuple[float, float]
    ) -> tuple[float, float]:
        """Return the centre of a piece of an arc between two points that are sent."""
        assert self.arc is not None  # noqa: S101 - the caller asks of an arc
        middle = 0.5 * (piece.begin + piece.end)
        asked, true = self.asked(middle, piece.way, correction), [self.at(letter, middle) for letter in self.plane]
        near = tuple(self.arc.centre[k] + asked[k] - true[k] for k in range(2))
        return refitted(start, end, (near[0], near[1]))
