"""Compiled serial port: frames as a number of timer overflows, or a cycle, that are still to come.

Sections named are those of the MCS-51 User's Manual (1994), chapter 3.
"""

from __future__ import annotations

from firmware_model._jit import helper, kernel
from firmware_model.core import _layout as at
from firmware_model.core._request_kernels import Bytes, Hidden, Log, byte, note, request


@helper
def cycle_of(tick: int, num: int, den: int) -> int:
    """Return the first cycle at which ``tick`` ticks are complete, where ``num`` ticks take ``den`` cycles."""
    return (tick * den + num - 1) // num


@helper
def baud_timer(m: Bytes, h: Hidden, mask: int) -> int:
    """Return the timer that clocks sending (mask TCLK 0x10) or receiving (RCLK 0x20)."""
    return 2 if h[at.HAS_TIMER2] != 0 and m[at.T2CON] & mask != 0 else 1


@helper
def sent(m: Bytes, h: Hidden, log: Log, cycle: int) -> None:
    """End a transmission: TI at ``cycle``."""
    h[at.SEND_LEFT] = 0
    h[at.SEND_AT] = at.NEVER
    request(m, h, at.SCON, 2, at.SERIAL, cycle)
    note(h, log, cycle, at.LOG_SERIAL, h[at.SEND_BYTE])


@helper
def received(m: Bytes, h: Hidden, cycle: int) -> None:
    """End a reception: SBUF, RB8 and RI, where REN, RI and SM2 let them ("More About Mode 1", "2 and 3")."""
    h[at.RECEIVE_LEFT] = 0
    h[at.RECEIVE_AT] = at.NEVER
    control = byte(m, at.SCON)
    ninth = (h[at.RECEIVE_BYTE] >> 8) & 1
    if control & 0x01 == 0 and control & 0x10 != 0 and (control & 0x20 == 0 or ninth != 0):
        m[at.SBUF] = h[at.RECEIVE_BYTE] & 255
        m[at.SCON] = (control & 0xFB) | (ninth << 2)
        # RI and TI are one request; the manual gives it no two ages
        request(m, h, at.SCON, 1, at.SERIAL, cycle)


@helper
def clock_serial(
    m: Bytes, h: Hidden, log: Log, timer: int, n: int, first: int, period: int, num: int, den: int
) -> None:
    """Pass ``n`` overflows of timer 1 or 2 to the serial port; ``first`` is the absolute tick of the first one."""
    if h[at.SEND_LEFT] > 0 and baud_timer(m, h, 0x10) == timer:
        if n >= h[at.SEND_LEFT]:
            sent(m, h, log, cycle_of(first + (h[at.SEND_LEFT] - 1) * period, num, den))
        else:
            h[at.SEND_LEFT] -= n
    if h[at.RECEIVE_LEFT] > 0 and baud_timer(m, h, 0x20) == timer:
        if n >= h[at.RECEIVE_LEFT]:
            received(m, h, cycle_of(first + (h[at.RECEIVE_LEFT] - 1) * period, num, den))
        else:
            h[at.RECEIVE_LEFT] -= n


@helper
def begin_sending(m: Bytes, h: Hidden, value: int, now: int) -> None:
    """Start a frame at the end of the write to SBUF, which leaves the byte received ("More About Mode 1")."""
    mode = byte(m, at.SCON) >> 6
    h[at.SEND_BYTE] = value
    h[at.SEND_LEFT] = 0
    h[at.SEND_AT] = at.NEVER
    cycle = 12 if h[at.TICK] == 12 else 1  # units of a twelfth of the oscillator
    if mode == 0:
        h[at.SEND_AT] = now + 9 * cycle  # S1P1 of the tenth cycle after the write
    elif mode == 2:
        clocks = 11 * (32 if m[at.PCON] & 0x80 != 0 else 64)
        h[at.SEND_AT] = now + (clocks * cycle + 11) // 12
    else:
        timer = baud_timer(m, h, 0x10)
        unit = 16 if timer == 2 or m[at.PCON] & 0x80 != 0 else 32
        phase = (h[at.OVERFLOWS_2] if timer == 2 else h[at.OVERFLOWS_1]) % unit
        # TI comes with the stop bit, ten (eleven) rollovers of the divide-by-16 counter after the write
        h[at.SEND_LEFT] = (10 if mode == 1 else 11) * unit - phase


@kernel
def begin_receiving(m: Bytes, h: Hidden, value: int, now: int) -> None:
    """Start a frame whose start bit falls at ``now``, which resets the divider; bits are sampled in their middle."""
    mode = byte(m, at.SCON) >> 6
    h[at.RECEIVE_BYTE] = value
    bits_16 = (9 if mode == 1 else 10) * 16 + 9  # samples at 7, 8, 9 sixteenths of a bit
    if mode == 2:
        clocks = bits_16 * (2 if m[at.PCON] & 0x80 != 0 else 4)
        cycle = 12 if h[at.TICK] == 12 else 1
        h[at.RECEIVE_AT] = now + (clocks * cycle + 11) // 12
    else:
        timer = baud_timer(m, h, 0x20)
        h[at.RECEIVE_LEFT] = bits_16 * (1 if timer == 2 or m[at.PCON] & 0x80 != 0 else 2)
