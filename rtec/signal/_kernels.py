"""Compiled parts of the room: the Gray-code steps that every stage calls, and the merging of signals.

A level code is ``ab = A + 2 * B``. An angle state is ``s`` = 0..3, the report's states 1..4: 00, 10, 11, 01, written
"A B". Times are int64 picoseconds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import kernel, step

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


@kernel
def merge(
    times_a_ps: NDArray[np.int64],
    times_b_ps: NDArray[np.int64],
    before_ps: int,
    level_a: int,
    level_b: int,
    level_out: int,
    table: NDArray[np.uint8],
    out_times_ps: NDArray[np.int64],
    out_levels: NDArray[np.uint8],
) -> tuple[int, int, int, int, int, int]:
    """Merge the toggles of two lines earlier than ``before_ps`` (at most NEVER) through a table of four output codes.

    ``table[a + 2 * b]`` is the code that the output takes. Toggles at one time are applied together. Returns the
    toggles used of a and of b, the changes written, and the levels of a, b and the output at the end.
    """
    n_a, n_b = times_a_ps.size, times_b_ps.size
    i = 0
    j = 0
    n = 0
    while True:
        t_a = times_a_ps[i] if i < n_a else NEVER
        t_b = times_b_ps[j] if j < n_b else NEVER
        t = min(t_a, t_b)
        if t >= before_ps:
            break
        if t_a == t:
            level_a ^= 1
            i += 1
        if t_b == t:
            level_b ^= 1
            j += 1
        code = int(table[level_a + 2 * level_b])
        if code != level_out:
            out_times_ps[n] = t
            out_levels[n] = code
            level_out = code
            n += 1
    return i, j, n, level_a, level_b, level_out
