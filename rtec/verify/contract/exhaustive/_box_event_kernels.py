"""Compiled events of the model: what encoder, PC and box may do next, and what that breaks.

The box's steps are those of `rtec.injector`. One thing happens at a time; several at one point of the grid happen
one after the other, in each order. A comparison of the box with equal sides has both outcomes.
"""

from __future__ import annotations

from rtec._jit import Record, helper, kernel
from rtec.injector._insertion_kernels import UNTIMED_PS
from rtec.injector._kernels import injector_edge, injector_fire, injector_request
from rtec.injector._state_kernels import ARMED, IDLE, INSERTING, SAMPLING
from rtec.signal._kernels import ILLEGAL, NEVER, count_delta, level_of_state, state_of_level
from rtec.verify.contract.exhaustive._box_state_kernels import NOW_PS, pack, unpack

KEPT, ILLEGAL_CHANGE, TOO_CLOSE, WRONG_COUNT, UNFINISHED, TOO_LATE = 0, 1, 2, 3, 4, 5
"""What an event breaks of the contract."""
MOST_OFF = 15
"""Counts by which the controller may be ahead or behind for a while; a step has fewer."""
STANDING, FIRST, TURNED, MOVING = 0, 1, 2, 3
"""Classes of motion: no edge yet, one, the last one took one back; from the last on, by the interval before."""

DOWN, WAIT, UP, FIRE, REQUEST = 0, 1, 2, 3, 4
"""Kinds of event: an edge either way, a point of the grid that passes, the box's own event, the PC."""
AT_GATE, AT_READY, AT_RECOGNISED = 1, 2, 4
"""Comparisons of the box with equal sides: what comes from outside may as well come on the other side."""


@helper
def code_of(kind: int, owed: int, sides: int, look: int) -> int:
    """Return one number for an event."""
    return ((look * 8 + sides) * 4 + owed + 1) * 8 + kind


def event_of(how: int) -> tuple[int, int, int, int]:
    """Return kind, owed, sides and look of an event's number."""
    return how & 7, ((how >> 3) & 3) - 1, (how >> 5) & 7, how >> 8


@helper
def inserts_here(s: Record) -> bool:
    """Return whether the design inserts in the state of the encoder."""
    return bool(s.one_state == 0 or s.ab_in == 0)


@helper
def may_come(s: Record, m: Record, kind: int) -> bool:
    """Return whether an event can come now: edges by the axis, the box's own where it is due.

    What the PC asks for makes a difference where the box waits for it: to begin, or to drop what it has planned.
    """
    if kind == FIRE:
        return bool(s.next_ps <= NOW_PS)
    if kind == WAIT:
        return bool(s.next_ps > NOW_PS)
    if kind == REQUEST:
        idle = s.phase == IDLE and inserts_here(s)
        return bool(idle or (s.phase == ARMED and s.recognised_ps >= NOW_PS))
    if m.motion == STANDING or kind - 1 == m.direction:
        return bool(m.since >= m.least_same[m.motion])
    return bool(m.since >= m.least_turn[FIRST if m.fresh == 1 else m.motion])


@helper
def least_owed(s: Record, kind: int) -> int:
    """Return the least of what may be owed at an event, as a sign: 0 where the box does not look, or knows."""
    if kind == FIRE:
        return -1 if s.phase == ARMED else 0
    if s.phase == ARMED:  # an edge: it was planned for something; or the PC takes it back
        return 0 if kind == REQUEST else 1
    return 1 if kind == REQUEST else 0


@helper
def most_owed(s: Record, kind: int) -> int:
    """Return the most of it."""
    if kind == REQUEST or (kind != FIRE and s.phase == ARMED):
        return least_owed(s, kind)
    if kind == FIRE:
        books = s.phase != INSERTING or s.done + 1 == s.changes
        return 1 if books and s.phase != SAMPLING else 0
    return 1 if s.phase == IDLE and not inserts_here(s) else 0


@helper
def timed_ps(s: Record, now_ps: int, ab: int) -> int:
    """Return the interval that the speed gate will measure at an edge to some levels; -1 for none."""
    apart_ps = now_ps - s.edge_before_ps
    measures = s.gate_ps > 0 and (s.one_state == 0 or ab == 0)
    return apart_ps if measures and apart_ps < UNTIMED_PS else -1


@helper
def level_after(s: Record, move: int) -> int:
    """Return the encoder's levels after an edge."""
    return level_of_state((state_of_level(s.ab_in) + move) & 3)


