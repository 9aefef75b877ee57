"""Repeats of the same conditions: runs, the cells that they share, blocks to hold out, and one clock for all runs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec.effects.conditions import SAME, Floats
from rtec.errors import FileFormatError
from rtec.metrology import Measurement

Ints = NDArray[np.int64]

_BLOCKS = 5
"""Blocks where there are no runs, or so many that each would hold out next to nothing."""
_MOST_RUN_BLOCKS = 10
_FEWEST_ROWS_IN_STRETCHES = 10
"""With fewer rows each is a block of its own."""
_WHOLE_RETURN = 0.9
"""Share of the span of a motion that takes the axis back to where the next pass begins."""
_WHOLE_PASS = 0.8
"""Share of all conditions that a pass has to visit to count as a run."""


def place_numbers(position: Floats) -> Ints:
    """Return the number of the place of each reading, ascending: positions nearer than 1e-6 of the span are one.

    Examples
    --------
    >>> place_numbers(np.array([5.0, 0.0, 5.0000001, 10.0])).tolist()
    [1, 0, 1, 2]
    """
    ordered, inverse = np.unique(position, return_inverse=True)
    apart = np.diff(ordered) > SAME * (ordered[-1] - ordered[0])
    number: Ints = np.concatenate(([0], np.cumsum(apart)))[inverse]
    return number


def condition_numbers(position: Floats, direction: Floats | None, speed: Floats | None) -> Ints:
    """Return a number for each reading that is the same where place, direction of approach and feed are the same.

    Examples
    --------
    >>> x, way = np.array([0.0, 5.0, 5.0, 0.0]), np.array([1.0, 1.0, -1.0, 1.0])
    >>> condition_numbers(x, way, None).tolist()
    [0, 1, 2, 0]
    """
    key = place_numbers(position)
    if direction is not None:
        key = key * 3 + np.sign(direction).astype(np.int64) + 1
    if speed is not None:
        key = key * (1 + int(place_numbers(speed).max())) + place_numbers(speed)
    _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    rank = np.empty(first.size, dtype=np.int64)
    rank[np.argsort(first)] = np.arange(first.size)
    return np.asarray(rank[inverse], dtype=np.int64)


def runs_by_recurrence(conditions: Ints) -> Ints | None:
    """Return run numbers 1, 2, ... where whole passes over the same conditions follow each other.

    Parameters
    ----------
    conditions
        Numbers of `condition_numbers`, shape (rows,), in the order of the readings.

    Returns
    -------
    ndarray or None
        Shape (rows,). A pass ends where a condition comes again. None where that does not split the file into passes
        that each (but the last, which may be cut short) visit four of five of all conditions: a place read twice is
        no run.

    Examples
    --------
    >>> runs_by_recurrence(np.array([0, 1, 2, 0, 1, 2])).tolist()
    [1, 1, 1, 2, 2, 2]
    >>> runs_by_recurrence(np.array([0, 1, 1, 2, 3])) is None
    True
    """
    distinct = int(conditions.max()) + 1
    if distinct < 2 or distinct == conditions.size:
        return None
    starts, seen = [0], set[int]()
    for row, number in enumerate(conditions.tolist()):
        if number in seen:
            starts.append(row)
            seen.clear()
        seen.add(number)
    if len(starts) < 2 or min(np.diff(starts)) < _WHOLE_PASS * distinct:
        return None
    runs = np.zeros(conditions.size, dtype=np.int64)
    runs[starts] = 1
    return np.cumsum(runs)


def one_way_passes(position: Floats) -> Ints | None:
    """Return run numbers 1, 2, ... where each pass goes the same way, and the axis returns in one go between them.

    Parameters
    ----------
    position
        Shape (rows,), in the order of the readings.

    Returns
    -------
    ndarray or None
        Shape (rows,). A return leads over nine tenths of the span at least, against the way of all other steps. None
        where there is no such return, or a pass (but the last, which needs two readings) does not visit four of five
        places.

    Examples
    --------
    >>> one_way_passes(np.array([0.0, 1.0, 2.0, 0.0, 1.0, 2.0])).tolist()
    [1, 1, 1, 2, 2, 2]
    >>> one_way_passes(np.array([0.0, 1.0, 2.0, 2.0, 1.0, 0.0])) is None
    True
    """
    steps, span = np.diff(position), float(np.ptp(position))
    back = np.abs(steps) >= _WHOLE_RETURN * span
    ways, returns = np.sign(steps[~back]), np.sign(steps[back])
    way = float(ways.sum())
    if span == 0.0 or returns.size == 0 or way == 0.0 or (ways * way < 0.0).any() or (returns * way > 0.0).any():
        return None
    run = np.concatenate(([1], 1 + np.cumsum(back)))
    sizes, places = np.bincount(run)[1:], int(place_numbers(position).max()) + 1
    if sizes[:-1].min() < _WHOLE_PASS * places or sizes[-1] < 2:
        return None
    return np.asarray(run, dtype=np.int64)


def cells_of(conditions: Ints, run: Ints) -> Ints:
    """Return the cell of each reading: its condition, renumbered, where more than one run visited it; else −1.

    Examples
    --------
    >>> cells_of(np.array([0, 1, 2, 0, 2, 2]), np.array([1, 1, 1, 2, 2, 2])).tolist()
    [0, -1, 1, 0, 1, 1]
    """
    _, place = np.unique(run, return_inverse=True)
    runs = int(place.max()) + 1
    visits = np.unique(conditions * runs + place) // runs
    repeated = np.bincount(visits, minlength=int(conditions.max()) + 1) > 1
    number = np.where(repeated, np.cumsum(repeated) - 1, -1)
    return np.asarray(number[conditions], dtype=np.int64)


def blocks_of(run: Ints) -> tuple[Ints, str]:
    """Return the block with which each reading is held out, and what a block is.

    Parameters
    ----------
    run
        Shape (rows,).

    Returns
    -------
    tuple
        Numbers 0, 1, ... of shape (rows,), with ``"run"`` or ``"stretch"``. Two runs or more: a block for each, or
        five groups of successive runs where there are more than ten. Else five stretches of successive rows, or,
        below ten rows, a block for each row.

    Examples
    --------
    >>> blocks_of(np.array([4, 4, 7, 7]))[0].tolist(), blocks_of(np.array([4, 4, 7, 7]))[1]
    ([0, 0, 1, 1], 'run')
    >>> blocks_of(np.ones(12, dtype=np.int64))[0].tolist()
    [0, 0, 0, 1, 1, 2, 2, 2, 3, 3, 4, 4]
    """
    _, first, inverse = np.unique(run, return_index=True, return_inverse=True)
    if first.size > 1:
        rank = np.empty(first.size, dtype=np.int64)
        rank[np.argsort(first)] = np.arange(first.size)
        block = rank[inverse]
        return (block * _BLOCKS // first.size if first.size > _MOST_RUN_BLOCKS else block), "run"
    rows = np.arange(run.size)
    return (rows if run.size < _FEWEST_ROWS_IN_STRETCHES else rows * _BLOCKS // run.size), "stretch"


def one_clock(measurement: Measurement, time_s: Floats, run: Ints) -> tuple[Floats, str | None]:
    """Return seconds since the first reading, and what was done to the file's times.

    Parameters
    ----------
    measurement
        For the message.
    time_s, run
        Shape (rows,), in the order of the readings.

    Returns
    -------
    tuple
        Times that do not decrease, shape (rows,). Where the clock starts again with a run, each run starts one median
        interval after the end of the one before; then the second is a sentence that says so.

    Raises
    ------
    FileFormatError
        Time runs backwards within a run.
    """
    steps, same_run = np.diff(time_s), run[1:] == run[:-1]
    back = np.flatnonzero((steps < 0) & same_run)
    if back.size:
        row = int(back[0]) + 1
        problem = f"time runs backwards: {time_s[row]:g} s after {time_s[row - 1]:g} s"
        allowed = "times that do not decrease within a run (a column 'run' where each run has a clock of its own)"
        raise FileFormatError(measurement.source, measurement.line_of(row), problem, allowed)
    if not (steps < 0).any():
        return time_s - time_s[0], None
    interval = float(np.median(steps[same_run])) if same_run.any() else 1.0
    chained = np.concatenate(([0.0], np.cumsum(np.where(same_run, steps, interval))))
    return chained, (
        f"the clock of the file starts again with each run: runs follow each other after {interval:.4g} s, the "
        "median interval, although the true pause between them is not known"
    )
