"""Compiled trials of the envelope: one motion of the axis, begun at many moments of the program.

Each trial starts from the same kept state of board and processor, so that nothing but the moment differs.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_model.core._layout import STOP, STOP_FAULT
from rtec._jit import Record, array_kernel, helper
from rtec.board._board_kernels import COMPLETED, WORDS, board_ask, play, signed_word
from rtec.controller._kernels import receiver_edge, receiver_settle

Bytes = NDArray[np.uint8]
Longs = NDArray[np.int64]

SAFE, ILLEGAL, WRONG_COUNT, NOT_COMPLETED, FAULT = 0, 1, 2, 3, 4
"""Verdicts of a trial."""

READINGS = 6
"""So many readings the axis rests at most after a motion, until what was asked for is done."""

BOOKINGS = 40
"""Looks after that, 5 cycles apart, where an insertion may be under way still."""


@helper
def run(
    b: Record, cpu: Any, m: Bytes, h: Longs, log: Longs, receivers: Any, spread_ps: int, times_ps: Longs,
    levels: Bytes, until_ps: int, queue: Longs, out_ps: Longs, out_levels: Bytes, said: Longs,
) -> None:  # fmt: skip
    """Run the board over edges and on to ``until_ps``; the receivers, whose clocks are apart, see what comes out."""
    taken = 0
    while b.now_ps < until_ps:
        i, n = play(b, cpu, m, h, log, times_ps[taken:], levels[taken:], until_ps, queue, out_ps, out_levels, said)
        taken += i
        for k in range(receivers.size):
            for j in range(n):
                receiver_edge(receivers[k], out_ps[j] + k * spread_ps, int(out_levels[j]))


@helper
def judge(
    b: Record, m: Bytes, h: Longs, receivers: Any, spread_ps: int, net: int, total: int, step_counts: int
) -> int:
    """Return the verdict at the present time; ``total`` is the request as a word."""
    if h[STOP] == STOP_FAULT:
        return FAULT
    verdict = SAFE
    done = signed_word(m, WORDS + COMPLETED, 2)
    for k in range(receivers.size):
        receiver_settle(receivers[k], b.now_ps + k * spread_ps)
        if receivers[k].simultaneous + receivers[k].unresolved > 0:
            return ILLEGAL
        if receivers[k].count != net + step_counts * done:
            verdict = WRONG_COUNT
    return NOT_COMPLETED if verdict == SAFE and done != total else verdict


@array_kernel
def sweep(
    b: Record, raw_b: Bytes, kept_b: Bytes, cpu: Any, m: Bytes, kept_m: Bytes, h: Longs, kept_h: Longs, log: Longs,
    receivers: Any, raw_receivers: Bytes, kept_receivers: Bytes, spread_ps: int, times_ps: Longs, levels: Bytes,
    net: int, shifts_ps: Longs, ask_at: int, total: int, flags: int, tail_ps: int, reading_ps: int,
    step_counts: int, stop: bool, verdicts: Bytes, moving: Bytes,
) -> int:  # fmt: skip
    """Carry out a trial for each shift of the motion; return the number of trials made.

    ``moving`` tells where all was completed before the axis came to rest. With ``stop`` the first that fails is the
    last. The words of the PC change at edge ``ask_at``; they are out already where it is negative.
    """
    n = times_ps.size
    queue = np.empty((n, 3), np.int64)
    out_ps = np.empty(2 * n + 1024, np.int64)
    out_levels = np.empty(2 * n + 1024, np.uint8)
    said = np.empty((1, 3), np.int64)  # the words are looked at in the end
    for i in range(shifts_ps.size):
        raw_b[:] = kept_b
        m[:] = kept_m
        h[:] = kept_h
        raw_receivers[:] = kept_receivers
        moved_ps = times_ps + shifts_ps[i]
        first = 0
        if ask_at >= 0:
            first = ask_at
            run(b, cpu, m, h, log, receivers, spread_ps, moved_ps[:first], levels[:first], moved_ps[first], queue,
                out_ps, out_levels, said)  # fmt: skip
            board_ask(m, total, flags)
        until_ps = moved_ps[n - 1] + tail_ps
        run(b, cpu, m, h, log, receivers, spread_ps, moved_ps[first:], levels[first:], until_ps, queue, out_ps,
            out_levels, said)  # fmt: skip
        verdict = judge(b, m, h, receivers, spread_ps, net, total, step_counts)
        moving[i] = 1 if signed_word(m, WORDS + COMPLETED, 2) == total else 0
        rest = 0
        while verdict in (WRONG_COUNT, NOT_COMPLETED) and rest < READINGS + BOOKINGS:
            # with more owed than the rest lasts, the last look must not fall between an insertion and its booking
            if rest >= READINGS and verdict == NOT_COMPLETED:
                break
            until_ps += reading_ps if rest < READINGS else tail_ps // 20
            rest += 1
            run(b, cpu, m, h, log, receivers, spread_ps, moved_ps[:0], levels[:0], until_ps, queue, out_ps,
                out_levels, said)  # fmt: skip
            verdict = judge(b, m, h, receivers, spread_ps, net, total, step_counts)
        verdicts[i] = verdict
        if stop and verdict != SAFE:
            return i + 1
    return shifts_ps.size
