"""Compiled test of edges: whether an encoder on an axis of limited acceleration can send them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rtec._jit import helper, kernel
from rtec.units._time_kernels import PS_PER_S

_ROUNDING = 1.0 + 1e-9


@helper
def fastest_hz(apart_ps: int, same: bool, gain_hz_s: float, jitter_ps: float) -> float:
    """Return how fast the axis can be at the end of an interval; the mean of one with a turn in it is 0."""
    seconds = max(apart_ps - jitter_ps, 1.0) / PS_PER_S
    mean_hz = 0.25 / seconds if same else 0.0
    return min(mean_hz + gain_hz_s * seconds / 2.0, math.sqrt(mean_hz * mean_hz + gain_hz_s / 2.0))


@helper
def too_soon(fastest: float, apart_ps: int, gain_hz_s: float, jitter_ps: float) -> bool:
    """Return whether an axis no faster than that cannot go over a count in an interval."""
    seconds = (apart_ps + jitter_ps) / PS_PER_S * _ROUNDING
    return fastest * seconds + gain_hz_s * seconds * seconds / 2.0 < 0.25


@kernel
def first_impossible(
    edges_ps: NDArray[np.int64],
    moves: NDArray[np.int64],
    shortest_ps: int,
    turn_ps: int,
    gain_hz_s: float,
    jitter_ps: float,
) -> int:
    """Return the place of the first edge that cannot come where it does, or the number of edges."""
    for k in range(1, edges_ps.size):
        apart_ps = edges_ps[k] - edges_ps[k - 1]
        same = moves[k] == moves[k - 1]
        if apart_ps < (shortest_ps if same else turn_ps):
            return k
        if same:  # a count within this interval, from the speed at the end of the one before
            from_power_up = k == 1
            before_ps = edges_ps[0] if from_power_up else edges_ps[k - 1] - edges_ps[k - 2]
            went_on = from_power_up or moves[k - 1] == moves[k - 2]
            fastest = fastest_hz(before_ps, went_on, gain_hz_s, jitter_ps)
            if too_soon(fastest, apart_ps, gain_hz_s, jitter_ps):
                return k
        elif k > 1 and moves[k - 1] == moves[k - 2]:  # a count up to the begin of this turn, backwards
            fastest = fastest_hz(apart_ps, False, gain_hz_s, jitter_ps)
            if too_soon(fastest, edges_ps[k - 1] - edges_ps[k - 2], gain_hz_s, jitter_ps):
                return k
    return int(edges_ps.size)
