"""Compiled parts of the room: the Gray-code steps that every stage calls.

A level code is ``ab = A + 2 * B``. An angle state is ``s`` = 0..3, the report's states 1..4: 00, 10, 11, 01, written
"A B". Times are int64 picoseconds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import step

NEVER = 2**62
"""The time of an event that does not come, in picoseconds: 53 days, half of the range of int64."""

ILLEGAL = 2
"""What :func:`count_delta` returns where A and B change at once, so that the direction is unknown."""


def _delta_table() -> NDArray[np.int64]:
    """Return the count of each pair of levels, at ``before * 4 + after``, from the order of the states alone."""
    states = np.arange(4)
    levels = states ^ (states >> 1)
    table = np.zeros(16, dtype=np.int64)
    for turn, delta in enumerate((0, 1, ILLEGAL, -1)):
        table[levels * 4 + levels[(states + turn) % 4]] = delta
    table.setflags(write=False)
    return table


DELTA: NDArray[np.int64] = _delta_table()
"""Count of the transition from ``before`` to ``after`` at index ``before * 4 + after``."""


@step
def level_of_state(s: int) -> int:
    """Return the level code of angle state ``s``: the binary-reflected Gray code."""
    return s ^ (s >> 1)


@step
def state_of_level(ab: int) -> int:
    """Return the angle state of level code ``ab``; on two bits the Gray code is its own inverse."""
    return ab ^ (ab >> 1)


@step
def count_delta(before_ab: int, after_ab: int) -> int:
    """Return +1, -1, 0, or ILLEGAL for the transition between two level codes."""
    return ((int(state_of_level(after_ab)) - int(state_of_level(before_ab)) + 1) & 3) - 1


@step
def count_of_one_line(before_ab: int, after_ab: int) -> int:
    """Return +1 or -1 for the transition between two level codes that differ in one line.

    A changes forwards where A and B are the same, B where they differ: where B after it is A before it.
    """
    return 1 - 2 * ((before_ab ^ (after_ab >> 1)) & 1)


@step
def earlier(t_ps: int, times_ps: NDArray[np.int64], i: int) -> int:
    """Return ``t_ps``, or the i-th of some times where there is one and it is earlier."""
    return min(t_ps, times_ps[i]) if i < times_ps.size else t_ps
