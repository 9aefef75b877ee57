"""Compiled timing of the firmware: what every design does in a reading of the PC's words and behind an insertion."""

from __future__ import annotations

from rtec._jit import Record, step
from rtec.injector._firmware_pins_kernels import (
    remembered,
)


@step
def count_in_reading(s: Record) -> None:
    """Take the decoder's count."""
    s.delta = s.count - s.read_count
    s.read_count = s.count


@step
def request_in_reading(s: Record) -> None:
    """Take the PC's total, where corrections are allowed, and note what its judgement takes longer."""
    change = s.requested - s.accepted
    if s.enabled == 0:
        s.judging = -9 if s.requested == 0 else -7
        return
    s.accepted = s.requested
    if change == 0:
        s.judging = 0
    elif -3 <= change <= 3:
        s.judging = 17
    else:
        s.judging = 20 if 0 < change <= 252 else 16


@step
def see_owed(s: Record) -> None:
    """Note whether an insertion is owed and of which sign."""
    s.owed = 1 if s.accepted != s.completed and s.enabled == 1 else 0
    if s.enabled == 1:
        s.minus = 1 if s.accepted < s.completed else 0


@step
def end_reading(s: Record, cycle: int) -> int:
    """Look at IE0 and at what was seen since the last reading; return the cycle in which the work begins."""
    fast = s.fast_counts
    s.fast = 1 if s.delta > fast or s.delta < -fast else 0
    s.rest = 0
    if remembered(s, cycle + 1):  # a test that also clears takes the pins of its own first cycle
        s.forgotten = cycle + 1
        s.timed = 0
        settled = cycle + 3
    elif s.moved == 1:
        settled = cycle + 4
    elif s.delta != 0:
        settled = cycle + 8
    else:
        s.rest = 1
        settled = cycle + 11
    s.moved = 0
    return int(settled + 3)


@step
def count_insertion(s: Record, t_ps: int) -> None:
    """Count the insertion whose last change is at ``t_ps``."""
    s.completed += s.sign
    s.inserted += 1
    s.longest_ps = max(s.longest_ps, t_ps - s.trigger_ps)
