"""Compiled peripherals: timers, serial port, pins and interrupts, brought up to date only when somebody looks.

Nothing here is stepped. `refresh` brings everything from the cycle of the last look to the present in one
calculation, whatever the time between; `attend` does so at the cycles where an interrupt could come, and says when to
look next.
Cycle numbers count completed cycles: an event in cycle k (the first is 0) has the time k + 1.

Sections named are those of the MCS-51 User's Manual (1994), chapter 3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firmware_model._jit import helper, kernel, step
from firmware_model.core._layout import (
    ACC,
    CALL,
    CHANGE,
    CHANGES,
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
    LOG_ROOM,
    LOG_SERIAL,
    LOGGED,
    NEVER,
    OTHERS,
    OUTPUT_AT,
    OVERFLOWS_1,
    OVERFLOWS_2,
    P0,
    P1,
    P3,
    PC,
    PCON,
    PINS,
    PSW,
    RCAP2H,
    RCAP2L,
    RECEIVE_AT,
    RECEIVE_BYTE,
    RECEIVE_LEFT,
    RECOGNISE,
    SBUF,
    SCON,
    SEEN,
    SEND_AT,
    SEND_BYTE,
    SEND_LEFT,
    SERIAL,
    SERVING,
    SP,
    STAMP,
    STOP,
    STOP_FAULT,
    STOP_LOG_FULL,
    STOP_OUTPUT,
    STOP_POWER_DOWN,
    STOPPING,
    SYNCED,
    T2CON,
    TCON,
    TH0,
    TH1,
    TH2,
    TICK,
    TIMER_0,
    TIMER_1,
    TIMER_2,
    TL0,
    TL1,
    TL2,
    TMOD,
    TOP,
    TOUCHED,
)  # fmt: skip

Bytes = NDArray[np.uint8]
Hidden = NDArray[np.int64]
Log = NDArray[np.int64]


@helper
def byte(m: Bytes, place: int) -> int:
    """Return a byte as int64: uint8 would stay narrow, and mixed with others become unsigned."""
    return int(np.int64(m[place]))


@helper
def note(h: Hidden, log: Log, cycle: int, what: int, value: int) -> None:
    """Write a row of the log; the loop stops while there is no room."""
    i = h[LOGGED]
    if h[LOG_ROOM] == 0:
        return
    log[i, 0] = cycle
    log[i, 1] = what
    log[i, 2] = value
    h[LOGGED] = i + 1
    # one look can write at most a few rows: what was sent, and the four ports
    if i + 8 >= h[LOG_ROOM]:
        h[STOP] = STOP_LOG_FULL
        h[DUE] = 0


@helper
def request(m: Bytes, h: Hidden, place: int, mask: int, source: int, cycle: int) -> None:
    """Set the flag of an interrupt; the request is as old as its first flag."""
    if m[place] & mask == 0:
        m[place] |= mask
        h[STAMP + source] = cycle


@helper
def rolled(value: int, ticks: int, size: int, reload: int) -> tuple[int, int, int, int]:
    """Return the count after ``ticks``, how often it overflowed, the tick of the first overflow, and their period."""
    first = size - value
    period = size - reload
    if ticks < first:
        return value + ticks, 0, first, period
    beyond = ticks - first
    return reload + beyond % period, 1 + beyond // period, first, period


@helper
def mode_of(m: Bytes, timer: int) -> int:
    """Return mode 0..3 of timer 0 or 1."""
    return (byte(m, TMOD) >> (4 * timer)) & 3


@helper
def on(m: Bytes, h: Hidden, timer: int) -> bool:
    """Tell whether timer 0 or 1 is let to count ("Timer 0 and Timer 1", figures 7 to 10)."""
    if timer == 1:
        if mode_of(m, 1) == 3:
            return False
        if mode_of(m, 0) == 3:
            return True  # timer 0 has taken TR1; timer 1 is stopped by its own mode 3 alone
    control = byte(m, TMOD) >> (4 * timer)
    if m[TCON] & (0x10 << (2 * timer)) == 0:
        return False
    return control & 8 == 0 or h[LEVELS] & (4 << timer) != 0


@helper
def count(m: Bytes, timer: int, ticks: int) -> tuple[int, int, int]:
    """Count timer 0 (its lower half in mode 3) or 1; return overflows, tick of the first, period."""
    mode = mode_of(m, timer)
    low, high = TL0 + timer, TH0 + timer
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


@helper
def sent(m: Bytes, h: Hidden, log: Log, cycle: int) -> None:
    """End a transmission: TI at ``cycle``."""
    h[SEND_LEFT] = 0
    h[SEND_AT] = NEVER
    request(m, h, SCON, 2, SERIAL, cycle)
    note(h, log, cycle, LOG_SERIAL, h[SEND_BYTE])


@helper
def received(m: Bytes, h: Hidden, cycle: int) -> None:
    """End a reception: SBUF, RB8 and RI, where REN, RI and SM2 let them ("More About Mode 1", "2 and 3")."""
    h[RECEIVE_LEFT] = 0
    h[RECEIVE_AT] = NEVER
    control = byte(m, SCON)
    ninth = (h[RECEIVE_BYTE] >> 8) & 1
    if control & 0x01 == 0 and control & 0x10 != 0 and (control & 0x20 == 0 or ninth != 0):
        m[SBUF] = h[RECEIVE_BYTE] & 255
        m[SCON] = (control & 0xFB) | (ninth << 2)
        # RI and TI are one request; the manual gives it no two ages
        request(m, h, SCON, 1, SERIAL, cycle)


@helper
def clock_serial(
    m: Bytes, h: Hidden, log: Log, timer: int, n: int, first: int, period: int, num: int, den: int
) -> None:
    """Pass ``n`` overflows of timer 1 or 2 to the serial port; ``first`` is the absolute tick of the first one."""
    if h[SEND_LEFT] > 0 and baud_timer(m, h, 0x10) == timer:
        if n >= h[SEND_LEFT]:
            sent(m, h, log, cycle_of(first + (h[SEND_LEFT] - 1) * period, num, den))
        else:
            h[SEND_LEFT] -= n
    if h[RECEIVE_LEFT] > 0 and baud_timer(m, h, 0x20) == timer:
        if n >= h[RECEIVE_LEFT]:
            received(m, h, cycle_of(first + (h[RECEIVE_LEFT] - 1) * period, num, den))
        else:
            h[RECEIVE_LEFT] -= n


@helper
def baud_timer(m: Bytes, h: Hidden, mask: int) -> int:
    """Return the timer that clocks sending (mask TCLK 0x10) or receiving (RCLK 0x20)."""
    return 2 if h[HAS_TIMER2] != 0 and m[T2CON] & mask != 0 else 1


@helper
def cycle_of(tick: int, num: int, den: int) -> int:
    """Return the first cycle at which ``tick`` ticks are complete, where ``num`` ticks take ``den`` cycles."""
    return (tick * den + num - 1) // num


@helper
def timer_1_overflowed(m: Bytes, h: Hidden, log: Log, n: int, first: int, period: int) -> None:
    """Set TF1, which timer 0 owns in its mode 3, and clock the serial port."""
    if mode_of(m, 0) != 3:
        request(m, h, TCON, 0x80, TIMER_1, first * h[TICK])
    h[OVERFLOWS_1] += n
    clock_serial(m, h, log, 1, n, first, period, 1, h[TICK])


@helper
def timer_2_rate(m: Bytes, h: Hidden) -> tuple[int, int]:
    """Return ticks and the cycles they take: half the oscillator as a baud-rate generator, a twelfth else."""
    if m[T2CON] & 0x30 != 0:
        # twelve clocks are one cycle of the original, twelve cycles of the one-clock part
        return (6, 1) if h[TICK] == 1 else (1, 2)
    return 1, h[TICK]


@helper
def count_timer_2(m: Bytes, h: Hidden, log: Log, ticks: int, before: int, num: int, den: int) -> None:
    """Count timer 2 ("Timer 2"): capture, auto-reload or baud-rate generator; ``before`` ticks had passed."""
    control = byte(m, T2CON)
    capture = control & 0x31 == 1
    reload = 0 if capture else (byte(m, RCAP2H) << 8) | byte(m, RCAP2L)
    value, n, first, period = rolled((byte(m, TH2) << 8) | byte(m, TL2), ticks, 65536, reload)
    m[TL2] = value & 255
    m[TH2] = value >> 8
    if n > 0:
        if control & 0x30 == 0:
            # TF2 is set in S2P2 and polled in the cycle of the overflow itself, one earlier than TF0 and TF1
            request(m, h, T2CON, 0x80, TIMER_2, cycle_of(before + first, num, den) - h[RECOGNISE])
        h[OVERFLOWS_2] += n
        clock_serial(m, h, log, 2, n, before + first, period, num, den)


@helper
def advance(m: Bytes, h: Hidden, log: Log, now: int) -> None:
    """Count the timers and shift the serial port up to ``now``."""
    since = h[SYNCED]
    if now <= since:
        return
    h[SYNCED] = now
    before = since // h[TICK]
    ticks = now // h[TICK] - before
    if ticks > 0:
        if m[TMOD] & 4 == 0 and on(m, h, 0):
            n, first, period = count(m, 0, ticks)
            if n > 0:
                request(m, h, TCON, 0x20, TIMER_0, (before + first) * h[TICK])
        if mode_of(m, 0) == 3 and m[TCON] & 0x40 != 0:
            value, n, first, period = rolled(byte(m, TH0), ticks, 256, 0)
            m[TH0] = value
            if n > 0:
                request(m, h, TCON, 0x80, TIMER_1, (before + first) * h[TICK])
        if m[TMOD] & 0x40 == 0 and on(m, h, 1):
            n, first, period = count(m, 1, ticks)
            if n > 0:
                timer_1_overflowed(m, h, log, n, before + first, period)
    if h[HAS_TIMER2] != 0 and m[T2CON] & 0x06 == 0x04:
        num, den = timer_2_rate(m, h)
        before = since * num // den
        ticks = now * num // den - before
        if ticks > 0:
            count_timer_2(m, h, log, ticks, before, num, den)
    if now >= h[SEND_AT]:
        sent(m, h, log, h[SEND_AT])
    if now >= h[RECEIVE_AT]:
        received(m, h, h[RECEIVE_AT])


@helper
def sample(m: Bytes, h: Hidden, log: Log, now: int) -> None:
    """Let the inputs see the levels that have stood for a cycle: edges of INT0, INT1, T0, T1, T2, T2EX."""
    if h[SEEN] == h[LEVELS] or now <= h[LEVELS_AT]:
        return
    fell = h[SEEN] & ~h[LEVELS]
    h[SEEN] = h[LEVELS]
    cycle = h[LEVELS_AT] + 1
    # with the edge bit IT0 or IT1 clear the flag follows the level instead, in `levels_request`
    if fell & 0x04 != 0 and m[TCON] & 1 != 0:
        request(m, h, TCON, 2, EXTERNAL_0, cycle)
    if fell & 0x08 != 0 and m[TCON] & 4 != 0:
        request(m, h, TCON, 8, EXTERNAL_1, cycle)
    tick = (cycle + h[TICK] - 1) // h[TICK]
    if fell & 0x10 != 0 and m[TMOD] & 4 != 0 and on(m, h, 0):
        n, _, _ = count(m, 0, 1)
        if n > 0:
            request(m, h, TCON, 0x20, TIMER_0, cycle)
    if fell & 0x20 != 0 and m[TMOD] & 0x40 != 0 and on(m, h, 1):
        n, _, _ = count(m, 1, 1)
        if n > 0:
            timer_1_overflowed(m, h, log, n, tick, 1)
    if h[HAS_TIMER2] != 0:
        control = byte(m, T2CON)
        if fell & 0x100 != 0 and control & 0x06 == 0x06:
            count_timer_2(m, h, log, 1, cycle - 1, 1, 1)
        if fell & 0x200 != 0 and control & 0x08 != 0:
            if control & 0x30 == 0:
                if control & 1 != 0:
                    m[RCAP2L], m[RCAP2H] = m[TL2], m[TH2]
                else:
                    m[TL2], m[TH2] = m[RCAP2L], m[RCAP2H]
            request(m, h, T2CON, 0x40, TIMER_2, cycle)


@step
def unwatched(m: Bytes, timer: int, pin: int) -> int:
    """Return the bit of the pin T0 or T1 where the timer does not count its edges."""
    return 0 if m[TMOD] & (4 << (4 * timer)) != 0 else pin


@step
def inputs_of_port_3(m: Bytes) -> int:
    """Return the pins of port 3 whose change cannot wait until somebody reads: interrupts enabled, gates, counters."""
    mode, enabled = byte(m, TMOD), byte(m, IE)
    watched = (mode & 8) >> 1 | (mode & 0x80) >> 4 | (mode & 4) << 2 | (mode & 0x40) >> 1
    if enabled & 0x80 != 0:
        watched |= (enabled & 1) << 2 | (enabled & 4) << 1
    return watched


@helper
def relevel(m: Bytes, h: Hidden, log: Log, now: int) -> None:
    """Take note of the levels at P1 and P3 from ``now`` on, after a latch or a pin has changed."""
    levels = (byte(m, P3) & byte(m, PINS + 3)) & 0x3C
    # what a timer does not look at makes no edge of what it did meanwhile
    unseen = unwatched(m, 0, 0x10) | unwatched(m, 1, 0x20)
    if h[HAS_TIMER2] != 0:
        levels |= (byte(m, P1) & byte(m, PINS + 1) & 3) << 8
        if m[T2CON] & 0x0A == 0:
            unseen |= 0x300
    h[LEVELS] = (h[LEVELS] & ~unseen) | (levels & unseen)
    h[SEEN] = (h[SEEN] & ~unseen) | (levels & unseen)
    if levels != h[LEVELS]:
        sample(m, h, log, now)
        advance(m, h, log, now)  # a gated timer has counted with the level until now
        h[LEVELS] = levels
        h[LEVELS_AT] = now


@helper
def levels_request(m: Bytes, h: Hidden, now: int) -> None:
    """Let IE0 and IE1 follow the inverted pin where they are level-activated ("External Interrupts")."""
    for i in range(2):
        if m[TCON] & (1 << (2 * i)) == 0:
            flag = 2 << (2 * i)
            if h[SEEN] & (4 << i) != 0:
                m[TCON] &= 255 - flag
            else:
                cycle = min(now, h[LEVELS_AT] + 1)
                request(m, h, TCON, flag, 2 * i, cycle)


@helper
def refresh(m: Bytes, h: Hidden, log: Log, now: int) -> None:
    """Bring every flag and counter to the boundary ``now`` between two instructions."""
    sample(m, h, log, now)
    advance(m, h, log, now)
    levels_request(m, h, now)


@helper
def read(m: Bytes, h: Hidden, log: Log, place: int, now: int) -> int:
    """Read a byte other than a port as an instruction does: the present count, P of the PSW."""
    if place == PSW:
        return (byte(m, PSW) & 0xFE) | parity(m)
    return latch(m, h, log, place, now)


@helper
def latch(m: Bytes, h: Hidden, log: Log, place: int, now: int) -> int:
    """Read a byte other than a port as a read-modify-write instruction does, at its end."""
    if place in (IE, IP):
        h[HOLD] = 1
        h[DUE] = 0
    elif place in (TCON, SCON, T2CON, RCAP2L, RCAP2H, SBUF):
        refresh(m, h, log, now)
    elif place in (TL0, TL1, TH0, TH1, TL2, TH2):
        h[TOUCHED] = 1
        refresh(m, h, log, now)
    elif place == PSW:  # its bit P follows A at every moment
        return (byte(m, PSW) & 0xFE) | parity(m)
    return byte(m, place)


@helper
def parity(m: Bytes) -> int:
    """Return bit P of the PSW: 1 where A holds an odd number of ones."""
    a = byte(m, ACC)
    a ^= a >> 4
    return (0x6996 >> (a & 15)) & 1


@helper
def begin_sending(m: Bytes, h: Hidden, value: int, now: int) -> None:
    """Start a frame at the end of the write to SBUF, which leaves the byte received ("More About Mode 1")."""
    mode = byte(m, SCON) >> 6
    h[SEND_BYTE] = value
    h[SEND_LEFT] = 0
    h[SEND_AT] = NEVER
    cycle = 12 if h[TICK] == 12 else 1  # units of a twelfth of the oscillator
    if mode == 0:
        h[SEND_AT] = now + 9 * cycle  # S1P1 of the tenth cycle after the write
    elif mode == 2:
        clocks = 11 * (32 if m[PCON] & 0x80 != 0 else 64)
        h[SEND_AT] = now + (clocks * cycle + 11) // 12
    else:
        timer = baud_timer(m, h, 0x10)
        unit = 16 if timer == 2 or m[PCON] & 0x80 != 0 else 32
        phase = (h[OVERFLOWS_2] if timer == 2 else h[OVERFLOWS_1]) % unit
        # TI comes with the stop bit, ten (eleven) rollovers of the divide-by-16 counter after the write
        h[SEND_LEFT] = (10 if mode == 1 else 11) * unit - phase


@helper
def begin_receiving(m: Bytes, h: Hidden, value: int, now: int) -> None:
    """Start a frame whose start bit falls at ``now``, which resets the divider; bits are sampled in their middle."""
    mode = byte(m, SCON) >> 6
    h[RECEIVE_BYTE] = value
    bits_16 = (9 if mode == 1 else 10) * 16 + 9  # samples at 7, 8, 9 sixteenths of a bit
    if mode == 2:
        clocks = bits_16 * (2 if m[PCON] & 0x80 != 0 else 4)
        cycle = 12 if h[TICK] == 12 else 1
        h[RECEIVE_AT] = now + (clocks * cycle + 11) // 12
    else:
        timer = baud_timer(m, h, 0x20)
        h[RECEIVE_LEFT] = bits_16 * (1 if timer == 2 or m[PCON] & 0x80 != 0 else 2)


@helper
def write_port(m: Bytes, h: Hidden, log: Log, place: int, value: int, now: int) -> None:
    """Write the latch of a port at the end ``now`` of an instruction; inputs on the same pins may see it."""
    changed = byte(m, place) ^ value
    m[place] = value
    if changed != 0:
        h[TOUCHED] = 1
        if h[LOG_ROOM] != 0:
            note(h, log, now, (place - P0) >> 4, value)
        if changed & h[STOPPING + ((place - P0) >> 4)] != 0:
            h[OUTPUT_AT] = now
            h[STOP] = STOP_OUTPUT
            h[DUE] = 0
        if (place == P3 and changed & 0x3C != 0) or (place == P1 and changed & 3 != 0 and h[HAS_TIMER2] != 0):
            relevel(m, h, log, now)
            if h[SEEN] != h[LEVELS]:
                h[DUE] = 0


@helper
def write(m: Bytes, h: Hidden, log: Log, place: int, value: int, now: int) -> None:
    """Write a register that does something, at the end ``now`` of its instruction."""
    h[DUE] = 0
    h[TOUCHED] = 1
    if place in (T2CON, TMOD):
        relevel(m, h, log, now)
    refresh(m, h, log, now)
    before = byte(m, place)
    if place == SBUF:
        begin_sending(m, h, value, now)
        return
    m[place] = value
    risen = value & ~before
    if place in (IE, IP):
        h[HOLD] = 1
    elif place == TCON:
        for i in range(4):
            if risen & (0x02, 0x20, 0x08, 0x80)[i] != 0:
                h[STAMP + i] = now
    elif place == SCON and risen & 3 != 0:
        h[STAMP + SERIAL] = now
    elif place == T2CON and risen & 0xC0 != 0:
        h[STAMP + TIMER_2] = now
    elif place == PCON and value & 2 != 0:
        h[STOP] = STOP_POWER_DOWN


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
def next_timer_request(m: Bytes, h: Hidden, enabled: int) -> int:
    """Return the earliest cycle at which a timer or the serial port will set the flag of an ``enabled`` interrupt."""
    due = NEVER
    if enabled & 0x80 == 0:
        return due
    tick = h[TICK]
    base = h[SYNCED] // tick
    split = mode_of(m, 0) == 3
    if enabled & 2 != 0 and m[TMOD] & 4 == 0 and m[TCON] & 0x20 == 0 and on(m, h, 0):
        due = min(due, (base + until_overflow(m, 0)) * tick)
    if enabled & 8 != 0 and m[TCON] & 0x80 == 0:
        if split:
            if m[TCON] & 0x40 != 0:
                due = min(due, (base + 256 - byte(m, TH0)) * tick)
        elif m[TMOD] & 0x40 == 0 and on(m, h, 1):
            due = min(due, (base + until_overflow(m, 1)) * tick)
    if h[HAS_TIMER2] != 0 and enabled & 0x20 != 0 and m[T2CON] & 0xB6 == 0x04:
        due = min(due, (base + 65536 - ((byte(m, TH2) << 8) | byte(m, TL2))) * tick)
    if enabled & 0x10 != 0:
        due = min(due, h[SEND_AT], h[RECEIVE_AT])
        if h[SEND_LEFT] > 0:
            due = min(due, overflow_cycle(m, h, baud_timer(m, h, 0x10), h[SEND_LEFT]))
        if h[RECEIVE_LEFT] > 0:
            due = min(due, overflow_cycle(m, h, baud_timer(m, h, 0x20), h[RECEIVE_LEFT]))
    return due


@helper
def until_overflow(m: Bytes, timer: int) -> int:
    """Return the ticks until timer 0 or 1 overflows."""
    mode = mode_of(m, timer)
    low, high = byte(m, TL0 + timer), byte(m, TH0 + timer)
    if mode == 0:
        return 8192 - ((high << 5) | (low & 31))
    return 65536 - ((high << 8) | low) if mode == 1 else 256 - low


@helper
def overflow_cycle(m: Bytes, h: Hidden, timer: int, n: int) -> int:
    """Return the cycle of the n-th overflow of a timer from now, NEVER where it does not run by itself."""
    if timer == 2:
        if m[T2CON] & 0x06 != 0x04:
            return NEVER
        num, den = timer_2_rate(m, h)
        reload = (byte(m, RCAP2H) << 8) | byte(m, RCAP2L)
        first = h[SYNCED] * num // den + 65536 - ((byte(m, TH2) << 8) | byte(m, TL2))
        return cycle_of(first + (n - 1) * (65536 - reload), num, den)
    if m[TMOD] & 0x40 != 0 or not on(m, h, 1):
        return NEVER
    mode = mode_of(m, 1)
    period = 8192 if mode == 0 else 65536 if mode == 1 else 256 - byte(m, TH1)
    return int((h[SYNCED] // h[TICK] + until_overflow(m, 1) + (n - 1) * period) * h[TICK])


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


@helper
def move_pins(m: Bytes, h: Hidden, log: Log, changes: NDArray[np.int64], now: int) -> None:
    """Apply the changes of pins that are sampled in a cycle up to ``now``: rows of cycle, port, levels."""
    i = h[CHANGE]
    while i < h[CHANGES] and changes[i, 0] <= now:
        m[PINS + (changes[i, 1] & 3)] = changes[i, 2]
        relevel(m, h, log, changes[i, 0])
        i += 1
    h[CHANGE] = i


@step
def set_pins(m: Bytes, h: Hidden, log: Log, port: int, levels: int, cycle: int) -> None:
    """Set the pins of a port, sampled from ``cycle`` on; for a driver that runs the loop from one change to the next."""
    m[PINS + port] = levels
    relevel(m, h, log, cycle)
    if h[SEEN] != h[LEVELS]:
        h[OTHERS] = min(h[OTHERS], h[LEVELS_AT] + 1)
        h[DUE] = min(h[DUE], h[OTHERS])


@step
def until(h: Hidden, changes: NDArray[np.int64], cycle: int) -> None:
    """Set the end of a run that goes on where the last one ended, perhaps with other changes of pins in the queue."""
    h[END] = cycle
    if h[DUE] != 0:
        h[DUE] = min(h[OTHERS], cycle)
        if h[CHANGE] < h[CHANGES]:
            h[DUE] = min(h[DUE], changes[h[CHANGE], 0])


@step
def pins_alone(m: Bytes, h: Hidden, log: Log, changes: NDArray[np.int64], now: int) -> bool:
    """Apply changes of pins that nothing but the program looks at; False where `attend` is needed."""
    i = h[CHANGE]
    n = h[CHANGES]
    # a write has set DUE to 0 where it may have changed more than pins
    if h[DUE] == 0 or now >= h[OTHERS]:
        return False
    due = min(h[OTHERS], h[END])
    while i < n:
        if changes[i, 0] > now:
            due = min(due, changes[i, 0])
            break
        port = changes[i, 1] & 3
        if (byte(m, PINS + port) ^ changes[i, 2]) & h[INPUTS + port] != 0:
            break
        m[PINS + port] = changes[i, 2]
        if port == 3:  # INT0 and INT1 keep their edges until their flags are read
            levels = (h[LEVELS] & ~0x0C) | (byte(m, P3) & changes[i, 2] & 0x0C)
            if levels != h[LEVELS]:
                sample(m, h, log, changes[i, 0])
                h[LEVELS] = levels
                h[LEVELS_AT] = changes[i, 0]
        i += 1
    h[CHANGE] = i
    if i < n and changes[i, 0] <= now:
        return False
    h[DUE] = due
    return True


@helper
def attend(m: Bytes, h: Hidden, log: Log, changes: NDArray[np.int64], now: int) -> int:
    """Look up at the boundary ``now``: pins, timers, interrupts, idle; set DUE; return the cycle to go on from."""
    move_pins(m, h, log, changes, now)
    relevel(m, h, log, now)
    refresh(m, h, log, now)
    if h[STOP] != 0:
        return now
    held = h[HOLD]
    h[HOLD] = 0
    asked = pending(m, h)
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
    for source in range(6):
        if asked & (1 << source) != 0:
            ripe = h[STAMP + source] + h[RECOGNISE]
            if ripe > now:
                due = min(due, ripe)
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


@kernel
def start_reception(m: Bytes, h: Hidden, value: int, now: int) -> None:
    """Start a reception from Python."""
    begin_receiving(m, h, value, now)
