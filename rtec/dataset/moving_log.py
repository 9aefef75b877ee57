"""Logs of a moving axis: told from readings at rest, freed of wraps and of the motion before the test began."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.drive_signals import local_derivatives
from rtec.effects.conditions import Floats

Ints = NDArray[np.int64]

_FEWEST_ROWS = 20
_FASTEST_TEST_S = 0.05
"""No axis goes to a target, settles and is read twenty times a second."""
_SLOWEST_LOG_S = 1.0
_SMALL_STEP = 0.01
"""Share of the span: a test that reads faster than once a second has no hundred targets on the way."""
_MOVES = 1e-3
"""Share of the span that an axis goes within a stretch of a log; at rest it is only read again."""
_GAP = 5.0
"""Median intervals after which a log begins again."""
_STEADY = 0.05
"""Departure from a straight line, as a share of the way, of a run at constant speed."""
_TURNED = 1e-5
"""Share of the span that an axis has to go back to have turned."""
_FASTER = 5.0
"""How many times faster than ever later the axis is in a transient."""


def is_moving(time_s: Floats | None, position: Floats, run: Ints, has_velocity: bool) -> bool:
    """Return whether a file is a log of a moving axis, and not readings at rest.

    Parameters
    ----------
    time_s
        Shape (rows,); None where there is no time.
    position, run
        Shape (rows,).
    has_velocity
        Whether there is a column ``velocity``.

    Notes
    -----
    The rule:

    - a ``velocity`` column says that the axis moves, unless a second or more lies between the rows (a ``feed`` column
      does not: it tells how a target was approached);
    - else a log has a time and at least twenty rows; between its gaps (`stretches_of`) the axis mostly moves by more
      than a thousandth of the span (not so in a burst of readings at each target); and it has a median interval
    - below 50 ms: no axis goes to a target, settles and is read twenty times a second;
    - or below 1 s, where half of the steps that are steps at all stay below 1 % of the span.

    Everything else is readings at rest: also a test with a time column in which minutes pass between targets.

    Examples
    --------
    >>> t, run = np.arange(100) * 0.01, np.ones(100, dtype=np.int64)
    >>> is_moving(t, np.sin(t), run, False), is_moving(t * 1000, np.sin(t), run, False)
    (True, False)
    """
    same_run = run[1:] == run[:-1]
    if has_velocity:
        return time_s is None or not same_run.any() or bool(np.median(np.diff(time_s)[same_run]) < _SLOWEST_LOG_S)
    if time_s is None or time_s.size < _FEWEST_ROWS or not same_run.any() or np.ptp(position) == 0.0:
        return False
    intervals, steps = np.diff(time_s)[same_run], np.abs(np.diff(position)[same_run])
    passed = intervals[intervals > 0]  # a clock coarser than the readings gives several of them one time
    median = float(np.median(passed)) if passed.size else np.inf
    if not median < _SLOWEST_LOG_S:
        return False
    begin, end = np.array(stretches_of(time_s, run)).T
    reach = np.maximum.reduceat(position, begin) - np.minimum.reduceat(position, begin)
    if 2 * (end - begin)[reach > _MOVES * np.ptp(position)].sum() <= time_s.size:
        return False
    return bool(median < _FASTEST_TEST_S or np.median(steps[steps > 0]) < _SMALL_STEP * np.ptp(position))


def last_direction(position: Floats, run: Ints) -> Floats:
    """Return the direction of the last motion at each row of a log, also while the axis is at rest.

    Parameters
    ----------
    position, run
        Shape (rows,).

    Returns
    -------
    ndarray
        Shape (rows,): +1 or −1, and 0 in a run without motion. The axis has turned where it goes back by more than
        1e-5 of the span of all positions: less is rounding, or the ringing of a filter. Before the first motion, the
        direction of that.

    Examples
    --------
    >>> last_direction(np.array([0.0, 0.0, 1.0, 2.0, 2.0, 1.0]), np.ones(6, dtype=np.int64)).tolist()
    [1.0, 1.0, 1.0, 1.0, 1.0, -1.0]
    """
    direction = np.zeros(position.size)
    least = _TURNED * float(np.ptp(position))
    bounds = [0, *(np.flatnonzero(run[1:] != run[:-1]) + 1).tolist(), position.size]
    for begin, end in itertools.pairwise(bounds):
        way, since, peak, row = 0, begin, float(position[begin]), begin
        for at, x in enumerate(position[begin:end].tolist(), begin):
            if way >= 0 and x < peak - least:
                direction[since : row + 1] = way or -1
                way, since, peak, row = -1, row + 1, x, at
            elif way <= 0 and x > peak + least:
                direction[since : row + 1] = way or 1
                way, since, peak, row = 1, row + 1, x, at
            elif (x - peak) * way >= 0.0:
                peak, row = (x if way else peak), at
        direction[since:end] = way
    return direction


def unwrapped(angle: Floats, turn: float) -> Floats:
    """Return the angle of a single-turn encoder in a log without its jumps at the end of a turn.

    Parameters
    ----------
    angle
        Shape (rows,), in the unit of ``turn``; what does not stay within one turn is no single-turn counter and comes
        back as it is.
    turn
        A whole turn.

    Examples
    --------
    >>> unwrapped(np.array([8190.0, 8191.0, 0.0, 1.0]), 8192.0).tolist()
    [8190.0, 8191.0, 8192.0, 8193.0]
    """
    if np.ptp(angle) > turn or angle.size < 2 or np.abs(np.diff(angle)).max() <= turn / 2:
        return angle
    straight: Floats = np.unwrap(angle, period=turn)
    return straight


def stretches_of(time_s: Floats, run: Ints) -> list[tuple[int, int]]:
    """Return first row and end of each stretch without a gap: a new run, or five median intervals, begin another.

    Examples
    --------
    >>> stretches_of(np.array([0.0, 1, 2, 3, 30, 31]), np.ones(6, dtype=np.int64))
    [(0, 4), (4, 6)]
    """
    steps, same_run = np.diff(time_s), run[1:] == run[:-1]
    passed = steps[same_run & (steps > 0)]
    usual = float(np.median(passed)) if passed.size else 0.0
    new = ~same_run | (steps > _GAP * usual)
    return list(itertools.pairwise([0, *(np.flatnonzero(new) + 1).tolist(), time_s.size]))


def even_rate(time_s: Floats, stretches: list[tuple[int, int]]) -> float | None:
    """Return the sampling rate of an evenly sampled log in Hz, or None where it is not.

    Notes
    -----
    Even: no time is farther from the best regular grid than a tenth of the interval, or half of the last digit
    in which the file writes its times. A lost sample makes a log uneven.

    Examples
    --------
    >>> even_rate(np.array([0.0, 0.333, 0.667, 1.0]), [(0, 4)])  # doctest: +ELLIPSIS
    2.99...
    >>> even_rate(np.array([0.0, 0.1, 0.31, 0.4]), [(0, 4)]) is None
    True
    """
    counts, times = [], []
    for begin, end in stretches:
        count = np.arange(end - begin, dtype=np.float64)
        counts.append(count - count.mean())
        times.append(time_s[begin:end] - time_s[begin:end].mean())
    spread = sum(float(count @ count) for count in counts)
    interval = sum(float(count @ time) for count, time in zip(counts, times, strict=True)) / (spread or 1.0)
    if interval <= 0.0:
        return None
    tolerance = max(0.1 * interval, 0.51 * _last_digit(time_s, interval))
    for count, time in zip(counts, times, strict=True):
        if np.ptp(time - interval * count) > 2.0 * tolerance:
            return None
    return float(f"{1.0 / interval:.9g}")


def _last_digit(time_s: Floats, interval: float) -> float:
    """Return the decimal step in which times are written, at most one interval."""
    few = time_s[:: max(1, time_s.size // 1000)]
    for digits in range(7):
        step = 10.0**-digits
        if step <= interval and np.abs(few - np.round(few, digits)).max() <= 1e-3 * step:
            return step
    return 0.0


def transient_rows(time_s: Floats, position: Floats) -> int:
    """Return how many rows at the start of a run at constant speed belong to the motion before it (homing).

    Parameters
    ----------
    time_s, position
        Shape (rows,), of one stretch; unwrapped.

    Returns
    -------
    int
        0 where there is no transient, or where the log is no run at constant speed.

    Notes
    -----
    A log is a run at constant speed where a straight line through the second half of its rows is nowhere farther off
    than 5 % of the way. The range of the velocity there (local parabolas through 21 rows), widened by a tenth on both
    sides, is the usual range. The transient lasts as long as the velocity, in the first quarter of the rows, still
    leaves the usual range, and a tenth of that time more, in which the axis rings. It counts as one only if in it the
    axis is five times faster than ever in the second half: slip from one cogging position to the next is part of the
    run, and so are an acceleration from rest and a motion in the other direction.

    Examples
    --------
    >>> t = np.arange(400) * 0.01
    >>> transient_rows(t, t + 100 * np.exp(-t / 0.02)), transient_rows(t, t + 0.1 * np.sin(9 * t))
    (53, 0)
    """
    half = time_s.size // 2
    if half < _FEWEST_ROWS or time_s[-1] <= time_s[half]:
        return 0
    line = np.polyfit(time_s[half:] - time_s[half], position[half:], 1)
    off = np.abs(position[half:] - np.polyval(line, time_s[half:] - time_s[half]))
    way = abs(line[0]) * (time_s[-1] - time_s[half])
    if way == 0.0 or off.max() > _STEADY * way:
        return 0
    velocity, _ = local_derivatives(time_s, position)
    low, high = velocity[half:].min(), velocity[half:].max()
    margin = 0.1 * (high - low) + 1e-6 * abs(line[0])
    early = velocity[: time_s.size // 4]
    unusual = np.flatnonzero((early < low - margin) | (early > high + margin))
    if unusual.size == 0:
        return 0
    until = time_s[0] + 1.1 * (time_s[unusual[-1]] - time_s[0])
    rows = int(np.searchsorted(time_s, until, side="right"))
    fast = np.abs(velocity[:rows]).max() > _FASTER * np.abs(velocity[half:]).max()
    return rows if fast else 0
