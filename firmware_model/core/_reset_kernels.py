"""Compiled reset of the processor."""

from __future__ import annotations

from firmware_model._jit import kernel
from firmware_model.core._layout import (
    CYCLES,
    DROPPED,
    FAULT,
    HAS_TIMER2,
    HOLD,
    LEVELS,
    LEVELS_AT,
    NEVER,
    OUTPUT_AT,
    OVERFLOWS_1,
    OVERFLOWS_2,
    P0,
    P1,
    P2,
    P3,
    PC,
    PINS,
    RECEIVE_AT,
    RECEIVE_LEFT,
    SEEN,
    SEND_AT,
    SEND_LEFT,
    SERVING,
    SP,
    STAMP,
    STOP,
    SYNCED,
)
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
    m[SP] = 0x07
    for port in (P0, P1, P2, P3):
        m[port] = 0xFF
    for index in (PC, SERVING, HOLD, STOP, FAULT, SEND_LEFT, RECEIVE_LEFT, OUTPUT_AT, OVERFLOWS_1, OVERFLOWS_2):
        h[index] = 0
    for index in (SEND_AT, RECEIVE_AT, DROPPED, DROPPED + 1):
        h[index] = NEVER
    for index in range(STAMP, STAMP + 6):
        h[index] = h[CYCLES]
    levels = byte(m, PINS + 3) & 0x3C
    if h[HAS_TIMER2] != 0:
        levels |= (byte(m, PINS + 1) & 3) << 8
    h[LEVELS] = levels  # what stands at the pins at reset is no edge
    h[SEEN] = levels
    for index in (SYNCED, LEVELS_AT):
        h[index] = h[CYCLES]
