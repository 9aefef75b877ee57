"""The open signal path of a motion: pieces of constant acceleration, and corrections asked for at given times.

What an edge does in box and receiver is that of `rtec.machine._open_kernels`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, array_kernel, step
from rtec.axis._kernels import emit, next_crossing, set_piece
from rtec.board._board_kernels import board_switch
from rtec.controller._kernels import receiver_settle
from rtec.machine._firmware_kernels import READINGS_TO_END
from rtec.machine._open_kernels import (
    ask,
    fire_next,
    pass_edge,
    pass_glitch,
    run_board_until,
    run_box_until,
    see_board,
    see_box,
)
from rtec.machine._tape_kernels import has_room
from rtec.signal._kernels import NEVER
from rtec.units._time_kernels import PS_PER_S

PIECE_AT, ASKED = 0, 1
"""Where a run stands: the piece of motion that it is in, and how many requests were made."""
_PATIENCE_READINGS = 100
"""A program that inserts nothing at rest for so many readings inserts nothing any more."""


@step
def ask_before(
    m: Record, board: Any, asks_ps: NDArray[np.int64], at: NDArray[np.int64], t_ps: int, tape: Any
) -> None:
    """Ask for what is due before ``t_ps``."""
    while at[ASKED] < asks_ps.size and asks_ps[at[ASKED]] < t_ps:
        ask_ps = asks_ps[at[ASKED]]
        run_box_until(m, board, ask_ps, tape)
        ask(m, board, ask_ps)
        at[ASKED] += 1
        if board is not None:
            see_board(m, board[0], ask_ps, tape)
        else:
            see_box(m, ask_ps, tape)


@array_kernel
def run_pieces(
    m: Record,
    p: Record,
    start_ps: NDArray[np.int64],
    duration_ps: NDArray[np.int64],
    x0: NDArray[np.float64],
    v0: NDArray[np.float64],
    a0: NDArray[np.float64],
    asks_ps: NDArray[np.int64],
    at: NDArray[np.int64],
    edges: int,
    board: Any,
    tape: Any,
) -> bool:
    """Move on, over at most ``edges`` lines; return whether the motion is over."""
    e = m.encoder
    left = edges
    while at[PIECE_AT] < start_ps.size:
        i = at[PIECE_AT]
        p.start_ps = start_ps[i]
        p.x0 = x0[i]
        p.v0 = v0[i]
        p.a0 = a0[i]
        p.j0 = 0.0
        set_piece(p, 0.0, duration_ps[i] / PS_PER_S)
        while True:
            # all that is still to be asked for may come at rest, before the next edge
            if left <= 0 or not has_room(tape, m.injector, asks_ps.size - at[ASKED]):
                return False
            crossing_ps = next_crossing(e, p)
            if crossing_ps == NEVER:
                break
            left -= 1
            while e.glitch_next_ps < crossing_ps:
                ask_before(m, board, asks_ps, at, max(e.glitch_next_ps, e.last_ps + 1), tape)
                pass_glitch(m, board, tape)
            t_ps = emit(e, crossing_ps, p.sign)
            ask_before(m, board, asks_ps, at, t_ps, tape)
            run_box_until(m, board, t_ps, tape)
            while at[ASKED] < asks_ps.size and asks_ps[at[ASKED]] == t_ps:  # with the edge: one change of the lines
                ask(m, board, t_ps)
                at[ASKED] += 1
            pass_edge(m, board, t_ps, tape)
        at[PIECE_AT] += 1
    return True


@array_kernel
def come_to_rest(
    m: Record,
    asks_ps: NDArray[np.int64],
    at: NDArray[np.int64],
    total_ps: int,
    settle_ps: int,
    board: Any,
    tape: Any,
) -> int:
    """Let the box insert at rest what it owes after the motion; return the time at which all is settled."""
    e, s = m.encoder, m.injector
    while e.glitch_next_ps < NEVER:
        ask_before(m, board, asks_ps, at, max(e.glitch_next_ps, e.last_ps + 1), tape)
        pass_glitch(m, board, tape)
    end_ps = max(total_ps, e.last_ps) + 1
    ask_before(m, board, asks_ps, at, end_ps, tape)
    if board is not None:
        b, _, mem, h, log, _ = board
        waited, completed = 0, s.completed
        while s.completed != s.requested and waited < _PATIENCE_READINGS:
            end_ps += b.reading_ps
            run_board_until(m, board, end_ps, tape)
            see_board(m, b, end_ps, tape)
            waited = waited + 1 if s.completed == completed else 0
            completed = s.completed
        board_switch(b, mem, h, log, end_ps, 1, b.trip_n)
        end_ps += READINGS_TO_END * b.reading_ps
        run_board_until(m, board, end_ps, tape)
        see_board(m, b, end_ps, tape)
    else:
        run_box_until(m, board, end_ps, tape)
        see_box(m, end_ps, tape)
        while s.next_ps < NEVER:
            end_ps = fire_next(s)
            see_box(m, end_ps, tape)
    end_ps += settle_ps
    receiver_settle(m.receiver, end_ps)
    return end_ps
