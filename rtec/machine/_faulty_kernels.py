"""The open path behind the lines' faults, compiled: edges and requests of one window through box and controller.

``board`` is as of `rtec.machine._open_kernels`. Compiled for runs with faults only.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_model.core import _layout as cpu_at
from rtec._jit import Record, kernel
from rtec.board._board_kernels import (
    LARGE,
    board_ask,
    board_edge,
    board_lose_power,
    board_pins,
    cycle_that_sees,
    gates as board_gates,
    time_of,
)
from rtec.injector._kernels import injector_edge, injector_hang, injector_latch, injector_request
from rtec.machine._open_kernels import run_box_until, see_box
from rtec.machine._recorder_kernels import has_room
from rtec.signal._kernels import NEVER

EDGES_DONE, ASKS_DONE, UNSEEN_PS = 0, 1, 2
"""Where a window stands: edges and requests passed, and the time of a change that nobody has seen yet."""


@kernel
def run_window(
    m: Record,
    board: Any,
    tape: Any,
    times_ps: NDArray[np.int64],
    levels: NDArray[np.uint8],
    asks_ps: NDArray[np.int64],
    totals: NDArray[np.int64],
    at: NDArray[np.int64],
    until_ps: int,
) -> bool:
    """Go on up to just before ``until_ps``; False where the tape is full before."""
    s = m.injector
    while True:
        if not has_room(tape, s, 1):
            return False
        i, j = at[EDGES_DONE], at[ASKS_DONE]
        edge_ps = times_ps[i] if i < times_ps.size else NEVER
        ask_ps = asks_ps[j] if j < asks_ps.size else NEVER
        t_ps = min(min(edge_ps, ask_ps), until_ps)
        if t_ps > at[UNSEEN_PS]:
            see_box(m, board, at[UNSEEN_PS], tape)
            at[UNSEEN_PS] = NEVER
        if t_ps == until_ps:
            run_box_until(m, board, t_ps - 1, tape)
            see_box(m, board, t_ps - 1, tape)
            return True
        run_box_until(m, board, t_ps, tape)
        if ask_ps == t_ps:
            if board is not None:
                s.requested = totals[j]
                board_ask(board[2], s.requested, LARGE)
            else:
                injector_request(s, t_ps, totals[j])
            at[ASKS_DONE] = j + 1
        if edge_ps == t_ps:
            m.encoder.last_ps = t_ps
            at[EDGES_DONE] = i + 1
            if board is not None:
                board_edge(board[0], board[2], board[3], board[4], t_ps, int(levels[i]))
            else:
                injector_edge(s, t_ps, int(levels[i]))
        see_box(m, board, t_ps, tape)


@kernel
def hang(s: Record) -> None:
    """Let the processor of a modelled box stand still: its outputs stay."""
    injector_hang(s)


@kernel
def set_latch(s: Record, t_ps: int, level: int, sticks: int, closed: int) -> None:
    """Let the hold latch of a modelled box stick, open or closed, or work again; ``level`` is that of the lines."""
    injector_latch(s, t_ps, level, sticks, closed)


@kernel
def cut_board(b: Record, h: NDArray[np.int64]) -> None:
    """Take the power of a board away."""
    board_lose_power(b, h)


@kernel
def hang_board(b: Record, h: NDArray[np.int64]) -> None:
    """Let a board's processor stand still: its outputs stay."""
    h[cpu_at.STOP] = cpu_at.STOP_POWER_DOWN
    b.next_ps = NEVER


@kernel
def set_board_latch(board: Any, t_ps: int, sticks: int, closed: int) -> None:
    """Let the hold latch of a board stick, open or closed, or work again."""
    b, _, mem, h, log, _ = board
    b.latched = 1 - sticks
    if closed == 1 and b.holding == 0:
        b.held = b.ab_in
    b.holding = closed
    board_pins(b, mem, h, log, cycle_that_sees(b, t_ps))
    b.ab_out = board_gates(b)


@kernel
def set_board_clock(b: Record, h: NDArray[np.int64], num: int, den: int) -> None:
    """Let a board's cycles last ``num / den`` times as long, from the one that is about to begin."""
    begins_ps = time_of(b, h[cpu_at.CYCLES])
    b.cycle_num *= num
    b.cycle_den *= den
    b.cycles_per_ps = b.cycle_den / b.cycle_num
    b.sample_ps = b.sample_ps * num // den
    b.reading_ps = b.reading_ps * num // den
    b.origin_ps += begins_ps - time_of(b, h[cpu_at.CYCLES])
