"""Compiled look at loops that wait: whole turns that would change nothing are counted instead of executed."""

from __future__ import annotations

from firmware_model._jit import helper
from firmware_model.core import _layout as at
from firmware_model.core._request_kernels import Bytes, Hidden
from firmware_model.core._timer_kernels import next_timer_request

TURNS_BEFORE, TURNS_BETWEEN = 8, 64
"""Turns of a loop before it is looked at as one that waits, and before the next look at one that does more."""


@helper
def keep_turn(m: Bytes, h: Hidden, cycles: int, executed: int) -> None:
    """Take a snapshot at the end of one turn of a loop."""
    for i in range(512):
        m[at.SNAPSHOT + i] = m[i]
    h[at.TURN_CYCLES], h[at.TURN_COUNT] = cycles, executed
    h[at.TOUCHED] = 0


@helper
def turns_to_skip(m: Bytes, h: Hidden, cycles: int) -> int:
    """Return how many more turns a loop would make like the one since the snapshot; 0 where it did something.

    A loop that has changed nothing in a turn, all of whose inputs stand still, changes nothing in the next. Counts
    of timers do not count: who reads them touches. Flags do; the next one to be set ends the waiting.
    """
    if h[at.TOUCHED] != 0:
        return 0
    differ = 0
    for i in range(at.TL0):
        differ |= m[i] ^ m[at.SNAPSHOT + i]
    for i in range(at.TH1 + 1, at.TL2):
        differ |= m[i] ^ m[at.SNAPSHOT + i]
    for i in range(at.TH2 + 1, 512):
        differ |= m[i] ^ m[at.SNAPSHOT + i]
    if differ != 0:
        return 0
    limit = min(h[at.DUE], next_timer_request(m, h, 0xBF))
    return max(int((limit - cycles) // (cycles - h[at.TURN_CYCLES])), 0)
