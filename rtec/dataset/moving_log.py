"""Logs of a moving axis: told from readings at rest, freed of wraps and of the motion before the test began."""

from __future__ import annotations

import numpy as np

from rtec.dataset.drive_signals import local_derivatives
from rtec.dataset.standstill import Ints, Stretch, stretches_of
from rtec.effects.conditions import Floats

_FEWEST_ROWS = 20
_FASTEST_TEST_S = 0.05  # no axis goes to a target, settles and is read twenty times a second
_SLOWEST_LOG_S = 1.0
_SMALL_STEP = 0.01  # of the span: a test that reads faster than once a second has no hundred targets on the way
_MOVES = 1e-3  # share of the span that an axis goes within a stretch of a log; at rest it is only read again
_STEADY = 0.05  # departure from a straight line, as a share of the way, of a run at constant speed
_FASTER = 5.0  # than ever later is the axis in a transient


def is_moving(time_s: Floats | None, position: Floats, run: Ints, has_velocity: bool) -> bool:
    """Return whether a file is a log of a moving axis, and not readings at rest; columns of shape (rows,).

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
    same_run, span = run[1:] == run[:-1], float(np.ptp(position))
    if has_velocity:
        return time_s is None or not same_run.any() or bool(np.median(np.diff(time_s)[same_run]) < _SLOWEST_LOG_S)
    if time_s is None or time_s.size < _FEWEST_ROWS or not same_run.any() or span == 0.0:
        return False
    intervals, steps = np.diff(time_s)[same_run], np.abs(np.diff(position)[same_run])
    passed = intervals[intervals > 0]  # a clock coarser than the readings gives several of them one time
    median = float(np.median(passed)) if passed.size else np.inf
    begin, end = np.array(stretches_of(time_s, run)).T
    reach = np.maximum.reduceat(position, begin) - np.minimum.reduceat(position, begin)
    if median >= _SLOWEST_LOG_S or 2 * (end - begin)[reach > _MOVES * span].sum() <= time_s.size:
        return False
    return bool(median < _FASTEST_TEST_S or np.median(steps[steps > 0]) < _SMALL_STEP * span)


def unwrapped(angle: Floats, turn: float) -> Floats:
    """Return the angle of a single-turn encoder in a log without its jumps at the end of a turn.

    What does not stay within one turn is no single-turn counter and comes back as it is.

    Examples
    --------
    >>> unwrapped(np.array([8190.0, 8191.0, 0.0, 1.0]), 8192.0).tolist()
    [8190.0, 8191.0, 8192.0, 8193.0]
    """
    jumps = np.ptp(angle) <= turn and np.abs(np.diff(angle)).max(initial=0.0) > turn / 2
    return np.unwrap(angle, period=turn) if jumps else angle


def even_rate(time_s: Floats, stretches: list[Stretch]) -> float | None:
    """Return the sampling rate of an evenly sampled log in Hz, or None where it is not.

    Even: no time is farther from the best regular grid than a tenth of the interval, or half of the last digit
    in which the file writes its times. A lost sample makes a log uneven.

    Examples
    --------
    >>> even_rate(np.array([0.0, 0.1, 0.2, 0.3]), [(0, 4)]), even_rate(np.array([0.0, 0.1, 0.31, 0.4]), [(0, 4)])
    (10.0, None)
    """
    counts = [np.arange(end - begin) - (end - begin - 1) / 2.0 for begin, end in stretches]
    times = [time_s[begin:end] - time_s[begin:end].mean() for begin, end in stretches]
    spread = sum(float(count @ count) for count in counts)
    interval = sum(float(count @ time) for count, time in zip(counts, times, strict=True)) / (spread or 1.0)
    if interval <= 0.0:
        return None
    few, last_digit = time_s[:: max(1, time_s.size // 1000)], 0.0
    for digits in range(6, -1, -1):
        step = 10.0**-digits
        if step <= interval and np.abs(few - np.round(few, digits)).max() <= 1e-3 * step:
            last_digit = step
    far = max(np.ptp(time - interval * count) for count, time in zip(counts, times, strict=True))
    return float(f"{1.0 / interval:.9g}") if far <= max(0.2 * interval, 1.02 * last_digit) else None


def transient_rows(time_s: Floats, position: Floats) -> int:
    """Return how many rows at the start of a run at constant speed belong to the motion before it (homing).

    Time and unwrapped position are of one stretch, shape (rows,). It is a run at constant speed where a straight line
    through the second half of its rows is nowhere farther off than 5 % of the way. The range of the velocity there
    (local parabolas through 21 rows), widened by a tenth on both sides, is the usual range. The transient lasts as
    long as the velocity, in the first quarter of the rows, still leaves the usual range, and a tenth of that time
    more, in which the axis rings. It counts as one only if in it the axis is five times faster than ever in the
    second half: slip between cogging positions is part of the run, and so is an acceleration from rest.

    Examples
    --------
    >>> t = np.arange(400) * 0.01
    >>> transient_rows(t, t + 100 * np.exp(-t / 0.02)), transient_rows(t, t + 0.1 * np.sin(9 * t))
    (53, 0)
    """
    half = time_s.size // 2
    if half < _FEWEST_ROWS or time_s[-1] <= time_s[half]:
        return 0
    since, later = time_s[half:] - time_s[half], position[half:]
    line = np.polyfit(since, later, 1)
    way = abs(line[0]) * since[-1]
    if way == 0.0 or np.abs(later - np.polyval(line, since)).max() > _STEADY * way:
        return 0
    velocity, _ = local_derivatives(time_s, position)
    low, high = velocity[half:].min(), velocity[half:].max()
    margin, early = 0.1 * (high - low) + 1e-6 * abs(line[0]), velocity[: time_s.size // 4]
    unusual = np.flatnonzero((early < low - margin) | (early > high + margin))
    until = time_s[0] + 1.1 * (time_s[unusual[-1]] - time_s[0]) if unusual.size else -np.inf
    rows = int(np.searchsorted(time_s, until, side="right"))
    return rows if np.abs(velocity[:rows]).max(initial=0.0) > _FASTER * np.abs(velocity[half:]).max() else 0
