"""Compiled interrupts: which request wins, the hardware's call, idle mode, and when to look up next.

`attend` is called at the cycles where an interrupt could come, never between them.

Sections named are those of the MCS-51 User's Manual (1994), chapter 3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firmware_model._jit import helper, step
from firmware_model.core import _layout as at
from firmware_model.core._pin_kernels import inputs_of_port_3, move_pins, refresh, relevel
from firmware_model.core._request_kernels import Bytes, Hidden, Log, byte
from firmware_model.core._timer_kernels import next_timer_request


@helper
def pending(m: Bytes, h: Hidden) -> int:
    """Return the requests that are set and enabled, one bit a source in polling order ("Interrupts")."""
    enabled = byte(m, at.IE)
    if enabled & 0x80 == 0:
        return 0
    flags = byte(m, at.TCON)
    asked = ((flags >> 1) & 1) | ((flags >> 4) & 2) | ((flags >> 1) & 4) | ((flags >> 4) & 8)
    if m[at.SCON] & 3 != 0:
        asked |= 0x10
    if h[at.HAS_TIMER2] != 0 and m[at.T2CON] & 0xC0 != 0:
        asked |= 0x20
    return asked & enabled & 0x3F


@helper
def polled(m: Bytes, h: Hidden, now: int) -> int:
    """Return `pending` with the levels that were there a cycle ago, which is when the samples polled were taken."""
    asked = pending(m, h)
    enabled = byte(m, at.IE)
    if h[at.RECOGNISE] != 0 and enabled & 0x80 != 0:
        for i in range(2):
            if h[at.DROPPED + i] == now and m[at.TCON] & (1 << (2 * i)) == 0:
                asked |= enabled & (1 << (2 * i))
    return asked


@helper
def acknowledge(m: Bytes, source: int) -> None:
    """Clear the flag of a request as the hardware does: edges and timers 0 and 1, nothing else."""
    if source == at.EXTERNAL_0:
        if m[at.TCON] & 1 != 0:
            m[at.TCON] &= 0xFD
    elif source == at.EXTERNAL_1:
        if m[at.TCON] & 4 != 0:
            m[at.TCON] &= 0xF7
    elif source == at.TIMER_0:
        m[at.TCON] &= 0xDF
    elif source == at.TIMER_1:
        m[at.TCON] &= 0x7F


@helper
def call(m: Bytes, h: Hidden, target: int) -> bool:
    """Push the program counter and go to ``target``; False where the stack has no room."""
    sp = byte(m, at.SP)
    if sp + 2 > h[at.TOP]:
        return False
    m[sp + 1] = h[at.PC] & 255
    m[sp + 2] = h[at.PC] >> 8
    m[at.SP] = sp + 2
    h[at.PC] = target
    return True


@helper
def take_interrupt(m: Bytes, h: Hidden, asked: int, now: int) -> int:
    """Call the routine of the request that wins, if any may; return the cycle after the call, or ``now``."""
    for level in (1, 0):
        if h[at.SERVING] >> level != 0:
            return now
        for source in range(6):
            bit = 1 << source
            if asked & bit == 0 or (byte(m, at.IP) >> source) & 1 != level:
                continue
            if now < h[at.STAMP + source] + h[at.RECOGNISE]:
                continue
            if not call(m, h, 8 * source + 3):
                h[at.FAULT] = at.FAULT_STACK
                h[at.STOP] = at.STOP_FAULT
                return now
            acknowledge(m, source)
            h[at.SERVING] |= 1 << level
            m[at.PCON] &= 0xFE
            return int(now + h[at.CALL])
    return now


@step
def until(h: Hidden, changes: NDArray[np.int64], cycle: int) -> None:
    """Set the end of a run that goes on where the last one ended, perhaps with other changes of pins in the queue."""
    h[at.END] = cycle
    if h[at.DUE] != 0:
        h[at.DUE] = min(h[at.OTHERS], cycle)
        if h[at.CHANGE] < h[at.CHANGES]:
            h[at.DUE] = min(h[at.DUE], changes[h[at.CHANGE], 0])


@step
def first_ripe(h: Hidden, asked: int, now: int, due: int) -> int:
    """Return when the first of the sources that ask is recognised, if that is after ``now`` and before ``due``."""
    for source in range(6):
        if asked & (1 << source) != 0:
            ripe = h[at.STAMP + source] + h[at.RECOGNISE]
            if ripe > now:
                due = min(due, ripe)
    return due


@helper
def attend(m: Bytes, h: Hidden, log: Log, changes: NDArray[np.int64], now: int) -> int:
    """Look up at the boundary ``now``: pins, timers, interrupts, idle; set DUE; return the cycle to go on from."""
    h[at.QUIET] = 0
    move_pins(m, h, log, changes, now)
    relevel(m, h, log, now)
    refresh(m, h, log, now)
    if h[at.STOP] != 0:
        return now
    held = h[at.HOLD]
    h[at.HOLD] = 0
    asked = polled(m, h, now)
    if asked != 0 and held == 0:
        after = take_interrupt(m, h, asked, now)
        if after != now or h[at.STOP] != 0:
            h[at.DUE] = 0
            return after
    due = next_timer_request(m, h, byte(m, at.IE))
    if h[at.SEEN] != h[at.LEVELS]:
        due = min(due, h[at.LEVELS_AT] + 1)
    if held != 0 and asked != 0:
        due = min(due, now + 1)
    due = first_ripe(h, asked, now, due)
    h[at.OTHERS] = due
    h[at.INPUTS + 1] = 3 if h[at.HAS_TIMER2] != 0 and m[at.T2CON] & 0x0A != 0 else 0
    h[at.INPUTS + 3] = inputs_of_port_3(m)
    due = min(due, h[at.END])
    if h[at.CHANGE] < h[at.CHANGES]:
        due = min(due, changes[h[at.CHANGE], 0])
    if m[at.PCON] & 1 != 0:
        # idle: no instruction until an interrupt; time goes on to the next cycle at which one could come
        h[at.DUE] = 0
        return max(due, now + 1) if due > now else now + 1
    h[at.DUE] = max(due, now + 1)
    return now
