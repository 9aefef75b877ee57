"""Passes of a moving axis, and the places that it passes again: the repeats of a log.

A pass is a stretch of motion in one direction, or a run. Where the same place was passed again in the same direction,
at a similar speed and acceleration, the difference is what no function of the conditions explains. Readings of one
pass that share a place are correlated with each other: statistics are made between passes.
"""

from __future__ import annotations

import numpy as np

from rtec.dataset.drive_signals import Resample
from rtec.dataset.repeats import cells_of, pair_numbers
from rtec.dataset.rows import Rows
from rtec.dataset.standstill import Ints
from rtec.effects.conditions import SAME, Floats

_WIDTH_OF_CLASS = 1.25  # ratio of speeds in a class: friction and lag change less within it than between
_OFFSETS = 8  # positions of the edges of the classes that are tried, so that none cuts through a usual speed
_ACCELERATES = 0.25  # share of a large acceleration (19 of 20 are below) from which the axis counts as accelerating
_COARSEST, _FINEST = 8, 1 << 14  # bins over the span
_FEWEST_IN_BIN = 3.0  # rows of a pass in a bin, in the median
_FLAT = 0.1  # variance by position within a bin, as a share of that between passes, which is small enough
_DISPLACED = 0.5  # share of that between passes that comes from rows elsewhere in the bin: more is no floor
_FEWEST_REPEATED = 1 / 3  # share of the rows in motion: below, the few places passed again do not speak for the log


def passages(run: Ints, direction: Floats | None, position: Floats | None = None) -> Ints:
    """Return the number of the pass that each row belongs to, 0, 1, ...; columns of shape (rows,).

    Another run or direction of the last motion begins another pass, and where a position is given, because a column
    states the direction of approach, a step against it: a return.

    Examples
    --------
    >>> passages(np.array([1, 1, 1, 2]), np.array([1.0, 1.0, -1.0, -1.0])).tolist()
    [0, 0, 1, 2]
    """
    new = run[1:] != run[:-1]
    if direction is not None:
        new = new | (direction[1:] != direction[:-1])
        if position is not None:
            new |= np.diff(position) * direction[1:] < -SAME * np.ptp(position)
    return np.asarray(np.append(0, np.cumsum(new)), dtype=np.int64)


def passed_again(rows: Rows, resample: Resample | None, observed: Floats) -> tuple[Ints, Ints]:
    """Return the pass and the cell of each row of a log: −1 where its place was passed once only, or at rest.

    ``observed`` is of the rows that ``resample`` leaves.
    """
    kept = np.arange(len(rows)) if resample is None else resample.kept
    way = None if rows.coordinate == "time" else rows.held_direction
    passage = passages(rows.run[kept], None if way is None else way[kept])
    cell = np.full(kept.size, -1, dtype=np.int64)
    if way is None or rows.direction is None or rows.velocity is None:
        return passage, cell
    moving = (way != 0.0) & (rows.direction == way) & (rows.velocity != 0.0)
    if rows.rest is not None:
        moving &= rows.rest < 0
    moves = moving[kept]
    at = kept[moves]
    if at.size and np.ptp(rows.position[at]) > 0.0 and np.ptp(passage[moves]) > 0:
        kind = _kinds(way[at], rows.velocity[at], None if rows.acceleration is None else rows.acceleration[at])
        cell[moves] = _cells(rows.position[at], kind, passage[moves], observed[moves])
    return passage, cell


def _cells(position: Floats, kind: Ints, passage: Ints, observed: Floats) -> Ints:
    """Return the cell of each row, −1 where its place was passed once only, or where there is no floor.

    The bins of position are as wide as they can be while what changes within them, in the same way in every pass,
    stays below a tenth of what differs between passes.
    """
    place = np.minimum((position - position.min()) / np.ptp(position), 1.0 - 1e-12)
    found, best, bins = None, (True, np.inf), _COARSEST
    while bins <= _FINEST:
        condition = pair_numbers(kind, (place * bins).astype(np.int64))
        slot = pair_numbers(condition, passage)
        if found is not None and np.median(np.bincount(slot)) < _FEWEST_IN_BIN:
            break
        cell = cells_of(condition, passage)
        again = cell >= 0
        if again.mean() >= _FEWEST_REPEATED:
            steep, displaced = _steepness(cell[again], slot[again], (place * bins % 1.0)[again], observed[again])
            if found is None or (displaced > _DISPLACED, steep) < best:
                found, best = cell, (displaced > _DISPLACED, steep)
            if steep <= _FLAT and displaced <= _DISPLACED:
                break
        bins *= 2
    return np.full(place.size, -1, dtype=np.int64) if found is None or best[0] else found


def _kinds(direction: Floats, velocity: Floats, acceleration: Floats | None) -> Ints:
    """Return a number for each combination of direction, class of speed, and sign of acceleration."""
    steps = np.log(np.abs(velocity)) / np.log(_WIDTH_OF_CLASS)
    steps -= steps.min()
    sizes = [np.bincount(np.floor(steps + k / _OFFSETS).astype(np.int64)).astype(np.float64) for k in range(_OFFSETS)]
    fullest = int(np.argmax([float((size**2).sum()) for size in sizes]))
    speed = np.floor(steps + fullest / _OFFSETS).astype(np.int64)
    kind = pair_numbers(np.sign(direction).astype(np.int64), speed)
    if acceleration is None:
        return kind
    size = np.abs(acceleration)
    sign = np.where(size > _ACCELERATES * np.quantile(size, 0.95), np.sign(acceleration), 0.0)
    return pair_numbers(kind, sign.astype(np.int64))


def _steepness(cell: Ints, slot: Ints, within: Floats, observed: Floats) -> tuple[float, float]:
    """Return two variances as shares of that between passes: by position in a bin, and by where passes lie in it.

    ``slot`` numbers bin and pass, ``within`` is the place of each row in its bin, 0 to 1.
    """
    _, first, slot = np.unique(slot, return_index=True, return_inverse=True)
    count, of_slot = np.bincount(slot), cell[first]
    between, apart = (_in_groups(np.bincount(slot, x) / count, of_slot)[0] for x in (observed, within))
    half = 2 * slot + (within >= 0.5)
    halves, sums = (np.bincount(half, x, minlength=2 * count.size).reshape(-1, 2) for x in (None, observed))
    both = (halves > 0).all(1)
    change = np.diff(sums[both] / halves[both], axis=1)[:, 0]
    slope = 4.0 * np.maximum(0.0, _in_groups(change, of_slot[both], between.size)[1])
    free = np.bincount(of_slot) - 1.0
    noise, steep, displaced = (float((free * x).sum()) for x in (between, slope / 12.0, slope * apart))
    if noise == 0.0:
        return (np.inf, np.inf) if steep > 0.0 else (0.0, 0.0)
    return steep / noise, displaced / noise


def _in_groups(values: Floats, group: Ints, groups: int = 0) -> tuple[Floats, Floats]:
    """Return the variance in each group, and the mean product of two different values of it; 0 for fewer than two."""
    count = np.bincount(group, minlength=groups).astype(np.float64)
    total, square = (np.bincount(group, x, minlength=groups) for x in (values, values**2))
    pairs = np.where(count > 1.0, count * (count - 1.0), np.inf)
    return np.maximum(0.0, count * square - total**2) / pairs, (total**2 - square) / pairs
