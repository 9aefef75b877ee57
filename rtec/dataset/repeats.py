"""Repeats of the same conditions: runs, and the cells that they share."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from rtec.dataset.standstill import Ints
from rtec.effects.conditions import SAME, Floats

_WHOLE_RETURN = 0.9  # share of the span of a motion that takes the axis back to where the next pass begins
_WHOLE_PASS = 0.8  # share of all conditions that a pass has to visit to count as a run


def place_numbers(position: Floats | Ints, near: float | None = None) -> Ints:
    """Return the number of the place of each reading, ascending; nearer than 1e-6 of the span (``near``) is one."""
    ordered, inverse = np.unique(position, return_inverse=True)
    apart = np.diff(ordered) > (SAME * (ordered[-1] - ordered[0]) if near is None else near)
    return np.asarray(np.append(0, np.cumsum(apart))[inverse], dtype=np.int64)


def pair_numbers(first: Ints, second: Ints) -> Ints:
    """Return a number 0, 1, ... for each pair of numbers, ascending."""
    second = second - second.min()
    pair = (first - first.min()) * (int(second.max()) + 1) + second
    return np.asarray(np.unique(pair, return_inverse=True)[1], dtype=np.int64)


def condition_numbers(
    position: Floats, direction: Floats | None, speed: Floats | Ints | None, others: Iterable[Floats] = ()
) -> Ints:
    """Return a number for each reading that is the same where place, direction of approach and feed are the same.

    ``others`` are positions of other axes, which belong to the place. The numbers are 0, 1, ... in the order in which
    they come first.
    """
    number = place_numbers(position)
    for other in others:
        number = pair_numbers(number, place_numbers(other))
    if direction is not None:
        number = pair_numbers(number, np.sign(direction).astype(np.int64))
    if speed is not None:
        number = pair_numbers(number, place_numbers(speed))
    _, first, inverse = np.unique(number, return_index=True, return_inverse=True)
    return np.asarray(np.argsort(np.argsort(first))[inverse], dtype=np.int64)


def runs_by_recurrence(conditions: Ints) -> Ints | None:
    """Return run numbers 1, 2, ... where whole passes over the same numbers of conditions follow each other.

    A pass ends where a condition comes again. None where that does not split the file into passes that each (but the
    last, which may be cut short) visit four of five of all conditions: a place read twice is no run.
    """
    distinct = int(conditions.max()) + 1
    starts, seen = [0], set[int]()
    for row, number in enumerate(conditions.tolist()):
        if number in seen:
            starts.append(row)
            seen.clear()
        seen.add(number)
    if distinct < 2 or len(starts) < 2 or min(np.diff(starts)) < _WHOLE_PASS * distinct:
        return None
    return np.searchsorted(starts, np.arange(conditions.size), side="right").astype(np.int64)


def one_way_passes(position: Floats) -> Ints | None:
    """Return run numbers 1, 2, ... where each pass goes the same way, and the axis returns in one go between them.

    A return leads over nine tenths of the span at least, against the way of all other steps. None where there is no
    such return, or a pass (but the last, which needs two readings) does not visit four of five places.
    """
    steps, span = np.diff(position), float(np.ptp(position))
    back = np.abs(steps) >= _WHOLE_RETURN * span
    ways, returns = np.sign(steps[~back]), np.sign(steps[back])
    way = float(ways.sum())
    if span == 0.0 or returns.size == 0 or way == 0.0 or (ways * way < 0.0).any() or (returns * way > 0.0).any():
        return None
    run = np.append(1, 1 + np.cumsum(back))
    sizes, places = np.bincount(run)[1:], int(place_numbers(position).max()) + 1
    return None if sizes[:-1].min() < _WHOLE_PASS * places or sizes[-1] < 2 else np.asarray(run, dtype=np.int64)


def cells_of(conditions: Ints, run: Ints) -> Ints:
    """Return the cell of each reading: its condition, renumbered, where several runs (or passes) visited it; else −1.

    A condition −1 is none.
    """
    _, once = np.unique(pair_numbers(conditions, run), return_index=True)
    repeated = np.bincount(conditions[once] + 1) > 1
    repeated[0] = False
    return np.asarray(np.where(repeated, np.cumsum(repeated) - 1, -1)[conditions + 1], dtype=np.int64)


def members_of(cells: Ints) -> list[Ints]:
    """Return the rows of each cell, ascending; a cell -1 is none.

    Examples
    --------
    >>> [rows.tolist() for rows in members_of(np.array([1, 0, -1, 1]))]
    [[1], [0, 3]]
    """
    order = np.argsort(cells, kind="stable")
    order = order[cells[order] >= 0]
    starts = np.flatnonzero(np.diff(cells[order])) + 1
    return np.split(order, starts) if order.size else []


def medians_of_cells(values: Floats, cells: Ints, fewest: int) -> Floats:
    """Return the median of the cell of each reading, NaN where that holds fewer readings than ``fewest``, or is none.

    Examples
    --------
    >>> medians_of_cells(np.array([1.0, 2.0, 5.0, 4.0]), np.array([0, 1, -1, 0]), 2)
    array([2.5, nan, nan, 2.5])
    """
    found = np.full(values.size, np.nan)
    of_size: dict[int, list[Ints]] = {}
    for rows in members_of(cells):
        of_size.setdefault(rows.size, []).append(rows)
    for size, alike in of_size.items():
        if size >= fewest:
            every = np.array(alike)
            found[every] = np.median(values[every], axis=1)[:, None]
    return found
