"""The open signal path in one compiled loop: encoder, box, receiver, one edge after the other.

All state stands in one record: the compiler then knows that the parts do not overlap.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rtec._jit import Record, helper, kernel, step, written_out
from rtec.axis._kernels import ENCODER, emit, encoder_level, encoder_reset, glitch_toggle, steady_crossing
from rtec.board._board_kernels import LARGE, board_ask, board_edge, board_fire, board_run, board_switch, read_bus
from rtec.controller._kernels import RECEIVER, receiver_edge, receiver_reset, receiver_settle
from rtec.injector._kernels import (
    injector_edge,
    injector_fire,
    injector_request,
    injector_reset,
)
from rtec.injector._monitor_kernels import observe
from rtec.injector._state_kernels import INJECTOR
from rtec.machine._firmware_kernels import READINGS_TO_END, note_insertions
from rtec.machine._tape_kernels import has_room, keep_board, keep_box

OPEN_PATH = np.dtype(
    [
        ("encoder", ENCODER),
        ("injector", INJECTOR),
        ("receiver", RECEIVER),
        # corrections asked for, spread evenly over the edges: one is due whenever the sum passes `edges`
        ("edges", np.int64),
        ("corrections", np.int64),
        ("sign", np.int64),
        ("due", np.int64),
        ("in_blocks", np.int64),  # 0: every edge goes through the step functions, for comparison
    ],
    align=True,
)


@step
def see_gates(m: Record, gates: Record, t_ps: int) -> None:
    """Let the receiver see what the gates drive, once all events of this instant are carried out."""
    if observe(gates):
        receiver_edge(m.receiver, t_ps, gates.ab_out)


@written_out
def see_box(m: Record, t_ps: int, tape: Any) -> None:
    """Let receiver and tape see the box at ``t_ps``."""
    see_gates(m, m.injector, t_ps)
    if tape is not None:
        keep_box(tape, m.injector, t_ps)


@step
def see_board(m: Record, b: Record, t_ps: int, tape: Any) -> None:
    """Let receiver and tape see the box with its firmware at ``t_ps``."""
    see_gates(m, b, t_ps)
    keep_board(tape, m.injector, b, t_ps)


@step
def run_board_until(m: Record, board: Any, t_ps: int, tape: Any) -> None:
    """Let the processor run up to ``t_ps``; what it changes at ``t_ps`` itself joins what comes next there."""
    b, cpu, mem, h, log, queue = board
    while True:
        if board_run(b, cpu, mem, h, log, queue, t_ps):
            read_bus(b, mem, h)
        elif b.next_ps <= t_ps:
            own_ps = b.next_ps
            published = b.published
            board_fire(b, mem, h, log)
            if b.published > published:
                note_insertions(m.injector, b, mem)
            if own_ps < t_ps:
                see_board(m, b, own_ps, tape)
        else:
            return


@written_out
def fire_next(s: Record) -> int:
    """Carry out the box's own events of the next instant that has any; return when that is."""
    own_ps = s.next_ps
    while s.next_ps <= own_ps:
        injector_fire(s)
    return own_ps


@step
def run_box_until(m: Record, board: Any, t_ps: int, tape: Any) -> None:
    """Carry out the box's own events up to and at ``t_ps``; those at ``t_ps`` itself join what comes next there."""
    if board is not None:
        run_board_until(m, board, t_ps, tape)
        return
    while m.injector.next_ps <= t_ps:
        own_ps = fire_next(m.injector)
        if own_ps < t_ps:
            see_box(m, own_ps, tape)


@step
def pass_edge(m: Record, board: Any, t_ps: int, tape: Any) -> None:
    """Send the encoder's levels at ``t_ps`` through box and receiver."""
    ab = encoder_level(m.encoder)
    if board is not None:
        b, _, mem, h, log, _ = board
        board_edge(b, mem, h, log, t_ps, ab)
        see_board(m, b, t_ps, tape)
    else:
        injector_edge(m.injector, t_ps, ab)
        see_box(m, t_ps, tape)


@helper
def pass_glitch(m: Record, board: Any, tape: Any) -> None:
    """Send an edge of a glitch, the next thing that happens on the lines, through box and receiver."""
    e = m.encoder
    t_ps = max(glitch_toggle(e), e.last_ps + 1)
    e.last_ps = t_ps
    run_box_until(m, board, t_ps, tape)
    pass_edge(m, board, t_ps, tape)


@step
def ask(m: Record, board: Any, t_ps: int) -> None:
    """Ask for one step more; a window of the firmware's is meant to be exceeded."""
    s = m.injector
    if board is not None:
        s.requested += m.sign
        board_ask(board[2], s.requested, LARGE)
    else:
        injector_request(s, t_ps, s.requested + m.sign)


@kernel
def start(m: Record, count: int) -> None:
    """Stand still at ``count``."""
    encoder_reset(m.encoder, count)
    injector_reset(m.injector, encoder_level(m.encoder))
    receiver_reset(m.receiver, encoder_level(m.encoder))
    m.due = m.edges - 1


@kernel
def run(m: Record, edges: int, board: Any, tape: Any) -> int:
    """Move over the next ``edges`` lines at constant speed; return how many are left where the tape is full.

    ``board`` is None, or the box's circuits, processor, memory, hidden state, log and an empty queue.
    """
    e = m.encoder
    left = edges
    while left > 0:
        if tape is not None and not has_room(tape, m.injector, 0):
            return left
        left -= 1
        crossing_ps = steady_crossing(e)
        while e.glitch_next_ps < crossing_ps:
            pass_glitch(m, board, tape)
        t_ps = emit(e, crossing_ps, e.step_sign)
        run_box_until(m, board, t_ps, tape)
        m.due += m.corrections
        while m.due >= m.edges:
            m.due -= m.edges
            ask(m, board, t_ps)
        pass_edge(m, board, t_ps, tape)
    return 0


@kernel
def end_glitches(m: Record, board: Any, tape: Any) -> None:
    """Let the glitches that are due come to their end after the last edge."""
    while m.encoder.glitch_next_ps < m.encoder.last_ps + m.injector.rest_ps:
        pass_glitch(m, board, tape)


@kernel
def finish(m: Record, settle_ps: int, board: Any, tape: Any) -> int:
    """Stop: end what is under way, but begin nothing at rest; return the time at which all is settled."""
    e, s = m.encoder, m.injector
    end_ps = e.last_ps
    if board is not None:
        b, _, mem, h, log, _ = board
        board_switch(b, mem, h, log, end_ps, 1, b.trip_n)
        end_ps += READINGS_TO_END * b.reading_ps
        run_board_until(m, board, end_ps, tape)
        see_board(m, b, end_ps, tape)
    else:
        while s.next_ps < e.last_ps + s.rest_ps:
            end_ps = fire_next(s)
            see_box(m, end_ps, tape)
    end_ps += settle_ps
    receiver_settle(m.receiver, end_ps)
    return end_ps
