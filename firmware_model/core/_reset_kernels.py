"""Compiled reset of the processor."""

from __future__ import annotations

from firmware_model._jit import kernel
from firmware_model.core import _layout as at
from firmware_model.core._request_kernels import Bytes, Hidden, byte

REGISTERS, REGISTERS_END = 0x180, 0x200


@kernel
def reset(m: Bytes, h: Hidden) -> None:
    """Reset registers and hidden state; both RAMs, the pins and the count of cycles stay as they are.

    The manual: reset does not affect internal RAM. Time goes on, so that a reset can be tried in any cycle of a run.
    Registers that do not become 0: MCS-51 User's Manual 1994, chapter 3, "Reset", table 8.
    """
    for place in range(REGISTERS, REGISTERS_END):
        m[place] = 0
    m[at.SP] = 0x07
    for port in (at.P0, at.P1, at.P2, at.P3):
        m[port] = 0xFF
    for index in (
        at.PC,
        at.SERVING,
        at.HOLD,
        at.STOP,
        at.FAULT,
        at.SEND_LEFT,
        at.RECEIVE_LEFT,
        at.OUTPUT_AT,
        at.OVERFLOWS_1,
        at.OVERFLOWS_2,
    ):
        h[index] = 0
    for index in (at.SEND_AT, at.RECEIVE_AT, at.DROPPED, at.DROPPED + 1):
        h[index] = at.NEVER
    for index in range(at.STAMP, at.STAMP + 6):
        h[index] = h[at.CYCLES]
    levels = byte(m, at.PINS + 3) & 0x3C
    if h[at.HAS_TIMER2] != 0:
        levels |= (byte(m, at.PINS + 1) & 3) << 8
    h[at.LEVELS] = levels  # what stands at the pins at reset is no edge
    h[at.SEEN] = levels
    for index in (at.SYNCED, at.LEVELS_AT):
        h[index] = h[at.CYCLES]
