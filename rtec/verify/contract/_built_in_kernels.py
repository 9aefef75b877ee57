"""Compiled run of a built-in design over one stimulus."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, kernel
from rtec.injector._kernels import injector_edge, injector_fire, injector_request
from rtec.injector._monitor_kernels import observe
from rtec.signal._kernels import earlier


@kernel
def play(
    s: Record,
    edges_ps: NDArray[np.int64],
    levels: NDArray[np.uint8],
    asked_ps: NDArray[np.int64],
    asked: NDArray[np.int64],
    until_ps: int,
    out_ps: NDArray[np.int64],
    out_levels: NDArray[np.uint8],
    done_ps: NDArray[np.int64],
    done: NDArray[np.int64],
) -> tuple[int, int]:
    """Run the box; return the numbers of its changes and of its completed totals, or -1 where the room is too small.

    Of one instant the request comes first, then the box's own changes, then the edge.
    """
    i, k, made, booked = 0, 0, 0, 0
    while True:
        t_ps = earlier(earlier(min(s.next_ps, until_ps), edges_ps, i), asked_ps, k)
        if t_ps >= until_ps:
            return made, booked
        if made == out_ps.size or booked == done_ps.size:
            return -1, -1
        before = s.completed
        if k < asked_ps.size and asked_ps[k] == t_ps:
            injector_request(s, t_ps, asked[k])
            k += 1
        while s.next_ps <= t_ps:
            injector_fire(s)
        if i < edges_ps.size and edges_ps[i] == t_ps:
            injector_edge(s, t_ps, int(levels[i]))
            i += 1
        if s.completed != before:
            done_ps[booked] = t_ps
            done[booked] = s.completed
            booked += 1
        if observe(s):
            out_ps[made] = t_ps
            out_levels[made] = s.ab_out
            made += 1
