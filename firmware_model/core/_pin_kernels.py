"""Compiled pins: levels, their edges as timers and interrupts see them, and changes queued from outside.

Nothing here is stepped. `refresh` brings timers, serial port and requests from the cycle of the last look to the
present, whatever the time between. Cycle numbers count completed cycles: an event in cycle k (the first is 0) has the
time k + 1.

Sections named are those of the MCS-51 User's Manual (1994), chapter 3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firmware_model._jit import step
from firmware_model.core import _layout as at
from firmware_model.core._request_kernels import Bytes, Hidden, Log, byte, request
from firmware_model.core._timer_kernels import advance, count, count_timer_2, on, ticks_of, timer_1_overflowed


@step
def unwatched(m: Bytes, timer: int, pin: int) -> int:
    """Return the bit of the pin T0 or T1 where the timer does not count its edges."""
    return 0 if m[at.TMOD] & (4 << (4 * timer)) != 0 else pin


@step
def inputs_of_port_3(m: Bytes) -> int:
    """Return the pins of port 3 whose change cannot wait until somebody reads: interrupts, gates, counters."""
    mode, enabled = byte(m, at.TMOD), byte(m, at.IE)
    watched = (mode & 8) >> 1 | (mode & 0x80) >> 4 | (mode & 4) << 2 | (mode & 0x40) >> 1
    if enabled & 0x80 != 0:
        watched |= (enabled & 1) << 2 | (enabled & 4) << 1
    return watched


@step
def sample_timer_2(m: Bytes, h: Hidden, log: Log, fell: int, cycle: int) -> None:
    """Let timer 2 see which of its inputs T2 and T2EX fell."""
    control = byte(m, at.T2CON)
    if fell & 0x100 != 0 and control & 0x06 == 0x06:
        count_timer_2(m, h, log, 1, cycle - 1, 1, 1)
    if fell & 0x200 != 0 and control & 0x08 != 0:
        if control & 0x30 == 0:
            if control & 1 != 0:
                m[at.RCAP2L], m[at.RCAP2H] = m[at.TL2], m[at.TH2]
            else:
                m[at.TL2], m[at.TH2] = m[at.RCAP2L], m[at.RCAP2H]
        request(m, h, at.T2CON, 0x40, at.TIMER_2, cycle)


@step
def sample(m: Bytes, h: Hidden, log: Log, now: int) -> None:
    """Let the inputs see the levels that have stood for a cycle: edges of INT0, INT1, T0, T1, T2, T2EX."""
    if h[at.SEEN] == h[at.LEVELS] or now <= h[at.LEVELS_AT]:
        return
    fell = h[at.SEEN] & ~h[at.LEVELS]
    h[at.SEEN] = h[at.LEVELS]
    cycle = h[at.LEVELS_AT] + 1
    # with the edge bit IT0 or IT1 clear the flag follows the level instead, in `levels_request`
    if fell & 0x04 != 0 and m[at.TCON] & 1 != 0:
        request(m, h, at.TCON, 2, at.EXTERNAL_0, cycle)
    if fell & 0x08 != 0 and m[at.TCON] & 4 != 0:
        request(m, h, at.TCON, 8, at.EXTERNAL_1, cycle)
    tick = ticks_of(h, cycle + h[at.TICK] - 1)
    if fell & 0x10 != 0 and m[at.TMOD] & 4 != 0 and on(m, h, 0):
        n, _, _ = count(m, 0, 1)
        if n > 0:
            request(m, h, at.TCON, 0x20, at.TIMER_0, cycle)
    if fell & 0x20 != 0 and m[at.TMOD] & 0x40 != 0 and on(m, h, 1):
        n, _, _ = count(m, 1, 1)
        if n > 0:
            timer_1_overflowed(m, h, log, n, tick, 1)
    if h[at.HAS_TIMER2] != 0:
        sample_timer_2(m, h, log, fell, cycle)


@step
def levels_request(m: Bytes, h: Hidden, now: int) -> None:
    """Let IE0 and IE1 follow the inverted pin where they are level-activated ("External Interrupts")."""
    for i in range(2):
        if m[at.TCON] & (1 << (2 * i)) == 0:
            flag = 2 << (2 * i)
            if h[at.SEEN] & (4 << i) != 0:
                if m[at.TCON] & flag != 0:
                    m[at.TCON] &= 255 - flag
                    h[at.DROPPED + i] = h[at.LEVELS_AT] + 1
            else:
                cycle = min(now, h[at.LEVELS_AT] + 1)
                request(m, h, at.TCON, flag, 2 * i, cycle)


@step
def relevel(m: Bytes, h: Hidden, log: Log, now: int) -> None:
    """Take note of the levels at P1 and P3 from ``now`` on, after a latch or a pin has changed."""
    levels = (byte(m, at.P3) & byte(m, at.PINS + 3)) & 0x3C
    # what a timer does not look at makes no edge of what it did meanwhile
    unseen = unwatched(m, 0, 0x10) | unwatched(m, 1, 0x20)
    if h[at.HAS_TIMER2] != 0:
        levels |= (byte(m, at.P1) & byte(m, at.PINS + 1) & 3) << 8
        if m[at.T2CON] & 0x0A == 0:
            unseen |= 0x300
    h[at.LEVELS] = (h[at.LEVELS] & ~unseen) | (levels & unseen)
    h[at.SEEN] = (h[at.SEEN] & ~unseen) | (levels & unseen)
    if levels != h[at.LEVELS]:
        sample(m, h, log, now)
        levels_request(m, h, now)
        advance(m, h, log, now)  # a gated timer has counted with the level until now
        h[at.LEVELS] = levels
        h[at.LEVELS_AT] = now
        h[at.QUIET] = 0


@step
def refresh(m: Bytes, h: Hidden, log: Log, now: int) -> None:
    """Bring every flag and counter to the boundary ``now`` between two instructions."""
    sample(m, h, log, now)
    advance(m, h, log, now)
    levels_request(m, h, now)


@step
def move_pins(m: Bytes, h: Hidden, log: Log, changes: NDArray[np.int64], now: int) -> None:
    """Apply the changes of pins that are sampled in a cycle up to ``now``: rows of cycle, port, levels."""
    i = h[at.CHANGE]
    while i < h[at.CHANGES] and changes[i, 0] <= now:
        m[at.PINS + (changes[i, 1] & 3)] = changes[i, 2]
        relevel(m, h, log, changes[i, 0])
        i += 1
    h[at.CHANGE] = i


@step
def set_pins(m: Bytes, h: Hidden, log: Log, port: int, levels: int, cycle: int) -> None:
    """Set the pins of a port, sampled from ``cycle`` on; for a driver that runs the loop between changes."""
    m[at.PINS + port] = levels
    relevel(m, h, log, cycle)
    if h[at.SEEN] != h[at.LEVELS]:
        h[at.OTHERS] = min(h[at.OTHERS], h[at.LEVELS_AT] + 1)
        h[at.DUE] = min(h[at.DUE], h[at.OTHERS])


@step
def pins_alone(m: Bytes, h: Hidden, log: Log, changes: NDArray[np.int64], now: int) -> bool:
    """Apply changes of pins that nothing but the program looks at; False where `attend` is needed."""
    i = h[at.CHANGE]
    n = h[at.CHANGES]
    # a write has set DUE to 0 where it may have changed more than pins
    if h[at.DUE] == 0 or now >= h[at.OTHERS]:
        return False
    due = min(h[at.OTHERS], h[at.END])
    while i < n:
        if changes[i, 0] > now:
            due = min(due, changes[i, 0])
            break
        port = changes[i, 1] & 3
        if (byte(m, at.PINS + port) ^ changes[i, 2]) & h[at.INPUTS + port] != 0:
            break
        m[at.PINS + port] = changes[i, 2]
        if port == 3:  # INT0 and INT1 keep their edges until their flags are read
            levels = (h[at.LEVELS] & ~0x0C) | (byte(m, at.P3) & changes[i, 2] & 0x0C)
            if levels != h[at.LEVELS]:
                sample(m, h, log, changes[i, 0])
                levels_request(m, h, changes[i, 0])
                h[at.LEVELS] = levels
                h[at.LEVELS_AT] = changes[i, 0]
                h[at.QUIET] = 0
        i += 1
    h[at.CHANGE] = i
    if i < n and changes[i, 0] <= now:
        return False
    h[at.DUE] = due
    return True