@helper
def equal_sides(s: Record, m: Record, kind: int) -> int:
    """Return the comparisons of an edge now that have equal sides, or may have, their times rounded to the grid."""
    if kind != UP and kind != DOWN:
        return 0
    found = 0
    apart_ps = timed_ps(s, NOW_PS, level_after(s, kind - 1))
    if apart_ps >= 0 and abs(apart_ps - s.gate_ps) < m.grid_ps:
        found |= AT_GATE
    if s.ready_ps == NOW_PS:
        found |= AT_READY
    if s.phase == ARMED and s.recognised_ps == NOW_PS:
        found |= AT_RECOGNISED
    return found


@helper
def take_edge(s: Record, m: Record, move: int, sides: int) -> None:
    """Let the axis move, and the box see it, on the other side of some comparisons."""
    level = level_after(s, move)
    apart_ps = timed_ps(s, NOW_PS, level)
    if apart_ps >= 0 and abs(apart_ps - s.gate_ps) < m.grid_ps:
        s.edge_before_ps = NOW_PS - s.gate_ps + (1 if sides & AT_GATE else 0)
    if sides & AT_READY:
        s.ready_ps += 1
    if sides & AT_RECOGNISED:
        s.recognised_ps -= 1
    injector_edge(s, NOW_PS, level)
    m.fresh = 1 if m.motion == STANDING else 0
    if m.fresh == 0 and move != m.direction:
        m.motion = TURNED
    else:
        m.motion = MOVING
        for k in range(MOVING + 1, m.classes):
            if m.since >= m.begins[k]:
                m.motion = k
    m.direction = move
    m.since = 0


@helper
def wait(m: Record) -> int:
    """Let one point of the grid pass; return what that breaks."""
    m.looked = (m.looked + 1) % m.looks
    m.since = min(m.since + 1, m.longest)
    if m.off != 0:
        m.off_for += 1
    if m.out_line != 0:
        m.out_since += 1
        if m.out_since >= m.separation:
            m.out_line = 0
            m.out_since = 0
    return TOO_LATE if m.off_for > m.delay else KEPT


@helper
def count_both(s: Record, m: Record, before_in: int, before_out: int) -> int:
    """Count the changes of an event on both sides; return what they break."""
    out = count_delta(before_out, s.ab_out)
    if out == ILLEGAL:
        return ILLEGAL_CHANGE
    m.off += out - count_delta(before_in, s.ab_in) - m.step_counts * m.booked
    if m.off == 0:
        m.off_for = 0
    if out != 0:
        line = before_out ^ s.ab_out
        if m.out_line != 0 and line != m.out_line and m.out_since < m.separation:
            return TOO_CLOSE
        m.out_line = line
        m.out_since = 0
    if abs(m.off) > MOST_OFF:
        return WRONG_COUNT
    if s.phase == IDLE and s.next_ps >= NEVER:  # nothing is under way
        if m.off != 0:
            return WRONG_COUNT
        if s.requested != s.completed and inserts_here(s):
            return UNFINISHED
    return KEPT


@helper
def carry_out(s: Record, m: Record, kind: int, owed: int, sides: int, look: int) -> int:
    """Let an event happen, and write the state behind it down; return what it breaks.

    ``owed`` is the sign of what is asked for and not inserted, once an insertion that ends now is booked. A look of a
    polling processor that falls on this point comes a little later, or, for a ``look`` of 1, a little sooner.
    """
    m.booked = 0
    if kind == WAIT:
        broken = wait(m)
        pack(s, m, NOW_PS + m.grid_ps)
        return broken
    before_in, before_out = s.ab_in, s.ab_out
    s.requested = owed + (s.sign if s.phase == INSERTING else 0)
    if s.poll_ps > 0:
        s.poll_offset_ps = (NOW_PS - m.looked * m.grid_ps + (1 if look == 0 else -1)) % s.poll_ps
    if kind == FIRE:
        injector_fire(s)
    elif kind == REQUEST:
        injector_request(s, NOW_PS, owed)
    else:
        take_edge(s, m, kind - 1, sides)
    m.booked = s.completed
    broken = count_both(s, m, before_in, before_out)
    pack(s, m, NOW_PS)
    return broken


@kernel
def follow(first: int, second: int, how: int, s: Record, m: Record) -> int:
    """Let an event happen in a state; return what it breaks."""
    unpack(first, second, s, m)
    return carry_out(s, m, how & 7, ((how >> 3) & 3) - 1, (how >> 5) & 7, how >> 8)


@kernel
def begin(s: Record, m: Record, looked: int) -> None:
    """Write the state at power-up down, so long after a look."""
    m.looked = looked
    s.last_edge_ps = NOW_PS  # as `BuiltIn`: a rest counts only once it was seen
    pack(s, m, NOW_PS)
