"""Compiled timers 0, 1 and 2: any time between two looks is counted in one calculation.

Sections named are those of the MCS-51 User's Manual (1994), chapter 3.
"""

from __future__ import annotations

from firmware_model._jit import step
from firmware_model.core import _layout as at
from firmware_model.core._request_kernels import Bytes, Hidden, Log, byte, request
from firmware_model.core._serial_kernels import baud_timer, clock_serial, cycle_of, received, sent


@step
def ticks_of(h: Hidden, cycle: int) -> int:
    """Return the increments of a timer up to ``cycle``: one a cycle, or one every twelve."""
    return int(
        cycle if h[at.TICK] == 1 else cycle // 12
    )  # a division by what is not constant costs ten times as much


@step
def rolled(value: int, ticks: int, size: int, reload: int) -> tuple[int, int, int, int]:
    """Return the count after ``ticks``, how often it overflowed, the tick of the first overflow, and their period."""
    first = size - value
    period = size - reload
    if ticks < first:
        return value + ticks, 0, first, period
    beyond = ticks - first
    return reload + beyond % period, 1 + beyond // period, first, period


@step
def mode_of(m: Bytes, timer: int) -> int:
    """Return mode 0..3 of timer 0 or 1."""
    return (byte(m, at.TMOD) >> (4 * timer)) & 3


@step
def on(m: Bytes, h: Hidden, timer: int) -> bool:
    """Tell whether timer 0 or 1 is let to count ("Timer 0 and Timer 1", figures 7 to 10)."""
    if timer == 1:
        if mode_of(m, 1) == 3:
            return False
        if mode_of(m, 0) == 3:
            return True  # timer 0 has taken TR1; timer 1 is stopped by its own mode 3 alone
    control = byte(m, at.TMOD) >> (4 * timer)
    if m[at.TCON] & (0x10 << (2 * timer)) == 0:
        return False
    return control & 8 == 0 or h[at.LEVELS] & (4 << timer) != 0


@step
def count(m: Bytes, timer: int, ticks: int) -> tuple[int, int, int]:
    """Count timer 0 (its lower half in mode 3) or 1; return overflows, tick of the first, period."""
    mode = mode_of(m, timer)
    low, high = at.TL0 + timer, at.TH0 + timer
    if mode == 0:
        value, n, first, period = rolled((byte(m, high) << 5) | (byte(m, low) & 31), ticks, 8192, 0)
        m[low] = (m[low] & 0xE0) | (value & 31)
        m[high] = value >> 5
    elif mode == 1:
        value, n, first, period = rolled((byte(m, high) << 8) | byte(m, low), ticks, 65536, 0)
        m[low] = value & 255
        m[high] = value >> 8
    elif mode == 2:
        value, n, first, period = rolled(byte(m, low), ticks, 256, byte(m, high))
        m[low] = value
    else:
        value, n, first, period = rolled(byte(m, low), ticks, 256, 0)
        m[low] = value
    return n, first, period


@step
def timer_1_overflowed(m: Bytes, h: Hidden, log: Log, n: int, first: int, period: int) -> None:
    """Set TF1, which timer 0 owns in its mode 3, and clock the serial port."""
    if mode_of(m, 0) != 3:
        request(m, h, at.TCON, 0x80, at.TIMER_1, first * h[at.TICK])
    h[at.OVERFLOWS_1] += n
    clock_serial(m, h, log, 1, n, first, period, 1, h[at.TICK])


@step
def timer_2_rate(m: Bytes, h: Hidden) -> tuple[int, int]:
    """Return ticks and the cycles they take: half the oscillator as a baud-rate generator, a twelfth else."""
    if m[at.T2CON] & 0x30 != 0:
        # twelve clocks are one cycle of the original, twelve cycles of the one-clock part
        return (6, 1) if h[at.TICK] == 1 else (1, 2)
    return 1, h[at.TICK]


@step
def count_timer_2(m: Bytes, h: Hidden, log: Log, ticks: int, before: int, num: int, den: int) -> None:
    """Count timer 2 ("Timer 2"): capture, auto-reload or baud-rate generator; ``before`` ticks had passed."""
    control = byte(m, at.T2CON)
    capture = control & 0x31 == 1
    reload = 0 if capture else (byte(m, at.RCAP2H) << 8) | byte(m, at.RCAP2L)
    value, n, first, period = rolled((byte(m, at.TH2) << 8) | byte(m, at.TL2), ticks, 65536, reload)
    m[at.TL2] = value & 255
    m[at.TH2] = value >> 8
    if n > 0:
        if control & 0x30 == 0:
            # TF2 is set in S2P2 and polled in the cycle of the overflow itself, one earlier than TF0 and TF1
            request(m, h, at.T2CON, 0x80, at.TIMER_2, cycle_of(before + first, num, den) - h[at.RECOGNISE])
        h[at.OVERFLOWS_2] += n
        clock_serial(m, h, log, 2, n, before + first, period, num, den)


