"""What axes are told to do: moves of each on its own, or lines that all of them follow together."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from rtec.checks import number_within
from rtec.errors import ArgumentError
from rtec.units import PS_PER_S


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """A way to a position, and a rest there: of one axis, or of all axes of a cell together on a straight line.

    On a line (G01 with several words) all axes are at the same share of it at every time: where one is held, all come
    to rest on it.

    Parameters
    ----------
    target_mm
        Position from home; of each axis, where they go together.
    speed_mm_s
        Feed, along the line.
    rest_s
        How long it rests there.

    Raises
    ------
    ArgumentError
        A value outside its range.

    Examples
    --------
    >>> Move(target_mm=(30.0, 40.0), speed_mm_s=10.0).target_mm
    (30.0, 40.0)
    """

    target_mm: float | tuple[float, ...]
    speed_mm_s: float
    rest_s: float = 0.0

    def __post_init__(self) -> None:
        if isinstance(self.target_mm, Iterable):
            object.__setattr__(self, "target_mm", tuple(self.target_mm))
        for target in self.targets_mm:
            number_within("target_mm", target, -1e6, 1e6, unit="mm")
        number_within("speed_mm_s", self.speed_mm_s, 1e-6, 1e4, unit="mm/s")
        number_within("rest_s", self.rest_s, 0.0, 1e6, unit="s")

    @property
    def targets_mm(self) -> tuple[float, ...]:
        """Return the position of each axis that moves."""
        return self.target_mm if isinstance(self.target_mm, tuple) else (self.target_mm,)


Moves = Sequence[Sequence[Move]] | Sequence[Move]
"""What each axis does, or what all do together."""


def lines_of(moves: Moves) -> list[Move]:
    """Return the lines that all axes follow together; none where each has moves of its own.

    Raises
    ------
    ArgumentError
        Lines and other things.
    """
    lines = [move for move in moves if isinstance(move, Move)]
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
    programs = [program for program in moves if not isinstance(program, Move)]
    longest = max(len(program) for program in programs)
    rows = []
    for program, count_mm in zip(programs, counts_mm, strict=True):
        _check_axes(program, 1)
        stay = [replace(last, rest_s=0.0) for last in program[-1:]]
        padded = [*program, *stay * (longest - len(program))]
        rows.append([_in_counts(move, count_mm) for move in padded])
    shape = len(rows), longest
    targets, speeds, rests = (np.array([[move[k] for move in row] for row in rows]).reshape(shape) for k in range(3))
    return targets.astype(np.float64), speeds.astype(np.float64), rests.astype(np.int64), np.zeros(shape)


def _line_arrays(lines: Sequence[Move], counts_mm: Sequence[float]) -> tuple[Any, ...]:
    axes = len(counts_mm)
    _check_axes(lines, axes)
    places = [(0.0,) * axes, *(line.targets_mm for line in lines)]
    lengths = [math.dist(before, after) for before, after in pairwise(places)]
    targets = np.array([line.targets_mm for line in lines]).T / np.array(counts_mm)[:, np.newaxis]

    def of_all(values: Sequence[float], dtype: type) -> Any:
        return np.tile(np.array(values, dtype=dtype), (axes, 1))

    rests = [round(line.rest_s * PS_PER_S) for line in lines]
    speeds = of_all([line.speed_mm_s for line in lines], np.float64)
    return np.ascontiguousarray(targets), speeds, of_all(rests, np.int64), of_all(lengths, np.float64)


def _check_axes(moves: Sequence[Move], axes: int) -> None:
    for move in moves:
        if len(move.targets_mm) != axes:
            raise ArgumentError("target_mm", f"{len(move.targets_mm)} axes", f"{axes}")


def _in_counts(move: Move, count_mm: float) -> tuple[float, float, int]:
    return move.targets_mm[0] / count_mm, move.speed_mm_s / count_mm, round(move.rest_s * PS_PER_S)
