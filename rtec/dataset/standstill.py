"""Where an axis stands still in a log.

Thousands of samples at a standstill are one observation of a force, current or torque: the friction there is that of
presliding.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from rtec.effects.conditions import Floats

Ints = NDArray[np.int64]
Stretch = tuple[int, int]

_GAP = 5.0  # median intervals after which a log begins again
_ONE = 1.5  # usual intervals after which a reading between two would be missing
_STEPS, _SIGMAS = 2.0, 6.0  # width of the band at rest: steps of the resolution, standard deviations of the noise
_QUARTER = 0.78  # first quartile of the size of second differences of white noise, in standard deviations
_FEWEST_ROWS = 5  # fewer rows within the band are a hesitation, or a slow sample on the way
_TIMES_USUAL = 4.0  # longer than the position usually stays the same on the way (a coarse or stale encoder)
_GO_AND_SETTLE_S = 0.1  # no axis goes to the next place and settles in less
_DRIFT = 0.35  # of the band, between means of thirds: a crawl shows 0.67, a reversal 0.44, standstill next to nothing
_LEAVES = 6.0  # bands that an axis goes in half the time of a dwell at least; one that turned goes 4 of them
_TAIL = 6.0  # median distances from the middle of a standstill from which its ends belong to the motion
_CREEP = 1e-4  # share of the largest speed of the run that counts as standstill even where it leads somewhere
_FASTER = 4.0  # than usual at standstill is a velocity that contradicts the position


def stretches_of(time_s: Floats | None, run: Ints) -> list[Stretch]:
    """Return first row and end of each stretch without a gap: a new run, or five median intervals, begin another."""
    new = run[1:] != run[:-1]
    if time_s is not None:
        steps = np.diff(time_s)
        passed = steps[~new & (steps > 0)]
        new = new | (steps > _GAP * (float(np.median(passed)) if passed.size else 0.0))
    return list(itertools.pairwise([0, *(np.flatnonzero(new) + 1).tolist(), run.size]))


def unbroken(time_s: Floats, position: Floats, run: Ints) -> Ints:
    """Return runs numbered anew, those as one of which a log goes on from the last reading of one to the next.

    It does where no more time passes between the two than usual, and the axis goes no farther than elsewhere from one
    reading to the next: then the number of the run is the writer's, and the motion is one.

    Examples
    --------
    >>> run = np.array([1, 1, 1, 2, 2, 2, 3, 3, 3])
    >>> unbroken(np.arange(9.0), np.array([0.0, 1, 1, 0, 1, 1, 9, 9, 9]), run).tolist()
    [0, 0, 0, 0, 0, 0, 1, 1, 1]
    """
    new, passed, way = run[1:] != run[:-1], np.diff(time_s), np.abs(np.diff(position))
    if new.all():
        return np.cumsum(np.append(False, new))
    usual, farthest = float(np.median(passed[~new])), float(way[~new].max())
    return np.cumsum(np.append(False, new & ((passed > _ONE * usual) | (way > farthest))))


def stretches_where(rows: NDArray[np.bool_]) -> list[Stretch]:
    """Return first row and end of each stretch of rows for which something is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], rows, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def group_means(values: Floats, starts: Ints) -> Floats:
    """Return the mean of each group of successive values along the last axis, shape (..., groups)."""
    return np.asarray(np.add.reduceat(values, starts, axis=-1) / np.diff(np.append(starts, values.shape[-1])))


def starts_of_groups(rest: Ints) -> Ints:
    """Return the first row of each group: the rows of one standstill, or one row outside of all (number −1)."""
    return np.flatnonzero(np.append(True, (rest[1:] != rest[:-1]) | (rest[1:] < 0)))


def noise_of(values: Floats, run: Ints) -> float:
    """Return the noise of a signal: of its second differences, at the quarter of them that motion disturbs least."""
    same = run[1:] == run[:-1]
    bends = np.abs(np.diff(values, 2))[same[1:] & same[:-1]]
    return float(np.quantile(bends, 0.25, overwrite_input=True)) / _QUARTER if bends.size else 0.0


def band_of(position: Floats, run: Ints) -> float:
    """Return the width of the band that a position at rest does not leave, in the unit of the position.

    Two steps of the resolution (one in twenty of all steps is smaller), or six standard deviations of the noise.
    """
    same = run[1:] == run[:-1]
    steps = np.abs(np.diff(position))[same]
    if not steps.any():
        return 0.0
    finest = float(np.quantile(steps[steps > 0.0], 0.05)) * (1.0 + 1e-6)
    return max(_STEPS * finest, _SIGMAS * noise_of(position, run))


