"""Compiled access to special function registers that do something, as instructions read and write them."""

from __future__ import annotations

from firmware_model._jit import helper
from firmware_model.core import _layout as at
from firmware_model.core._pin_kernels import refresh, relevel
from firmware_model.core._request_kernels import Bytes, Hidden, Log, byte, note
from firmware_model.core._serial_kernels import begin_sending
from firmware_model.core._timer_kernels import next_timer_request


@helper
def parity(m: Bytes) -> int:
    """Return bit P of the PSW: 1 where A holds an odd number of ones."""
    a = byte(m, at.ACC)
    a ^= a >> 4
    return (0x6996 >> (a & 15)) & 1


@helper
def latch(m: Bytes, h: Hidden, log: Log, place: int, now: int) -> int:
    """Read a byte other than a port at ``now``: the present count, P of the PSW."""
    if place in (at.IE, at.IP):
        h[at.HOLD] = 1
        h[at.DUE] = 0
    elif place in (at.TCON, at.SCON, at.T2CON, at.RCAP2L, at.RCAP2H, at.SBUF):
        if now >= h[at.QUIET]:  # a flag is mostly polled in vain
            refresh(m, h, log, now)
            h[at.QUIET] = next_timer_request(m, h, 0xBF) if h[at.SEEN] == h[at.LEVELS] else 0
    elif place in (at.TL0, at.TL1, at.TH0, at.TH1, at.TL2, at.TH2):
        h[at.TOUCHED] = 1
        refresh(m, h, log, now)
    elif place == at.PSW:  # its bit P follows A at every moment
        return (byte(m, at.PSW) & 0xFE) | parity(m)
    return byte(m, place)


@helper
def write_port(m: Bytes, h: Hidden, log: Log, place: int, value: int, now: int) -> None:
    """Write the latch of a port at the end ``now`` of an instruction; inputs on the same pins may see it."""
    changed = byte(m, place) ^ value
    m[place] = value
    if changed != 0:
        h[at.TOUCHED] = 1
        if h[at.LOG_ROOM] != 0:
            note(h, log, now, (place - at.P0) >> 4, value)
        if changed & h[at.STOPPING + ((place - at.P0) >> 4)] != 0:
            h[at.OUTPUT_AT] = now
            h[at.STOP] = at.STOP_OUTPUT
            h[at.DUE] = 0
        if (place == at.P3 and changed & 0x3C != 0) or (
            place == at.P1 and changed & 3 != 0 and h[at.HAS_TIMER2] != 0
        ):
            relevel(m, h, log, now)
            if h[at.SEEN] != h[at.LEVELS]:
                h[at.DUE] = 0


@helper
def write(m: Bytes, h: Hidden, log: Log, place: int, value: int, now: int) -> None:
    """Write a register that does something, at the end ``now`` of its instruction."""
    h[at.DUE] = 0
    h[at.QUIET] = 0
    h[at.TOUCHED] = 1
    if place in (at.T2CON, at.TMOD):
        relevel(m, h, log, now)
    refresh(m, h, log, now)
    before = byte(m, place)
    if place == at.SBUF:
        begin_sending(m, h, value, now)
        return
    m[place] = value
    risen = value & ~before
    if place in (at.IE, at.IP):
        h[at.HOLD] = 1
    elif place == at.TCON:
        for i in range(4):
            if risen & (0x02, 0x20, 0x08, 0x80)[i] != 0:
                h[at.STAMP + i] = now
    elif place == at.SCON and risen & 3 != 0:
        h[at.STAMP + at.SERIAL] = now
    elif place == at.T2CON and risen & 0xC0 != 0:
        h[at.STAMP + at.TIMER_2] = now
    elif place == at.PCON and value & 2 != 0:
        h[at.STOP] = at.STOP_POWER_DOWN
