"""What axes on a bus do: moves of each on its own, or straight lines that all of them follow together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from rtec.checks import number_within
from rtec.errors import ArgumentError
from rtec.units import PS_PER_S


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """A way to a position, and a rest there.

    Parameters
    ----------
    target_mm
        Position from home.
    speed_mm_s
        Feed.
    rest_s
        How long it rests there.

    Raises
    ------
    ArgumentError
        A value outside its range.
    """

    target_mm: float
    speed_mm_s: float
    rest_s: float = 0.0

    def __post_init__(self) -> None:
        number_within("target_mm", self.target_mm, -1e6, 1e6, unit="mm")
        number_within("speed_mm_s", self.speed_mm_s, 1e-6, 1e4, unit="mm/s")
        number_within("rest_s", self.rest_s, 0.0, 1e6, unit="s")


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A straight line on which all axes of a cell go to a place together, and a rest there (G01 with several words).

    All axes are at the same share of it at every time: where one is held, all come to rest on the line.

    Raises
    ------
    ArgumentError
        A value outside its range.

    Examples
    --------
    >>> Line(targets_mm=(30.0, 40.0), speed_mm_s=10.0).targets_mm
    (30.0, 40.0)
    """

    targets_mm: tuple[float, ...]
    """Position from home of each axis."""
    speed_mm_s: float
    """Feed along the line."""
    rest_s: float = 0.0
    """How long they rest at its end."""

    def __post_init__(self) -> None:
        targets = tuple(number_within("targets_mm", target, -1e6, 1e6, unit="mm") for target in self.targets_mm)
        object.__setattr__(self, "targets_mm", targets)
        number_within("speed_mm_s", self.speed_mm_s, 1e-6, 1e4, unit="mm/s")
        number_within("rest_s", self.rest_s, 0.0, 1e6, unit="s")


Moves = Sequence[Sequence[Move]] | Sequence[Line]
"""What each axis does, or what all do together."""


def lines_of(moves: Moves) -> list[Line]:
    """Return the lines that all axes follow together; none where each has moves of its own.

    Raises
    ------
    ArgumentError
        Lines and other things.
    """
    lines = [move for move in moves if isinstance(move, Line)]
    if lines and len(lines) < len(moves):
        raise ArgumentError("moves", "lines and other moves", "lines alone, or moves of each axis")
    return lines


def move_arrays(moves: Moves, counts_mm: Sequence[float]) -> tuple[Any, ...]:
    """Return targets in counts, speeds, rests in ps and lengths of lines in mm, each of shape (axes, moves).

    Speeds of moves are in counts/s, those along lines in mm/s. ``counts_mm`` is the count of each axis. After a
    program shorter than the longest an axis stays.

    Raises
    ------
    ArgumentError
        A line with another number of axes.
    """
    lines = lines_of(moves)
    if lines:
        return _line_arrays(lines, counts_mm)
    programs = [program for program in moves if not isinstance(program, Line)]
    longest = max(len(program) for program in programs)
    rows = []
    for program, count_mm in zip(programs, counts_mm, strict=True):
        stay = [Move(target_mm=last.target_mm, speed_mm_s=last.speed_mm_s) for last in program[-1:]]
        padded = [*program, *stay * (longest - len(program))]
        rows.append([(m.target_mm / count_mm, m.speed_mm_s / count_mm, round(m.rest_s * PS_PER_S)) for m in padded])
    shape = len(rows), longest
    targets, speeds, rests = (np.array([[move[k] for move in row] for row in rows]).reshape(shape) for k in range(3))
    return targets.astype(np.float64), speeds.astype(np.float64), rests.astype(np.int64), np.zeros(shape)


def _line_arrays(lines: Sequence[Line], counts_mm: Sequence[float]) -> tuple[Any, ...]:
    axes = len(counts_mm)
    for line in lines:
        if len(line.targets_mm) != axes:
            raise ArgumentError("targets_mm", f"{len(line.targets_mm)} axes", f"{axes}, as the cell has")
    places = [(0.0,) * axes, *(line.targets_mm for line in lines)]
    lengths = [math.dist(before, after) for before, after in pairwise(places)]
    targets = np.array([line.targets_mm for line in lines]).T / np.array(counts_mm)[:, np.newaxis]

    def of_all(values: Sequence[float], dtype: type) -> Any:
        return np.tile(np.array(values, dtype=dtype), (axes, 1))

    rests = [round(line.rest_s * PS_PER_S) for line in lines]
    speeds = of_all([line.speed_mm_s for line in lines], np.float64)
    return np.ascontiguousarray(targets), speeds, of_all(rests, np.int64), of_all(lengths, np.float64)
