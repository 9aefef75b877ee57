"""Compiled breadth-first search: a set of states of two words in the order in which they were found."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper, kernel
from rtec.injector._state_kernels import ARMED, SAMPLING
from rtec.verify.contract.exhaustive._box_instant_kernels import (
    equal_sides,
    instant,
    may_move,
    wait,
)
from rtec.verify.contract.exhaustive._box_state_kernels import pack, unpack

DONE, PAUSED, FULL, BROKEN = 0, 1, 2, 3
"""How a stretch of the search ends."""
MOST_NEW = 20_000
"""Successors of one state, at most; there are some hundreds."""
EMPTY = -1

SEARCH = np.dtype(
    [
        ("found", np.int64),  # states
        ("next", np.int64),  # the first whose successors are not known
        ("made", np.int64),  # successors, with those that were known
        ("broken", np.int64),  # what the last successor breaks
        ("parent", np.int64),  # its state, and how it follows from it
        ("how", np.int64),
        ("wide", np.int64),
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
def place(words: NDArray[np.int64], states: NDArray[np.int64], table: NDArray[np.int32], count: int) -> int:
    """Return the number of a state; of a new one, which is entered, ``count``."""
    mask = table.size - 1
    at = place_of(words[0], words[1], mask)
    while table[at] != EMPTY:
        known = table[at]
        if states[known, 0] == words[0] and states[known, 1] == words[1]:
            return int(known)
        at = (at + 1) & mask
    table[at] = count
    states[count, 0] = words[0]
    states[count, 1] = words[1]
    return count


@kernel
def enter_all(states: NDArray[np.int64], count: int, table: NDArray[np.int32]) -> None:
    """Fill an empty table with states that are all different."""
    mask = table.size - 1
    for k in range(count):
        at = place_of(states[k, 0], states[k, 1], mask)
        while table[at] != EMPTY:
            at = (at + 1) & mask
        table[at] = k


@helper
def code_of(owed: int, move: int, order: int, other_side: int, look: int) -> int:
    """Return one number for what happens at an instant."""
    return (((look * 16 + owed + 8) * 4 + move + 1) * 8 + order) * 16 + other_side


@helper
def is_another(order: int, due: bool, moves: bool, asks: bool) -> bool:
    """Return whether an order differs from those before it, with what there is at this instant."""
    if moves and asks:
        return due or order == 4  # of two, an edge before a request
    if moves:  # without a request: the edge before the box's event
        return due and order == 1
    return asks and due and order == 2


@helper
def enter(
    q: Record,
    states: NDArray[np.int64],
    parents: NDArray[np.int32],
    hows: NDArray[np.int32],
    table: NDArray[np.int32],
    words: NDArray[np.int64],
    s: Record,
    m: Record,
    now_ps: int,
    how: int,
) -> int:
    """Enter the state that an instant ended with; return its number, or -1 where something is broken."""
    q.made += 1
    if q.broken == 0:
        pack(s, m, now_ps, words)
    if q.broken != 0 or m.wide == 1:
        q.parent, q.how, q.wide = q.next, how, m.wide
        return -1
    number = place(words, states, table, q.found)
    if number == q.found:
        parents[number] = q.next
        hows[number] = how
        q.found += 1
    return number


@helper
def branch(
    q: Record,
    states: NDArray[np.int64],
    parents: NDArray[np.int32],
    hows: NDArray[np.int32],
    silent: NDArray[np.int32],
    table: NDArray[np.int32],
    words: NDArray[np.int64],
    s: Record,
    m: Record,
    orders: NDArray[np.int64],
    owed: int,
    move: int,
) -> bool:
    """Enter what follows from the next state by a request and an edge, or none, at every look and in every order."""
    for look in range(m.looks):
        looked = False
        for order in range(orders.shape[0]):
            now_ps = wait(m, unpack(states[q.next], s, m))
            asks = owed != s.requested - s.completed
            due = s.next_ps <= now_ps
            if order > 0 and not is_another(order, due, move != 0, asks):
                continue
            s.poll_offset_ps = (now_ps - look * m.grid_ps) % s.poll_ps if s.poll_ps > 0 else 0
            sides = equal_sides(s, now_ps, move != 0, asks)
            for other_side in range(16):
                if other_side & ~sides:
                    continue
                if other_side > 0:
                    unpack(states[q.next], s, m)
                    wait(m, now_ps)
                how = code_of(owed, move, order, other_side, look)
                q.broken = instant(s, m, now_ps, owed, move, order, other_side, orders)
                number = enter(q, states, parents, hows, table, words, s, m, now_ps, how)
                if number < 0:
                    return False
                if not asks and move == 0 and look == 0:
                    silent[q.next] = number
                looked = looked or s.phase == ARMED or s.phase == SAMPLING
        if not looked:
            break
    return True


@kernel
def search(
    q: Record,
    states: NDArray[np.int64],
    parents: NDArray[np.int32],
    hows: NDArray[np.int32],
    silent: NDArray[np.int32],
    table: NDArray[np.int32],
    words: NDArray[np.int64],
    s: Record,
    m: Record,
    orders: NDArray[np.int64],
    until: int,
) -> int:
    """Find the successors of states up to number ``until``; ``silent`` are those without an input."""
    while q.next < q.found:
        if q.next >= until:
            return PAUSED
        if q.found + MOST_NEW > states.shape[0]:
            return FULL
        for move in range(-1, 2):
            for asked in range(-m.window - 1, m.window + 1):
                wait(m, unpack(states[q.next], s, m))
                if move != 0 and not may_move(m, move):
                    break
                owed = s.requested - s.completed
                if asked >= -m.window:
                    if asked == owed:
                        continue
                    owed = asked
                if not branch(q, states, parents, hows, silent, table, words, s, m, orders, owed, move):
                    return BROKEN
        q.next += 1
    return DONE


@kernel
def follow(
    words: NDArray[np.int64], how: int, s: Record, m: Record, orders: NDArray[np.int64], out: NDArray[np.int64]
) -> int:
    """Carry out one instant from a state, and write the next one down; return what it breaks."""
    now_ps = wait(m, unpack(words, s, m))
    owed, move, look = ((how >> 9) & 15) - 8, ((how >> 7) & 3) - 1, how >> 13
    s.poll_offset_ps = (now_ps - look * m.grid_ps) % s.poll_ps if s.poll_ps > 0 else 0
    broken = instant(s, m, now_ps, owed, move, (how >> 4) & 7, how & 15, orders)
    pack(s, m, now_ps, out)
    return broken