def within_band(position: Floats, run: Ints, band: float) -> list[Stretch]:
    """Return first row and end of successive stretches that each stay within a band; together they are all rows.

    Examples
    --------
    >>> within_band(np.array([0.0, 0.1, 0.0, 5.0, 5.1]), np.ones(5, dtype=np.int64), 0.2)
    [(0, 3), (3, 5)]
    """
    found, same = [0], [False, *(run[1:] == run[:-1]).tolist()]
    low = high = float(position[0])
    for row, x in enumerate(position[1:].tolist(), 1):
        low, high = min(low, x), max(high, x)
        if high - low > band or not same[row]:
            found.append(row)
            low = high = x
    return list(itertools.pairwise([*found, position.size]))


def rest_stretches(time_s: Floats, position: Floats, run: Ints, velocity: Floats | None) -> list[Stretch]:
    """Return first row and end of each stretch of a log in which the axis stands still; columns of shape (rows,).

    At rest the position stays within its band (`band_of`) for five rows at least, and four times longer than it
    usually stays the same while the axis moves, without drifting through the band and without turning in it (of less
    than 0.1 s the motion before and after tells); a velocity column does not contradict it. Neighbouring stretches at
    the same place are one.
    """
    band = band_of(position, run)
    if band == 0.0:
        return [(begin, end) for begin, end in stretches_of(None, run) if end - begin >= _FEWEST_ROWS]
    same, steps, ticks = run[1:] == run[:-1], np.abs(np.diff(position)), np.diff(time_s)
    changes, usual, staircase = np.flatnonzero(steps > 0.0), 1.0, False
    if changes.size > 1:
        usual, held_s = (float(np.median(np.diff(x))) for x in (changes, time_s[changes]))
        staircase = held_s > _GO_AND_SETTLE_S and float(np.median(steps[changes])) > band
    fewest = _FEWEST_ROWS if staircase else max(_FEWEST_ROWS, _TIMES_USUAL * usual)
    passed = ticks[same & (ticks > 0.0)]
    usually_s = float(np.median(passed)) if passed.size else np.inf
    fastest = float(np.quantile(steps[same & (steps > 0.0)], 0.95)) / usually_s
    found: list[Stretch] = []
    for begin, end in within_band(position, run, band):
        if end - begin < fewest:
            continue
        away = np.abs(position[begin:end] - np.median(position[begin:end]))
        near = np.flatnonzero(away <= _TAIL * np.median(away))  # a slow start or stop is within the band, too
        first, last = begin + int(near[0]), begin + int(near[-1])
        lasts_s = time_s[last] - time_s[first]
        if last + 1 - first < fewest or lasts_s < (fewest - 1) / 2.0 * usually_s:  # the latter is a burst
            continue
        thirds = [float(part.mean()) for part in np.array_split(position[first : last + 1], 3)]
        short = lasts_s < _GO_AND_SETTLE_S
        if short and not _is_dwell(position, run, first, last, band):
            continue
        if max(thirds) - min(thirds) <= _DRIFT * band or (band < _CREEP * fastest * lasts_s and not short):
            found.append((first, last + 1))
    if velocity is not None and found:
        changed = np.abs(np.diff(velocity))
        usually = float(np.median(np.concatenate([np.abs(velocity[a:b]) for a, b in found])))
        usually += float(np.quantile(changed[changed > 0.0], 0.05)) if changed.any() else 0.0
        found = [(a, b) for a, b in found if abs(float(np.median(velocity[a:b]))) <= _FASTER * usually]
    return _joined(found, position, run, band)


def _is_dwell(position: Floats, run: Ints, first: int, last: int, band: float) -> bool:
    """Return whether an axis stood still in rows that are so few that it may as well have turned there.

    Under a constant acceleration it would be as slow before and after as within: it would not come from afar in half
    of that time, nor go there.
    """
    half, here = (last - first) // 2 + 1, float(np.median(position[first : last + 1]))
    for begin, end in ((max(first - half, 0), first), (last + 1, min(last + 1 + half, position.size))):
        same = run[begin:end] == run[first]
        if np.abs(position[begin:end][same] - here).max(initial=0.0) <= _LEAVES * band:
            return False
    return True


def _joined(found: list[Stretch], position: Floats, run: Ints, band: float) -> list[Stretch]:
    joined: list[Stretch] = []
    for begin, end in found:
        first, last = joined[-1] if joined else (begin, begin)
        here = float(position[begin:end].mean())
        stays = np.abs(position[last:begin] - here).max(initial=0.0) <= band and run[first] == run[begin]
        if joined and stays and abs(here - float(position[first:last].mean())) <= band / 2.0:
            joined[-1] = (first, end)
        else:
            joined.append((begin, end))
    return joined


def rest_numbers(stretches: list[Stretch], rows: int) -> Ints:
    """Return for each row the number of the stretch that it belongs to, −1 outside of all."""
    number = np.full(rows, -1, dtype=np.int64)
    for k, (begin, end) in enumerate(stretches):
        number[begin:end] = k
    return number
