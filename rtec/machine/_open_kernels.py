"""The open signal path in one compiled loop: encoder, box, receiver, one edge after the other.

All state stands in one record: the compiler then knows that the parts do not overlap. Known when a loop is compiled:

``motion`` is None at a constant speed, where corrections are spread evenly over the edges. Else it is a tuple: a
piece; the pieces of constant acceleration as start and duration in ps, and motion of shape (3, pieces) in counts and
seconds; the times in ps at which corrections are asked for; and where the run stands (`PIECE_AT`, `ASKED`).

``board`` is None where the injector models the box, else the box's circuits, processor, memory, hidden state, log and
an empty queue.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rtec._jit import Record, helper, kernel, step
from rtec.axis._kernels import (
    ENCODER,
    emit,
    encoder_level,
    glitch_toggle,
    next_crossing,
    set_piece,
    steady_crossing,
)
from rtec.board._board_kernels import LARGE, board_ask, board_edge, board_fire, board_run, board_switch, read_bus
from rtec.controller._kernels import RECEIVER, receiver_edge, receiver_settle
from rtec.injector._kernels import injector_edge, injector_fire, injector_request
from rtec.injector._monitor_kernels import observe
from rtec.injector._state_kernels import INJECTOR
from rtec.machine._box_kernels import stand_still
from rtec.machine._firmware_kernels import READINGS_TO_END, note_insertions
from rtec.machine._recorder_kernels import has_room, keep_board, keep_box
from rtec.signal._kernels import NEVER
from rtec.units._time_kernels import PS_PER_S

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

PIECE_AT, ASKED = 0, 1
"""Where a motion stands: the piece that it is in, and how many requests were made."""
_PATIENCE_READINGS = 100
"""A program that inserts nothing at rest for so many readings inserts nothing any more."""


@step
def see_gates(m: Record, gates: Record, t_ps: int) -> None:
    """Let the receiver see what the gates drive, once all events of this instant are carried out."""
    if observe(gates):
        receiver_edge(m.receiver, t_ps, gates.ab_out)


@step
def see_box(m: Record, board: Any, t_ps: int, tape: Any) -> None:
    """Let receiver and tape see the box at ``t_ps``."""
    if board is not None:
        see_gates(m, board[0], t_ps)
        keep_board(tape, m.injector, board[0], t_ps)
    else:
        see_gates(m, m.injector, t_ps)
        if tape is not None:
            keep_box(tape, m.injector, t_ps)


@step
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
            see_box(m, None, own_ps, tape)


@step
def run_board_until(m: Record, board: Any, t_ps: int, tape: Any) -> None:
    """Let the processor run up to ``t_ps``, as :func:`run_box_until`."""
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
                see_box(m, board, own_ps, tape)
        else:
            return


@step
def pass_edge(m: Record, board: Any, t_ps: int, tape: Any) -> None:
    """Send the encoder's levels at ``t_ps`` through box and receiver."""
    ab = encoder_level(m.encoder)
    if board is not None:
        b, _, mem, h, log, _ = board
        board_edge(b, mem, h, log, t_ps, ab)
    else:
        injector_edge(m.injector, t_ps, ab)
    see_box(m, board, t_ps, tape)


@helper
def pass_glitch(m: Record, motion: Any, board: Any, tape: Any) -> None:
    """Send an edge of a glitch, the next thing that happens on the lines, through box and receiver."""
    e = m.encoder
    if motion is not None:
        ask_before(m, motion, board, max(e.glitch_next_ps, e.last_ps + 1), tape)
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


@step
def ask_before(m: Record, motion: Any, board: Any, t_ps: int, tape: Any) -> None:
    """Ask for what is due in a motion before ``t_ps``."""
    asks_ps, at = motion[4], motion[5]
    while at[ASKED] < asks_ps.size and asks_ps[at[ASKED]] < t_ps:
        ask_ps = asks_ps[at[ASKED]]
        run_box_until(m, board, ask_ps, tape)
        ask(m, board, ask_ps)
        at[ASKED] += 1
        see_box(m, board, ask_ps, tape)


