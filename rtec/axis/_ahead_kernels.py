"""Compiled crossings of many lines ahead at constant speed: no edge's time depends on the one before it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, step
from rtec.axis._kernels import jitter

AHEAD = 128
"""Lines crossed ahead at once: whole cycles, so that the kinds of the lines repeat; a power of two."""


@step
def shift_lines(e: Record, shifts_ps: NDArray[np.int64]) -> None:
    """Write how much later than the last nominal crossing each of the next lines comes, jitter apart."""
    for i in range(AHEAD):
        k = e.count + (i + 1 if e.step_sign > 0 else -i)
        shifts_ps[i] = e.shift_ps[(k + e.home) & 3] + (i + 1) * e.quarter_whole_ps


@step
def edge_block(e: Record, n: int, shifts_ps: NDArray[np.int64], times_ps: NDArray[np.int64]) -> int:
    """Cross the next ``n`` lines, at most AHEAD, as `steady_crossing` and `emit` do one by one.

    Writes the times of the edges; returns the least time between two of them, the one before the first included.
    """
    # the loops that do not wait for the edge before are such that the compiler takes several edges at once
    seed, serial, bound_ps, steady_ps = e.seed, e.serial, e.jitter_ps, e.steady_ps
    for i in range(n):
        times_ps[i] = steady_ps + shifts_ps[i] + jitter(seed, serial + 1 + i, bound_ps)
    more_ps = 0
    if e.quarter_left != 0:  # quarters of no whole number of picoseconds: one more now and then
        rest, left, den = e.steady_rest, e.quarter_left, e.quarter_den
        for i in range(n):
            rest += left
            if rest >= den:
                rest -= den
                more_ps += 1
            times_ps[i] += more_ps
        e.steady_rest = rest
    closest_ps = times_ps[0] - e.last_ps
    for i in range(1, n):
        closest_ps = min(closest_ps, times_ps[i] - times_ps[i - 1])
    if closest_ps <= 0:  # a line cannot overtake the one before it
        closest_ps = 1
        last_ps = e.last_ps
        for i in range(n):
            last_ps = max(times_ps[i], last_ps + 1)
            times_ps[i] = last_ps
    e.steady_ps = steady_ps + n * e.quarter_whole_ps + more_ps
    e.serial = serial + n
    e.count += e.step_sign * n
    e.last_ps = times_ps[n - 1]
    return int(closest_ps)
