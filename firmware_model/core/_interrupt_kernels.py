"""Compiled interrupts: which request wins, the hardware's call, idle mode, and when to look up next.

`attend` is called at the cycles where an interrupt could come, never between them.

Sections named are those of the MCS-51 User's Manual (1994), chapter 3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firmware_model._jit import helper, step
from firmware_model.core._layout import (
    CALL,
    CHANGE,
    CHANGES,
    DROPPED,
    DUE,
    END,
    EXTERNAL_0,
    EXTERNAL_1,
    FAULT,
    FAULT_STACK,
    HAS_TIMER2,
    HOLD,
    IE,
    INPUTS,
    IP,
    LEVELS,
    LEVELS_AT,
    OTHERS,
    PC,
    PCON,
    QUIET,
    RECOGNISE,
    SCON,
    SEEN,
    SERVING,
    SP,
    STAMP,
    STOP,
    STOP_FAULT,
    T2CON,
    TCON,
    TIMER_0,
    TIMER_1,
    TOP,
)  # fmt: skip
from firmware_model.core._pin_kernels import inputs_of_port_3, move_pins, refresh, relevel
from firmware_model.core._request_kernels import Bytes, Hidden, Log, byte
from firmware_model.core._timer_kernels import next_timer_request


@helper
def pending(m: Bytes, h: Hidden) -> int:
    """Return the requests that are set and enabled, one bit a source in polling order ("Interrupts")."""
    enabled = byte(m, IE)
    if enabled & 0x80 == 0:
        return 0
    flags = byte(m, TCON)
    asked = ((flags >> 1) & 1) | ((flags >> 4) & 2) | ((flags >> 1) & 4) | ((flags >> 4) & 8)
    if m[SCON] & 3 != 0:
        asked |= 0x10
    if h[HAS_TIMER2] != 0 and m[T2CON] & 0xC0 != 0:
        asked |= 0x20
    return asked & enabled & 0x3F


@helper
def polled(m: Bytes, h: Hidden, now: int) -> int:
    """Return `pending` with the levels that were there a cycle ago, which is when the samples polled were taken."""
    asked = pending(m, h)
    enabled = byte(m, IE)
    if h[RECOGNISE] != 0 and enabled & 0x80 != 0:
        for i in range(2):
            if h[DROPPED + i] == now and m[TCON] & (1 << (2 * i)) == 0:
                asked |= enabled & (1 << (2 * i))
    return asked


@helper
def acknowledge(m: Bytes, source: int) -> None:
    """Clear the flag of a request as the hardware does: edges and timers 0 and 1, nothing else."""
    if source == EXTERNAL_0:
        if m[TCON] & 1 != 0:
            m[TCON] &= 0xFD
    elif source == EXTERNAL_1:
        if m[TCON] & 4 != 0:
            m[TCON] &= 0xF7
    elif source == TIMER_0:
        m[TCON] &= 0xDF
    elif source == TIMER_1:
        m[TCON] &= 0x7F


@helper
def call(m: Bytes, h: Hidden, target: int) -> bool:
    """Push the program counter and go to ``target``; False where the stack has no room."""
    sp = byte(m, SP)
    if sp + 2 > h[TOP]:
        return False
    m[sp + 1] = h[PC] & 255
    m[sp + 2] = h[PC] >> 8
    m[SP] = sp + 2
    h[PC] = target
    return True


@helper
def take_interrupt(m: Bytes, h: Hidden, asked: int, now: int) -> int:
    """Call the routine of the request that wins, if any may; return the cycle after the call, or ``now``."""
    for level in (1, 0):
        if h[SERVING] >> level != 0:
            return now
        for source in range(6):
            bit = 1 << source
            if asked & bit == 0 or (byte(m, IP) >> source) & 1 != level:
                continue
            if now < h[STAMP + source] + h[RECOGNISE]:
                continue
            if not call(m, h, 8 * source + 3):
                h[FAULT] = FAULT_STACK
                h[STOP] = STOP_FAULT
                return now
            acknowledge(m, source)
            h[SERVING] |= 1 << level
            m[PCON] &= 0xFE
            return int(now + h[CALL])
    return now


@step
def until(h: Hidden, changes: NDArray[np.int64], cycle: int) -> None:
    """Set the end of a run that goes on where the last one ended, perhaps with other changes of pins in the queue."""
    h[END] = cycle
    if h[DUE] != 0:
        h[DUE] = min(h[OTHERS], cycle)
        if h[CHANGE] < h[CHANGES]:
            h[DUE] = min(h[DUE], changes[h[CHANGE], 0])


@step
def first_ripe(h: Hidden, asked: int, now: int, due: int) -> int:
    """Return when the first of the sources that ask is recognised, if that is after ``now`` and before ``due``."""
    for source in range(6):
        if asked & (1 << source) != 0:
            ripe = h[STAMP + source] + h[RECOGNISE]
            if ripe > now:
                due = min(due, ripe)
    return due


@helper
def attend(m: Bytes, h: Hidden, log: Log, changes: NDArray[np.int64], now: int) -> int:
    """Look up at the boundary ``now``: pins, timers, interrupts, idle; set DUE; return the cycle to go on from."""
    h[QUIET] = 0
    move_pins(m, h, log, changes, now)
    relevel(m, h, log, now)
    refresh(m, h, log, now)
    if h[STOP] != 0:
        return now
    held = h[HOLD]
    h[HOLD] = 0
    asked = polled(m, h, now)
    if asked != 0 and held == 0:
        after = take_interrupt(m, h, asked, now)
        if after != now or h[STOP] != 0:
            h[DUE] = 0
            return after
    due = next_timer_request(m, h, byte(m, IE))
    if h[SEEN] != h[LEVELS]:
        due = min(due, h[LEVELS_AT] + 1)
    if held != 0 and asked != 0:
        due = min(due, now + 1)
    due = first_ripe(h, asked, now, due)
    h[OTHERS] = due
    h[INPUTS + 1] = 3 if h[HAS_TIMER2] != 0 and m[T2CON] & 0x0A != 0 else 0
    h[INPUTS + 3] = inputs_of_port_3(m)
    due = min(due, h[END])
    if h[CHANGE] < h[CHANGES]:
        due = min(due, changes[h[CHANGE], 0])
    if m[PCON] & 1 != 0:
        # idle: no instruction until an interrupt; time goes on to the next cycle at which one could come
        h[DUE] = 0
        return max(due, now + 1) if due > now else now + 1
    h[DUE] = max(due, now + 1)
    return now
