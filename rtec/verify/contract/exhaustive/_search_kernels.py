"""Compiled breadth-first search: a set of states of two words in the order in which they were found."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper, kernel
from rtec.injector._state_kernels import ARMED, IDLE, SAMPLING
from rtec.verify.contract.exhaustive._box_event_kernels import (
    DOWN,
    FIRE,
    KEPT,
    REQUEST,
    WAIT,
    carry_out,
    code_of,
    equal_sides,
    least_owed,
    may_come,
    most_owed,
)
from rtec.verify.contract.exhaustive._box_state_kernels import NOW_PS, unpack

DONE, PAUSED, FULL, BROKEN = 0, 1, 2, 3
"""How a stretch of the search ends."""
MOST_NEW = 20_000
"""Successors of one state, at most; there are some hundreds."""
EMPTY = -1

States = NDArray[np.void]
Table = NDArray[np.int32]

STATE = np.dtype([("first", np.int64), ("second", np.int64), ("parent", np.int32), ("how", np.int32)])
"""A state, and how it was found."""
SEARCH = np.dtype(
    [
        ("found", np.int64),  # states
        ("begin", np.int64),  # the first of those at this point of time
        ("end", np.int64),  # behind the last of them, once what can happen at this point is known; else 0
        ("next", np.int64),  # the next of them to be looked at
        ("made", np.int64),  # successors, with those that were known
        ("how", np.int64),  # the last one
        ("broken", np.int64),
    ],
    align=True,
)


@helper
def place_of(a: int, b: int, mask: int) -> int:
    """Return where the search for a state begins in the table."""
    h = a * -7046029254386353131 ^ (b + (a >> 31)) * -4417276706812531889
    h ^= (h >> 29) & 0x7FFFFFFFF
    h *= -4658895280553007687
    h ^= (h >> 32) & 0xFFFFFFFF
    return h & mask


@helper
def place(first: int, second: int, states: States, table: Table) -> int:
    """Return the place of a state in the table, which is empty where it is a new one."""
    mask = table.size - 1
    at = place_of(first, second, mask)
    while table[at] != EMPTY:
        known = states[table[at]]
        if known.first == first and known.second == second:
            break
        at = (at + 1) & mask
    return int(at)


@kernel
def enter_all(states: States, count: int, table: Table) -> None:
    """Fill an empty table with states that are all different."""
    for k in range(count):
        table[place(states[k].first, states[k].second, states, table)] = k


@helper
def enter(q: Record, states: States, table: Table, s: Record, m: Record, kind: int, owed: int, sides: int) -> None:
    """Enter what follows from the next state by an event, with a look of the processor behind it or before it."""
    for look in range(2):
        unpack(states[q.next].first, states[q.next].second, s, m)
        q.broken = carry_out(s, m, kind, owed, sides, look)
        q.how = code_of(kind, owed, sides, look)
        q.made += 1
        if q.broken != KEPT or m.wide == 1:
            return
        at = place(m.first, m.second, states, table)
        if table[at] == EMPTY:
            table[at] = q.found
            new = states[q.found]
            new.first, new.second, new.parent, new.how = m.first, m.second, q.next, q.how
            q.found += 1
        if s.poll_ps == 0 or kind == WAIT or (s.phase != ARMED and s.phase != SAMPLING):
            return


@helper
def expand(q: Record, states: States, table: Table, s: Record, m: Record, kind: int) -> bool:
    """Enter all that follows from the next state by a kind of event; return whether nothing is broken."""
    unpack(states[q.next].first, states[q.next].second, s, m)
    if not may_come(s, m, kind):
        return True
    least, most, equal = least_owed(s, kind), most_owed(s, kind), equal_sides(s, m, kind)
    for owed in range(least, most + 1):
        for sides in range(8):
            if sides & ~equal == 0:
                enter(q, states, table, s, m, kind, owed, sides)
                if q.broken != KEPT or m.wide == 1:
                    return False
    return True


@kernel
def search(q: Record, states: States, table: Table, s: Record, m: Record, most: int) -> int:
    """Find what follows from the next ``most`` states.

    All states at a point of time are found, then those a point later: so the first that is wrong is the nearest.
    """
    for _ in range(most):
        if q.next == (q.end if q.end > 0 else q.found):
            if q.end > 0:
                q.begin, q.end = q.end, 0
            else:
                q.end = q.found
            q.next = q.begin
            if q.begin == q.found:
                return DONE
            continue
        if q.found + MOST_NEW > states.size:
            return FULL
        for kind in range(DOWN, REQUEST + 1):
            if (kind == WAIT) == (q.end > 0) and not expand(q, states, table, s, m, kind):
                return BROKEN
        q.next += 1
    return PAUSED


@kernel
def settle(states: States, count: int, table: Table, s: Record, m: Record, owed: int, after: Table) -> None:
    """Find what each state becomes by itself with so much owed: itself where it rests or books a step."""
    for k in range(count):
        after[k] = k
        unpack(states[k].first, states[k].second, s, m)
        if s.phase == IDLE or (owed == 0 and s.phase == ARMED and s.recognised_ps >= NOW_PS):
            continue  # it rests; or what is planned would not be if so much were owed
        kind = FIRE if may_come(s, m, FIRE) else WAIT
        carry_out(s, m, kind, owed if least_owed(s, kind) < 0 else min(abs(owed), most_owed(s, kind)), 0, 0)
        if m.booked == 0:
            after[k] = table[place(m.first, m.second, states, table)]
