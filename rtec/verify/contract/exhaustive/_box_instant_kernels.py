"""Compiled instant of the model: what encoder, PC and box may do at one point of the grid, and what that breaks.

The box's steps are those of `rtec.injector`. Where things coincide, every order of them is a successor: no two of
them are ever simultaneous in a machine.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper
from rtec.injector._kernels import injector_edge, injector_fire, injector_request
from rtec.injector._state_kernels import ARMED, IDLE
from rtec.signal._kernels import ILLEGAL, NEVER, count_delta, level_of_state, state_of_level

KEPT, ILLEGAL_CHANGE, TOO_CLOSE, WRONG_COUNT, UNFINISHED, TOO_LATE = 0, 1, 2, 3, 4, 5
"""What an instant breaks of the contract."""
MOST_OFF = 15
"""Counts by which the controller may be ahead or behind for a while; a step has fewer."""
STANDING, FIRST, TURNED, MOVING = 0, 1, 2, 3
"""Classes of motion: no edge yet, one, the last one took one back; from the last on, by the interval before."""

REQUEST, FIRE, EDGE = 0, 1, 2
ORDERS = np.array(
    [
        (REQUEST, FIRE, EDGE),  # as the benches have it
        (REQUEST, EDGE, FIRE),
        (FIRE, REQUEST, EDGE),
        (FIRE, EDGE, REQUEST),
        (EDGE, REQUEST, FIRE),
        (EDGE, FIRE, REQUEST),
    ]
)
AT_GATE, AT_READY, AT_RECOGNISED, AT_LOOK = 1, 2, 4, 8
"""Comparisons of the box with equal sides: what comes from outside may as well come on the other side."""


@helper
def may_move(m: Record, move: int) -> bool:
    """Return whether the encoder can send an edge now."""
    if m.motion == STANDING:
        return True
    least = m.least_same[m.motion] if move == m.direction else m.least_turn[m.motion]
    return bool(m.since >= least)


@helper
def note_move(m: Record, move: int) -> None:
    """Take an edge into the encoder's state."""
    if m.motion != STANDING and move != m.direction:
        m.motion = TURNED
    else:
        m.motion = FIRST if m.motion == STANDING else MOVING
        for k in range(MOVING + 1, m.classes):
            if m.since >= m.begins[k]:
                m.motion = k
    m.direction = move
    m.since = 0


@helper
def equal_sides(s: Record, now_ps: int, edge: bool, asked: bool) -> int:
    """Return the comparisons of an edge or a request now that have equal sides."""
    found = 0
    if edge and s.gate_ps > 0 and now_ps - s.edge_before_ps == s.gate_ps:
        found |= AT_GATE
    if edge and s.ready_ps == now_ps:
        found |= AT_READY
    if (edge or asked) and s.phase == ARMED and s.recognised_ps == now_ps:
        found |= AT_RECOGNISED
    if (edge or asked) and s.poll_ps > 0 and (now_ps - s.poll_offset_ps) % s.poll_ps == 0:
        found |= AT_LOOK
    return found


@helper
def fire_due(s: Record, now_ps: int) -> None:
    """Carry out the box's events up to now."""
    while s.next_ps <= now_ps:
        injector_fire(s)


@helper
def take_edge(s: Record, m: Record, now_ps: int, move: int, other_side: int) -> None:
    """Let the box see an edge, on the other side of some comparisons."""
    if other_side & AT_GATE:
        s.edge_before_ps += 1
    if other_side & AT_READY:
        s.ready_ps += 1
    if other_side & AT_RECOGNISED:
        s.recognised_ps -= 1
    if other_side & AT_LOOK:
        s.poll_offset_ps -= 1
    injector_edge(s, now_ps, level_of_state((state_of_level(s.ab_in) + move) & 3))
    if other_side & AT_LOOK:
        s.poll_offset_ps += 1
    note_move(m, move)


@helper
def take_request(s: Record, now_ps: int, total: int, other_side: int) -> None:
    """Let the box see a request, on the other side of some comparisons."""
    if other_side & AT_RECOGNISED:
        s.recognised_ps -= 1
    if other_side & AT_LOOK:
        s.poll_offset_ps -= 1
    injector_request(s, now_ps, total)
    if other_side & AT_LOOK:
        s.poll_offset_ps += 1


@helper
def in_order(
    s: Record,
    m: Record,
    now_ps: int,
    total: int,
    move: int,
    order: int,
    other_side: int,
    orders: NDArray[np.int64],
) -> None:
    """Let a request for a total, the box's events and an edge happen in an order."""
    for k in range(3):
        what = orders[order, k]
        if what == FIRE:
            fire_due(s, now_ps)
        elif what == EDGE and move != 0:
            take_edge(s, m, now_ps, move, other_side)
        elif what == REQUEST and total != s.requested:
            take_request(s, now_ps, total, other_side)
    fire_due(s, now_ps + 1)


@helper
def count_both(s: Record, m: Record, before_in: int, before_out: int) -> int:
    """Count the changes of an instant on both sides; return what they break."""
    out = count_delta(before_out, s.ab_out)
    if out == ILLEGAL:
        return ILLEGAL_CHANGE
    right_moved = count_delta(before_in, s.ab_in) + m.step_counts * m.booked
    m.off += out - right_moved
    if m.off == 0 or m.off == -right_moved:  # it is right, or was until this instant
        m.off_for = 0
    if out != 0:
        line = before_out ^ s.ab_out
        if m.out_line != 0 and line != m.out_line and m.out_since < m.separation:
            return TOO_CLOSE
        m.out_line = line
        m.out_since = 0
    return KEPT


@helper
def seen_so_far(s: Record, m: Record) -> int:
    """Return what the state behind an instant breaks."""
    if m.off != 0 and m.off_for > m.delay:
        return TOO_LATE
    if abs(m.off) > MOST_OFF:
        return WRONG_COUNT
    if s.phase == IDLE and s.next_ps >= NEVER:  # nothing is under way
        if m.off != 0:
            return WRONG_COUNT
        if s.requested != s.completed and (s.one_state == 0 or s.ab_in == 0):
            return UNFINISHED
    return KEPT


@helper
def instant(
    s: Record,
    m: Record,
    now_ps: int,
    owed: int,
    move: int,
    order: int,
    other_side: int,
    orders: NDArray[np.int64],
) -> int:
    """Carry out one instant: a request that leaves so many steps owed, the box's events, an edge.

    Returns what it breaks. Without a request ``owed`` is what is owed already; without an edge ``move`` is 0.
    """
    before_in, before_out, before_done = s.ab_in, s.ab_out, s.completed
    in_order(s, m, now_ps, before_done + owed, move, order, other_side, orders)
    m.booked = s.completed - before_done
    broken = count_both(s, m, before_in, before_out)
    if broken != KEPT:
        return int(broken)
    return int(seen_so_far(s, m))


@helper
def wait(m: Record, now_ps: int) -> int:
    """Let one point of the grid pass; return the time."""
    m.since = min(m.since + 1, m.longest)
    if m.off != 0:
        m.off_for += 1
    if m.out_line != 0:
        m.out_since += 1
        if m.out_since >= m.separation:
            m.out_line = 0
            m.out_since = 0
    return int(now_ps + m.grid_ps)
