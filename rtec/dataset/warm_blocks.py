"""Blocks of a log: rows of one state of the machine, which are left out together when a choice is made."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.standstill import Ints
from rtec.effects.conditions import Floats

BY_SPEED = "spindle speed"
"""What starts a block where the speed is known and changes."""
EQUAL_PARTS = 6
"""Parts of the time, where nothing else makes blocks."""
FEWEST_BLOCKS = 3
"""With fewer, none can be held out while another is left out."""
_MOST_BLOCKS = 30
_SHORTEST_S = 300.0
_SAME_SPEED_RPM, _SAME_SPEED = 10.0, 0.02  # and share of the fastest, within which a measured speed is the same
_GAP = 10.0  # usual intervals without a row that may end a stretch
_LONGEST_GAP_S = 600.0
_SWING = 0.2  # share of the range of a temperature that a turn has to have
_HOTTEST = 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Blocks:
    """Rows by the state of the machine.

    Parameters
    ----------
    of_row
        Number of the block of each row, from 0, ascending, shape (rows,).
    names
        What each block is, such as ``1250 rpm``, by its number.
    by
        What starts a block, in words.
    notes
        What had to be taken instead of a change of speed, in sentences.
    """

    of_row: Ints
    names: tuple[str, ...]
    by: str
    notes: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """Number of blocks."""
        return len(self.names)


def breaks_in(time_s: Floats) -> tuple[NDArray[np.bool_], NDArray[np.bool_], float]:
    """Return after which rows the time jumps back, after which nothing was read for long, and the usual interval.

    Long is ten usual intervals and ten minutes. The first two have the shape (rows - 1,).
    """
    steps = np.diff(time_s)
    usual_s = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 1.0
    return steps < 0.0, steps > max(_GAP * usual_s, _LONGEST_GAP_S), usual_s


def stretch_starts(time_s: Floats, run: Ints) -> tuple[int, ...]:
    """Return the rows at which a log starts anew: the run changes, or there is a break in its time."""
    back, gap, _ = breaks_in(time_s)
    return (0, *(1 + np.flatnonzero(back | gap | (np.diff(run) != 0))).tolist())


def blocks_of(
    time_s: Floats,
    speed: Floats,
    run: Ints,
    starts: tuple[int, ...],
    *,
    heats: Sequence[Floats] = (),
    said: tuple[str, Floats] | None = None,
    fewest: int = FEWEST_BLOCKS,
) -> Blocks:
    """Return the blocks of a log.

    A change of the spindle's speed, and a new stretch or run, starts one. Ramps and blocks shorter than five minutes,
    or than a thirtieth of the log, join the block that follows. Without a speed that changes, stretches and runs
    alone are blocks. Where these are too few, the turns of the hottest sensors start blocks; else equal parts of the
    time are blocks.

    Parameters
    ----------
    time_s, speed, run
        Of each row, shape (rows,); the speed is the spindle's.
    starts
        Rows at which stretches begin.
    heats
        Temperatures, shape (rows,) each.
    said
        A column that the user names, and its values: it alone starts blocks.
    fewest
        Blocks that are needed.

    Examples
    --------
    >>> minutes = np.arange(300)
    >>> speed = np.repeat([0.0, 1000.0, 0.0], 100)
    >>> found = blocks_of(60.0 * minutes, speed, np.ones(300, dtype=np.int64), (0,))
    >>> found.names, found.by
    (('0 rpm', '1000 rpm', '0 rpm'), 'spindle speed')
    """
    passed_s = np.concatenate([[0.0], np.cumsum(np.clip(np.diff(time_s), 0.0, None))])
    shortest_s = max(_SHORTEST_S, float(passed_s[-1]) / _MOST_BLOCKS)

    def at_time(rows: Ints) -> str:
        return f"from {passed_s[rows[0]] / 3600.0:.3g} h"

    if said is not None:
        name, values = said
        begins = 1 + np.flatnonzero(np.diff(values) != 0.0)
        return _named(_numbers(passed_s, begins, 0.0), f"column {name}", at_time)
    fixed = np.array(starts[1:], dtype=np.int64)
    tries: list[tuple[str, Ints, Callable[[Ints], str]]] = [
        (BY_SPEED, _changes(speed), lambda rows: _usual_speed(speed[rows])),
        ("run or stretch", np.empty(0, dtype=np.int64), lambda rows: f"run {run[rows[0]]}, {at_time(rows)}"),
        ("turn of the hottest sensors", _turns(heats), at_time),
    ]
    notes: list[str] = []
    for by, begins, words in tries[int(np.ptp(speed) == 0.0) :]:
        found = _named(_numbers(passed_s, np.union1d(begins, fixed), shortest_s), by, words)
        if found.count >= fewest:
            return replace(found, notes=tuple(notes))
        if found.count > 1:
            notes.append(f"{found.count} blocks by {by} are too few: {fewest} are needed")
    by = f"{EQUAL_PARTS} equal parts of the time"
    notes.append(f"{by} are the blocks; --blocks COLUMN names a column that tells better ones")
    parts = np.floor(EQUAL_PARTS * passed_s / np.nextafter(max(float(passed_s[-1]), 1.0), np.inf))
    return replace(_named(parts.astype(np.int64), by, at_time), notes=tuple(notes))


def _named(of_row: Ints, by: str, words: Callable[[Ints], str]) -> Blocks:
    numbers, of_row = np.unique(of_row, return_inverse=True)
    names = tuple(words(np.flatnonzero(of_row == number)) for number in range(numbers.size))
    return Blocks(of_row=of_row.astype(np.int64), names=names, by=by)


def _numbers(passed_s: Floats, begins: Ints, shortest_s: float) -> Ints:
    """Return the number of the block of each row; what is too short joins what follows, at the end what is before."""
    kept = [0]
    for begin in begins.tolist():
        if passed_s[begin] - passed_s[kept[-1]] >= shortest_s:
            kept.append(begin)
    if len(kept) > 1 and passed_s[-1] - passed_s[kept[-1]] < shortest_s:
        kept.pop()
    numbers = np.zeros(passed_s.size, dtype=np.int64)
    numbers[kept[1:]] = 1
    return np.cumsum(numbers)


def _changes(speed: Floats) -> Ints:
    """Return the rows at which a speed, which may be a measured one, changes."""
    begins, before = [], speed[0]
    same = max(_SAME_SPEED_RPM, _SAME_SPEED * float(np.abs(speed).max()))
    for row in (1 + np.flatnonzero(np.diff(speed))).tolist():
        if abs(speed[row] - before) > same:
            begins.append(row)
            before = speed[row]
    return np.array(begins, dtype=np.int64)


def _usual_speed(speed: Floats) -> str:
    values, rows = np.unique(np.round(speed / _SAME_SPEED_RPM) * _SAME_SPEED_RPM, return_counts=True)
    usual = values[np.argmax(rows)]
    return f"{usual:.0f} rpm" if 2 * rows.max() > speed.size else f"{values[0]:.0f} to {values[-1]:.0f} rpm"


def _turns(every: Sequence[Floats]) -> Ints:
    """Return the rows at which the hottest sensors, together, turn from rising to falling or back."""
    heats = [values for values in every if np.ptp(values) > 0.0]
    if not heats:
        return np.empty(0, dtype=np.int64)
    hottest = sorted(heats, key=lambda values: -float(np.ptp(values)))[:_HOTTEST]
    course = np.mean([(values - values.min()) / np.ptp(values) for values in hottest], axis=0)
    turns: list[int] = []
    low = high = 0
    rising: bool | None = None
    for row in range(course.size):
        low, high = (row if course[row] < course[low] else low), (row if course[row] > course[high] else high)
        fell, rose = course[high] - course[row] > _SWING, course[row] - course[low] > _SWING
        if (fell and rising is not False) or (rose and not rising):
            turn = high if fell else low
            if rising is not None:
                turns.append(turn)
            rising, low, high = rose, row, row
    return np.array(turns, dtype=np.int64)