@step
def ask_with_edge(m: Record, motion: Any, board: Any, t_ps: int) -> None:
    """Ask for what is due with the edge at ``t_ps``: one change of the lines."""
    if motion is None:
        m.due += m.corrections
        while m.due >= m.edges:
            m.due -= m.edges
            ask(m, board, t_ps)
    else:
        asks_ps, at = motion[4], motion[5]
        while at[ASKED] < asks_ps.size and asks_ps[at[ASKED]] == t_ps:
            ask(m, board, t_ps)
            at[ASKED] += 1


@kernel
def start(m: Record) -> None:
    """Stand still at home."""
    stand_still(m)
    m.due = m.edges - 1


@step
def begin_piece(motion: Any) -> bool:
    """Begin the piece that a motion is in, or go on in it; False where there is none left."""
    p, start_ps, duration_ps, shape, _, at = motion
    i = at[PIECE_AT]
    if i == start_ps.size:
        return False
    p.start_ps = start_ps[i]
    p.x0 = shape[0, i]
    p.v0 = shape[1, i]
    p.a0 = shape[2, i]
    p.j0 = 0.0
    set_piece(p, 0.0, duration_ps[i] / PS_PER_S)
    return True


@kernel
def run(m: Record, motion: Any, edges: int, board: Any, tape: Any) -> int:
    """Move on over at most ``edges`` lines; return how many are left where the tape is full or the motion is over."""
    e, s = m.encoder, m.injector
    left = edges
    if motion is not None:
        if not begin_piece(motion):
            return left
    while left > 0:
        # all that is still to be asked for in a motion may come at rest, before the next edge
        if tape is not None and not has_room(tape, s, 0 if motion is None else motion[4].size - motion[5][ASKED]):
            return left
        sign = e.step_sign
        if motion is None:
            crossing_ps = steady_crossing(e)
        else:
            sign = motion[0].sign
            crossing_ps = next_crossing(e, motion[0])
            if crossing_ps == NEVER:
                motion[5][PIECE_AT] += 1
                if not begin_piece(motion):
                    return left
                continue
        left -= 1
        while e.glitch_next_ps < crossing_ps:
            pass_glitch(m, motion, board, tape)
        t_ps = emit(e, crossing_ps, sign)
        if motion is not None:
            ask_before(m, motion, board, t_ps, tape)
        run_box_until(m, board, t_ps, tape)
        ask_with_edge(m, motion, board, t_ps)
        pass_edge(m, board, t_ps, tape)
    return left


@kernel
def end_glitches(m: Record, motion: Any, board: Any, tape: Any) -> None:
    """Let the glitches that are due come to their end after the last edge: all after a motion."""
    e, s = m.encoder, m.injector
    while e.glitch_next_ps < (e.last_ps + s.rest_ps if motion is None else NEVER):
        pass_glitch(m, motion, board, tape)


@kernel
def finish(m: Record, motion: Any, total_ps: int, settle_ps: int, board: Any, tape: Any) -> int:
    """End what is under way; return the time at which all is settled.

    A motion of ``total_ps`` ends at rest, and the box inserts what it owes; after a constant speed it begins nothing.
    """
    e, s = m.encoder, m.injector
    end_ps = e.last_ps
    until_ps = end_ps + s.rest_ps
    if motion is not None:
        end_ps = max(total_ps, end_ps) + 1
        until_ps = NEVER
        ask_before(m, motion, board, end_ps, tape)
    if board is not None:
        b, _, mem, h, log, _ = board
        if motion is not None:
            waited, completed = 0, s.completed
            while s.completed != s.requested and waited < _PATIENCE_READINGS:
                end_ps += b.reading_ps
                run_board_until(m, board, end_ps, tape)
                see_box(m, board, end_ps, tape)
                waited = waited + 1 if s.completed == completed else 0
                completed = s.completed
        board_switch(b, mem, h, log, end_ps, 1, b.trip_n)
        end_ps += READINGS_TO_END * b.reading_ps
        run_board_until(m, board, end_ps, tape)
        see_box(m, board, end_ps, tape)
    else:
        while s.next_ps < until_ps:
            own_ps = fire_next(s)
            see_box(m, board, own_ps, tape)
            end_ps = max(end_ps, own_ps)
    end_ps += settle_ps
    receiver_settle(m.receiver, end_ps)
    return end_ps
