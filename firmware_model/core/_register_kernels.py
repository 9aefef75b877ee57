"""Compiled access to special function registers that do something, as instructions read and write them."""

from __future__ import annotations

from firmware_model._jit import helper
from firmware_model.core._layout import (
    ACC,
    DUE,
    HAS_TIMER2,
    HOLD,
    IE,
    IP,
    LEVELS,
    LOG_ROOM,
    OUTPUT_AT,
    P0,
    P1,
    P3,
    PCON,
    PSW,
    QUIET,
    RCAP2H,
    RCAP2L,
    SBUF,
    SCON,
    SEEN,
    SERIAL,
    STAMP,
    STOP,
    STOP_OUTPUT,
    STOP_POWER_DOWN,
    STOPPING,
    T2CON,
    TCON,
    TH0,
    TH1,
    TH2,
    TIMER_2,
    TL0,
    TL1,
    TL2,
    TMOD,
    TOUCHED,
)  # fmt: skip
from firmware_model.core._pin_kernels import refresh, relevel
from firmware_model.core._request_kernels import Bytes, Hidden, Log, byte, note
from firmware_model.core._serial_kernels import begin_sending
from firmware_model.core._timer_kernels import next_timer_request


@helper
def parity(m: Bytes) -> int:
    """Return bit P of the PSW: 1 where A holds an odd number of ones."""
    a = byte(m, ACC)
    a ^= a >> 4
    return (0x6996 >> (a & 15)) & 1


@helper
def latch(m: Bytes, h: Hidden, log: Log, place: int, now: int) -> int:
    """Read a byte other than a port as a read-modify-write instruction does, at its end."""
    if place in (IE, IP):
        h[HOLD] = 1
        h[DUE] = 0
    elif place in (TCON, SCON, T2CON, RCAP2L, RCAP2H, SBUF):
        if now >= h[QUIET]:  # a flag is mostly polled in vain
            refresh(m, h, log, now)
            h[QUIET] = next_timer_request(m, h, 0xBF) if h[SEEN] == h[LEVELS] else 0
    elif place in (TL0, TL1, TH0, TH1, TL2, TH2):
        h[TOUCHED] = 1
        refresh(m, h, log, now)
    elif place == PSW:  # its bit P follows A at every moment
        return (byte(m, PSW) & 0xFE) | parity(m)
    return byte(m, place)


@helper
def read(m: Bytes, h: Hidden, log: Log, place: int, now: int) -> int:
    """Read a byte other than a port as an instruction does: the present count, P of the PSW."""
    if place == PSW:
        return (byte(m, PSW) & 0xFE) | parity(m)
    return latch(m, h, log, place, now)


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
    h[QUIET] = 0
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