@step
def count_timers_0_and_1(m: Bytes, h: Hidden, log: Log, before: int, ticks: int) -> None:
    """Count timers 0 and 1 by the clock; in mode 3 timer 0 is two, and the second has timer 1's flag."""
    if m[at.TMOD] & 4 == 0 and on(m, h, 0):
        n, first, period = count(m, 0, ticks)
        if n > 0:
            request(m, h, at.TCON, 0x20, at.TIMER_0, (before + first) * h[at.TICK])
    if mode_of(m, 0) == 3 and m[at.TCON] & 0x40 != 0:
        value, n, first, period = rolled(byte(m, at.TH0), ticks, 256, 0)
        m[at.TH0] = value
        if n > 0:
            request(m, h, at.TCON, 0x80, at.TIMER_1, (before + first) * h[at.TICK])
    if m[at.TMOD] & 0x40 == 0 and on(m, h, 1):
        n, first, period = count(m, 1, ticks)
        if n > 0:
            timer_1_overflowed(m, h, log, n, before + first, period)


@step
def advance(m: Bytes, h: Hidden, log: Log, now: int) -> None:
    """Count the timers and shift the serial port up to ``now``."""
    since = h[at.SYNCED]
    if now <= since:
        return
    h[at.SYNCED] = now
    before = ticks_of(h, since)
    ticks = ticks_of(h, now) - before
    if ticks > 0:
        count_timers_0_and_1(m, h, log, before, ticks)
    if h[at.HAS_TIMER2] != 0 and m[at.T2CON] & 0x06 == 0x04:
        num, den = timer_2_rate(m, h)
        before = since * num // den
        ticks = now * num // den - before
        if ticks > 0:
            count_timer_2(m, h, log, ticks, before, num, den)
    if now >= h[at.SEND_AT]:
        sent(m, h, log, h[at.SEND_AT])
    if now >= h[at.RECEIVE_AT]:
        received(m, h, h[at.RECEIVE_AT])


@step
def until_overflow(m: Bytes, timer: int) -> int:
    """Return the ticks until timer 0 or 1 overflows."""
    mode = mode_of(m, timer)
    low, high = byte(m, at.TL0 + timer), byte(m, at.TH0 + timer)
    if mode == 0:
        return 8192 - ((high << 5) | (low & 31))
    return 65536 - ((high << 8) | low) if mode == 1 else 256 - low


@step
def overflow_cycle(m: Bytes, h: Hidden, timer: int, n: int) -> int:
    """Return the cycle of the n-th overflow of a timer from now, NEVER where it does not run by itself."""
    if timer == 2:
        if m[at.T2CON] & 0x06 != 0x04:
            return at.NEVER
        num, den = timer_2_rate(m, h)
        reload = (byte(m, at.RCAP2H) << 8) | byte(m, at.RCAP2L)
        first = h[at.SYNCED] * num // den + 65536 - ((byte(m, at.TH2) << 8) | byte(m, at.TL2))
        return cycle_of(first + (n - 1) * (65536 - reload), num, den)
    if m[at.TMOD] & 0x40 != 0 or not on(m, h, 1):
        return at.NEVER
    mode = mode_of(m, 1)
    period = 8192 if mode == 0 else 65536 if mode == 1 else 256 - byte(m, at.TH1)
    return int((ticks_of(h, h[at.SYNCED]) + until_overflow(m, 1) + (n - 1) * period) * h[at.TICK])


@step
def next_serial_request(m: Bytes, h: Hidden) -> int:
    """Return the earliest cycle at which the serial port will set one of its flags."""
    due = min(h[at.SEND_AT], h[at.RECEIVE_AT])
    if h[at.SEND_LEFT] > 0:
        due = min(due, overflow_cycle(m, h, baud_timer(m, h, 0x10), h[at.SEND_LEFT]))
    if h[at.RECEIVE_LEFT] > 0:
        due = min(due, overflow_cycle(m, h, baud_timer(m, h, 0x20), h[at.RECEIVE_LEFT]))
    return due


@step
def next_timer_request(m: Bytes, h: Hidden, enabled: int) -> int:
    """Return the earliest cycle at which a timer or the serial port will set the flag of an ``enabled`` interrupt."""
    due = at.NEVER
    if enabled & 0x80 == 0:
        return due
    tick = h[at.TICK]
    base = ticks_of(h, h[at.SYNCED])
    split = mode_of(m, 0) == 3
    if enabled & 2 != 0 and m[at.TMOD] & 4 == 0 and m[at.TCON] & 0x20 == 0 and on(m, h, 0):
        due = min(due, (base + until_overflow(m, 0)) * tick)
    if enabled & 8 != 0 and m[at.TCON] & 0x80 == 0:
        if split:
            if m[at.TCON] & 0x40 != 0:
                due = min(due, (base + 256 - byte(m, at.TH0)) * tick)
        elif m[at.TMOD] & 0x40 == 0 and on(m, h, 1):
            due = min(due, (base + until_overflow(m, 1)) * tick)
    if h[at.HAS_TIMER2] != 0 and enabled & 0x20 != 0 and m[at.T2CON] & 0xB6 == 0x04:
        due = min(due, (base + 65536 - ((byte(m, at.TH2) << 8) | byte(m, at.TL2))) * tick)
    if enabled & 0x10 != 0:
        due = min(due, next_serial_request(m, h))
    return due
