"""Runs of a log that are sampled at one period: where it has gaps, times that come twice, or a clock that jitters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtec.dataset.standstill import Ints
from rtec.effects.conditions import Floats
from rtec.errors import FileFormatError

FEWEST = 20
"""Samples of a run; a shorter one teaches nothing about motion."""
_EVEN = 0.01  # of the period that a sample may be off its place on the grid
_GAP, _GAP_UNEVEN = 1.5, 5.0  # periods without a sample that end a run, of an even and of an uneven log
_MOSTLY = 0.9  # of the intervals are within a tenth of the usual one: the log is even but for its gaps
_TWICE, _WILD = 0.1, 0.5  # share of times that come twice; spread of the intervals, in periods


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EvenRuns:
    """Samples at one period, in runs, and the rows that they come from.

    Parameters
    ----------
    period_s
        Between two samples.
    parts
        Rows of each run, shape (rows of the run,), ascending.
    grids
        Time of each sample of a run in s, shape (samples,); None where the samples are the rows themselves.
    notes
        What was done, in sentences.
    """

    period_s: float
    parts: tuple[Ints, ...]
    grids: tuple[tuple[Floats, Floats] | None, ...]
    notes: tuple[str, ...]

    def sampled(self, values: Floats) -> list[Floats]:
        """Return a column, shape (rows,), at the samples of each run."""
        return [
            values[rows] if grid is None else np.interp(grid[0], grid[1], values[rows])
            for rows, grid in zip(self.parts, self.grids, strict=True)
        ]

    @property
    def rows(self) -> Ints:
        """The row that is nearest to each sample, shape (samples,)."""
        found = [
            rows if grid is None else rows[np.searchsorted((grid[1][1:] + grid[1][:-1]) / 2.0, grid[0])]
            for rows, grid in zip(self.parts, self.grids, strict=True)
        ]
        return np.concatenate(found)


def even_runs(time_s: Floats, run: Ints, source: str, line_of: Sequence[int] | None = None) -> EvenRuns:
    """Return the runs of a log that are sampled at one period.

    A gap of more than one and a half periods begins another run; a row at the time of the row before is left out; an
    uneven log is resampled by straight lines between its rows.

    Parameters
    ----------
    time_s, run
        Of each row, shape (rows,).
    source, line_of
        The file, and the line of each row, for messages.

    Raises
    ------
    FileFormatError
        A clock that runs backwards within a run, times too coarse for the rows, intervals without a period, or no
        run of twenty samples.

    Examples
    --------
    >>> time_s = np.append(np.arange(30), np.arange(40, 70)) * 1e-3
    >>> found = even_runs(time_s, np.ones(60, dtype=np.int64), "x.csv")
    >>> round(found.period_s, 9), [part.size for part in found.parts], found.notes
    (0.001, [30, 30], ('1 gap in the times: runs begin anew behind it',))
    """
    steps, same = np.diff(time_s), run[1:] == run[:-1]
    if (back := np.flatnonzero(same & (steps < 0.0))).size:
        row = int(back[0]) + 1
        problem = f"time runs backwards: {time_s[row]:g} s after {time_s[row - 1]:g} s"
        allowed = "times that rise within a run; a column 'run' tells where a clock starts again"
        raise FileFormatError(source, None if line_of is None else line_of[row], problem, allowed)
    notes: list[str] = []
    twice = np.append(False, same & (steps == 0.0))
    if twice.sum() > _TWICE * twice.size:
        problem = f"{twice.sum()} of {twice.size} rows have the time of the row before"
        raise FileFormatError(source, None, problem, "times with more digits, so that each sample has its own")
    if twice.any():
        notes.append(f"{twice.sum()} rows at the time of the row before are left out")
    kept = np.flatnonzero(~twice)
    time_s, run = time_s[kept], run[kept]
    steps, same = np.diff(time_s), run[1:] == run[:-1]
    usual = float(np.median(steps[same])) if same.any() else 0.0
    if usual <= 0.0:
        raise FileFormatError(source, None, "no two rows of one run", "a log sampled at a fixed rate")
    mostly_even = np.mean(np.abs(steps[same] / usual - 1.0) < 0.1) > _MOSTLY
    gaps = same & (steps > (_GAP if mostly_even else _GAP_UNEVEN) * usual)
    within = steps[same & ~gaps] / usual
    if within.std() > _WILD:
        problem = f"intervals from {1e3 * within.min() * usual:.4g} to {1e3 * within.max() * usual:.4g} ms"
        raise FileFormatError(source, None, problem, "a log sampled at a fixed rate: export it at one")
    if gaps.any():
        count = int(gaps.sum())
        notes.append("1 gap in the times: runs begin anew behind it" if count == 1 else
                     f"{count} gaps in the times: runs begin anew behind each")  # fmt: skip
    places = np.split(np.arange(kept.size), np.flatnonzero(gaps | ~same) + 1)
    long = [place for place in places if place.size >= FEWEST]
    if not long:
        longest = max(place.size for place in places)
        raise FileFormatError(source, None, f"a run of {longest} samples at most", f"{FEWEST} or more without a gap")
    if len(long) < len(places):
        count = sum(place.size for place in places) - sum(place.size for place in long)
        notes.append(f"{count} rows in runs of fewer than {FEWEST} samples are left out")
    period_s, off = _period([time_s[place] for place in long])
    even = off <= max(_EVEN, 0.51 * _last_digit(time_s, period_s) / period_s)
    grids: list[tuple[Floats, Floats] | None] = [None] * len(long)
    if not even:
        grids = [(_grid(time_s[place], period_s), time_s[place]) for place in long]
        notes.append(
            f"samples are up to {100.0 * off:.0f} % of a period off an even grid: resampled every "
            f"{1e3 * period_s:.4g} ms by straight lines"
        )
    return EvenRuns(
        period_s=period_s, parts=tuple(kept[place] for place in long), grids=tuple(grids), notes=tuple(notes)
    )


def _period(times: list[Floats]) -> tuple[float, float]:
    """Return the period that fits all runs best, and how far the worst sample is off, in periods."""
    counts = [np.arange(time.size) - (time.size - 1) / 2.0 for time in times]
    centred = [time - time.mean() for time in times]
    spread = sum(float(count @ count) for count in counts)
    period = sum(float(count @ time) for count, time in zip(counts, centred, strict=True)) / spread
    off = max(np.abs(time - period * count).max() for count, time in zip(counts, centred, strict=True))
    return float(f"{period:.9g}"), float(off) / period


def _last_digit(time_s: Floats, period_s: float) -> float:
    """Return the step of the last digit of the times, 0 where it is below a millionth of a second."""
    few = time_s[:: max(1, time_s.size // 1000)]
    for digits in range(6):
        step = 10.0**-digits
        if step <= period_s and np.abs(few - np.round(few, digits)).max() <= 1e-3 * step:
            return step
    return 0.0


def _grid(time_s: Floats, period_s: float) -> Floats:
    count = max(FEWEST, int((time_s[-1] - time_s[0]) / period_s + 1e-9) + 1)
    return np.asarray(time_s[0] + period_s * np.arange(count))
