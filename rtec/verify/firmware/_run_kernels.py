"""Compiled runs of a program: each from a kept state of board and processor, with edges and requests of its own."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_model.core._layout import RUNNING, STOP
from rtec._jit import Record, array_kernel
from rtec.board._board_kernels import COMPLETED, WORDS, board_ask, play, signed_word

Bytes = NDArray[np.uint8]
Longs = NDArray[np.int64]


@array_kernel
def play_runs(
    b: Record, raw_b: Bytes, cpu: Any, m: Bytes, h: Longs, log: Longs, kept_b: Bytes, kept_m: Bytes, kept_h: Longs,
    states: Longs, times_ps: Longs, levels: Bytes, edges: Longs, asked_ps: Longs, totals: Longs, requests: Longs,
    until_ps: Longs, said: Longs, out_ps: Longs, out_levels: Bytes, outs: Longs, told: Longs, tolds: Longs,
    last: Longs,
) -> int:  # fmt: skip
    """Make runs up to one that stops the processor or finds no room for what comes out; return how many were made.

    Run k begins in row ``states[k]`` of what was kept, takes the edges ``edges[k]`` to ``edges[k + 1]``, and so with
    requests; its times count from there. ``outs`` and ``tolds`` say in the same way where its changes and its
    publications lie, ``last`` whether its words are valid at the end, and the completed total.
    """
    longest = 0
    for k in range(states.size):
        longest = max(longest, edges[k + 1] - edges[k])
    queue = np.empty((longest, 3), np.int64)
    moved_ps = np.empty(longest, np.int64)
    for k in range(states.size):
        raw_b[:] = kept_b[states[k]]
        m[:] = kept_m[states[k]]
        h[:] = kept_h[states[k]]
        begun_ps, published = b.now_ps, b.published
        first, size = edges[k], edges[k + 1] - edges[k]
        moved_ps[:size] = times_ps[first : first + size] + begun_ps
        n, taken = outs[k], 0
        for r in range(requests[k], requests[k + 1] + 1):
            asks = r < requests[k + 1]
            end_ps = begun_ps + (asked_ps[r] if asks else until_ps[k])
            here = taken + np.searchsorted(moved_ps[taken:size], end_ps)
            while b.now_ps < end_ps:
                if out_ps.size - n < 2 * (here - taken) + 16:
                    return k
                i, wrote = play(
                    b, cpu, m, h, log, moved_ps[taken:here], levels[first + taken : first + here], end_ps,
                    queue, out_ps[n:], out_levels[n:], said,
                )  # fmt: skip
                taken += i
                n += wrote
            if asks:
                board_ask(m, totals[r], 0)
        if h[STOP] != RUNNING or b.published - published > min(said.shape[0], told.shape[0] - tolds[k]):
            return k
        out_ps[outs[k] : n] -= begun_ps
        outs[k + 1], tolds[k + 1] = n, tolds[k] + b.published - published
        for p in range(published, b.published):
            told[tolds[k] + p - published] = said[p % said.shape[0]]
        told[tolds[k] : tolds[k + 1], 0] -= begun_ps
        last[k, 0] = b.valid
        last[k, 1] = signed_word(m, WORDS + COMPLETED, 2)
    return int(states.size)
