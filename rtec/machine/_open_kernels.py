"""The open signal path in one compiled loop: encoder, box, receiver, one edge after the other.

All state stands in one record: the compiler then knows that the parts do not overlap.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, array_kernel, kernel, step
from rtec.axis._kernels import ENCODER, emit, encoder_level, encoder_reset, glitch_toggle, jitter, steady_crossing
from rtec.board._board_kernels import LARGE, board_ask, board_edge, board_fire, board_run, board_switch, read_bus
from rtec.controller._kernels import RECEIVER, X4, receiver_edge, receiver_reset, receiver_settle
from rtec.injector._kernels import (
    injector_edge,
    injector_fire,
    injector_request,
    injector_reset,
    note_edge,
)
from rtec.injector._monitor_kernels import observe
from rtec.injector._state_kernels import IDLE, INJECTOR, WRITING
from rtec.machine._firmware_kernels import READINGS_TO_END, note_insertions
from rtec.machine._tape_kernels import has_room, keep_board, keep_box
from rtec.signal._kernels import NEVER, count_delta, level_of_state

BLOCK = 16
"""Edges that pass together where nothing but counting happens to them: four whole cycles."""

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


@step
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


@step
def passes_unchanged(m: Record) -> bool:
    """Return whether the next edges pass all stages unchanged, as long as they are far enough apart.

    So it is while the box owes nothing, no glitch is to be drawn, the filter is at work, and the last edge is the one
    thing that it has not taken over yet.
    """
    e, s, rx = m.encoder, m.injector, m.receiver
    plain = e.glitch_level == 0 and e.glitch_next_ps == NEVER and e.eccentric_counts == 0.0
    idle = s.requested == s.completed and s.holding == 0 and s.ready_ps <= e.last_ps
    if s.in_path == 1:
        idle = idle and s.phase == WRITING and s.poll_ps == 0  # the last edge is on its way through the processor
    else:
        idle = idle and s.phase == IDLE
    pending = rx.raw ^ rx.accepted
    filtering = rx.samples > 0 and rx.multiplication == X4 and (pending == 1 or pending == 2)
    return plain and idle and filtering and count_delta(rx.accepted, rx.raw) == e.step_sign


@step
def pass_quietly(m: Record, edges: int, blocks_ps: NDArray[np.int64], shifts_ps: NDArray[np.int64]) -> None:
    """Pass up to ``edges`` edges block by block, as long as nothing but counting happens to them.

    The result is what the step functions give: each edge comes later after the one before it than the filter needs,
    so it makes the one before it count. The edges' times do not depend on each other then, and are computed together.
    """
    e, s, rx = m.encoder, m.injector, m.receiver
    sign, seed, bound_ps, whole_ps = e.step_sign, e.seed, e.jitter_ps, e.quarter_whole_ps
    for i in range(BLOCK):
        k = e.count + (i + 1 if sign > 0 else -i)
        shifts_ps[i] = e.shift_ps[(k + e.home) & 3] + (i + 1) * whole_ps
    rest, left, den = e.steady_rest, e.quarter_left, e.quarter_den
    last_ps, least_ps = e.last_ps, rx.min_separation_ps
    delay_ps = s.latency_ps if s.in_path == 1 else 0
    sure_ps, steady_ps, serial = max(rx.sure_ps, delay_ps), e.steady_ps, e.serial
    passed = 0
    row = 0
    while passed + BLOCK <= edges:
        times_ps = blocks_ps[row]
        for i in range(BLOCK):
            times_ps[i] = steady_ps + shifts_ps[i] + jitter(seed, serial + 1 + i, bound_ps)
        more_ps, new_rest = 0, rest
        if left != 0:  # quarters of no whole number of picoseconds: one more now and then
            for i in range(BLOCK):
                new_rest += left
                if new_rest >= den:
                    new_rest -= den
                    more_ps += 1
                times_ps[i] += more_ps
        closest_ps = times_ps[0] - last_ps
        for i in range(1, BLOCK):
            closest_ps = min(closest_ps, times_ps[i] - times_ps[i - 1])
        if closest_ps <= sure_ps:
            break
        least_ps = min(least_ps, closest_ps)
        last_ps = times_ps[BLOCK - 1]
        steady_ps += BLOCK * whole_ps + more_ps
        rest = new_rest
        serial += BLOCK
        passed += BLOCK
        row ^= 1  # the last whole block stays readable when the next one breaks off
    if passed == 0:
        return
    times_ps = blocks_ps[row ^ 1]
    e.count += sign * passed
    e.serial = serial
    e.steady_ps = steady_ps
    e.steady_rest = rest
    if s.in_path == 1:
        least_ps = min(least_ps, e.last_ps + delay_ps - rx.last_ps)  # what was on its way at the beginning
    e.last_ps = last_ps
    # what the stages remember of the edges: a block is whole cycles, so the levels are the same again
    seen = BLOCK - 1 if s.in_path == 0 else BLOCK - 2
    rx.count += sign * passed
    rx.direction = sign
    rx.min_separation_ps = least_ps
    rx.last_ps = times_ps[seen] + delay_ps
    a_is_last = rx.raw ^ rx.accepted == 1
    rx.changed_a_ps = times_ps[seen if a_is_last else seen - 1] + delay_ps
    rx.changed_b_ps = times_ps[seen - 1 if a_is_last else seen] + delay_ps
    if s.in_path == 1:
        s.next_ps = last_ps + delay_ps
    for i in range(BLOCK - 8, BLOCK):
        ab = level_of_state((e.count + e.home - sign * (BLOCK - 1 - i)) & 3)
        note_edge(s, times_ps[i], ab)


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


@array_kernel
def run(m: Record, edges: int, board: Any, tape: Any) -> int:
    """Move over the next ``edges`` lines at constant speed; return how many are left where the tape is full.

    ``board`` is None, or the box's circuits, processor, memory, hidden state, log and an empty queue.
    """
    e = m.encoder
    blocks_ps = np.empty((2, BLOCK), np.int64)
    shifts_ps = np.empty(BLOCK, np.int64)
    left = edges
    while left > 0:
        if tape is not None:
            if not has_room(tape, m.injector):
                return left
        elif board is None and m.in_blocks == 1 and passes_unchanged(m):
            before = e.serial
            # up to the edge before the next request
            until_due = (m.edges - 1 - m.due) // m.corrections if m.corrections > 0 else left
            pass_quietly(m, min(left, until_due), blocks_ps, shifts_ps)
            m.due += (e.serial - before) * m.corrections
            left -= e.serial - before
            if left == 0:
                return 0
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
