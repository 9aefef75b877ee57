"""The motion before the test proper, at the start of a log: homing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtec.dataset.drive_signals import local_derivatives
from rtec.dataset.rows import Rows
from rtec.dataset.standstill import stretches_of
from rtec.effects.conditions import Floats

_FEWEST_ROWS = 20
_STEADY = 0.05  # departure from a straight line, as a share of the way, of a run at constant speed
_FASTER = 5.0  # than ever later is the axis in a transient


def without_transient(log: Rows) -> Rows:
    """Leave out the motion before the test proper, at the start of each run at constant speed."""
    if log.time_s is None or log.coordinate == "time":
        return log
    kept, notes = np.ones(len(log), dtype=np.bool_), []
    for begin, end in stretches_of(log.time_s, log.run):
        if begin and log.run[begin] == log.run[begin - 1]:
            continue
        time_s = log.time_s[begin:end]
        count = transient_rows(time_s, log.position[begin:end])
        if count:
            kept[begin : begin + count] = False
            which = "" if np.ptp(log.run) == 0 else f" of run {log.run[begin]}"
            why = "the axis is still in another motion (homing) there, far off the constant speed that it keeps later"
            notes.append(f"the first {time_s[count] - time_s[0]:.2f} s{which} ({count} rows) are left out: {why}")
    return replace(log.keep(kept), notes=(*log.notes, *notes))


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
