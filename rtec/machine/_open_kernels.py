"""The open signal path in one compiled loop: encoder, box, receiver, one edge after the other.

All state stands in one record: the compiler then knows that the parts do not overlap.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, array_kernel, helper, kernel, step
from rtec.axis._ahead_kernels import AHEAD, cross_ahead, crosses_evenly, shift_lines
from rtec.axis._kernels import ENCODER, emit, encoder_level, encoder_reset, glitch_toggle, steady_crossing
from rtec.board._board_kernels import LARGE, board_ask, board_edge, board_fire, board_run, board_switch, read_bus
from rtec.controller._kernels import RECEIVER, receiver_edge, receiver_reset, receiver_settle
from rtec.injector._insertion_kernels import cancel
from rtec.injector._kernels import (
    injector_edge,
    injector_fire,
    injector_request,
    injector_reset,
)
from rtec.injector._monitor_kernels import observe
from rtec.injector._state_kernels import ARMED, INJECTOR
from rtec.machine._firmware_kernels import READINGS_TO_END, note_insertions
from rtec.machine._quiet_kernels import edge_ps, pass_quietly, passes_on
from rtec.machine._tape_kernels import has_room, keep_board, keep_box
from rtec.signal._kernels import level_of_state

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


@step
def see_box(m: Record, t_ps: int, tape: Any) -> None:
    """Let receiver and tape see the box at ``t_ps``."""
    see_gates(m, m.injector, t_ps)
    if tape is not None:
        keep_box(tape, m.injector, t_ps)


@step
def see_board(m: Record, b: Record, t_ps: int, tape: Any) -> None:
    """Let receiver and tape see the box with its firmware at ``t_ps``."""
    see_gates(m, b, t_ps)
    if tape is not None:
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


@step
def run_box_until(m: Record, board: Any, t_ps: int, tape: Any) -> None:
    """Carry out the box's own events up to and at ``t_ps``; those at ``t_ps`` itself join what comes next there."""
    if board is not None:
        run_board_until(m, board, t_ps, tape)
        return
    s = m.injector
    while s.next_ps <= t_ps:
        own_ps = s.next_ps
        while s.next_ps <= own_ps:
            injector_fire(s)
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
def switch_on_controller(m: Record, ab: int) -> None:
    """Let the receiver begin with the levels that the box drives."""
    receiver_reset(m.receiver, ab)


@step
def quiet_until(m: Record, t_ps: int, i: int, n: int, state: int, closest_ps: int) -> int:
    """Return up to which of ``n`` edges from ``i`` on the box only passes them on and nothing is asked for.

    ``state`` is the encoder's before edge number 0, ``closest_ps`` the least time between two edges.
    """
    s, sign = m.injector, m.encoder.step_sign
    until = n
    if s.requested != s.completed:  # it waits for both lines low, or is about to insert
        until = min(n, i + (-sign * (state + sign * (i + 1)) & 3)) if s.one_state == 1 else i
    if s.in_path == 1:  # the writing of an edge comes before the next edge
        until = min(until, n - 1) if closest_ps > s.latency_ps else i
    if until <= i or not passes_on(s, t_ps):
        return i
    return min(until, i + 1 + (m.edges - 1 - m.due) // m.corrections) if m.corrections > 0 else until


@step
def pass_ahead(m: Record, times_ps: NDArray[np.int64], n: int, state: int, closest_ps: int) -> None:
    """Send ``n`` edges, whose times are known, through box and receiver; ``state`` is the encoder's before them."""
    s, sign = m.injector, m.encoder.step_sign
    i = 0
    while i < n:
        t_ps = edge_ps(times_ps, i)
        run_box_until(m, None, t_ps, None)
        m.due += m.corrections
        while m.due >= m.edges:
            m.due -= m.edges
            ask(m, None, t_ps)
        if s.phase == ARMED and s.in_path == 0 and t_ps <= s.recognised_ps:
            cancel(s)  # as it would with the edge: the axis moves
        until = quiet_until(m, t_ps, i, n, state, closest_ps)
        if until > i:
            pass_quietly(m, times_ps, i, until, state, closest_ps)
            m.due += (until - 1 - i) * m.corrections
            i = until
        else:
            i += 1
            injector_edge(s, t_ps, level_of_state((state + sign * i) & 3))
            see_gates(m, s, t_ps)


@array_kernel
def run(m: Record, edges: int, board: Any, tape: Any) -> int:
    """Move over the next ``edges`` lines at constant speed; return how many are left where the tape is full.

    ``board`` is None, or the box's circuits, processor, memory, hidden state, log and an empty queue.
    """
    e = m.encoder
    left = edges
    if board is None and tape is None and crosses_evenly(e):
        times_ps = np.empty(AHEAD, np.int64)
        shifts_ps = np.empty(AHEAD, np.int64)
        shift_lines(e, shifts_ps)
        while left > 0:
            state = e.count + e.home
            n = min(left, AHEAD)
            closest_ps = cross_ahead(e, n, shifts_ps, times_ps)
            pass_ahead(m, times_ps, n, state, closest_ps)
            left -= n
    while left > 0:
        if tape is not None and not has_room(tape, m.injector):
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
def finish(m: Record, settle_ps: int, board: Any, tape: Any) -> int:
    """Stop: end what is under way, but begin nothing at rest; return the time at which all is settled."""
    e, s = m.encoder, m.injector
    while e.glitch_next_ps < e.last_ps + s.rest_ps:
        pass_glitch(m, board, tape)
    end_ps = e.last_ps
    if board is not None:
        b, _, mem, h, log, _ = board
        board_switch(b, mem, h, log, end_ps, 1, b.trip_n)
        end_ps += READINGS_TO_END * b.reading_ps
        run_board_until(m, board, end_ps, tape)
        see_board(m, b, end_ps, tape)
    else:
        while s.next_ps < e.last_ps + s.rest_ps:
            end_ps = s.next_ps
            run_box_until(m, board, end_ps, tape)
            see_box(m, end_ps, tape)
    end_ps += settle_ps
    receiver_settle(m.receiver, end_ps)
    return end_ps
