"""Requests for interrupts, rows of the log, and bytes of the memory as every peripheral reads them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firmware_model._jit import step
from firmware_model.core import _layout as at

Bytes = NDArray[np.uint8]
Hidden = NDArray[np.int64]
Log = NDArray[np.int64]


@step
def byte(m: Bytes, place: int) -> int:
    """Return a byte as int64: uint8 would stay narrow, and mixed with others become unsigned."""
    return int(np.int64(m[place]))


@step
def note(h: Hidden, log: Log, cycle: int, what: int, value: int) -> None:
    """Write a row of the log; the loop stops while there is no room."""
    i = h[at.LOGGED]
    if h[at.LOG_ROOM] == 0:
        return
    log[i, 0] = cycle
    log[i, 1] = what
    log[i, 2] = value
    h[at.LOGGED] = i + 1
    # one look can write at most a few rows: what was sent, and the four ports
    if i + 8 >= h[at.LOG_ROOM]:
        h[at.STOP] = at.STOP_LOG_FULL
        h[at.DUE] = 0


@step
def request(m: Bytes, h: Hidden, place: int, mask: int, source: int, cycle: int) -> None:
    """Set the flag of an interrupt; the request is as old as its first flag."""
    if m[place] & mask == 0:
        m[place] |= mask
        h[at.STAMP + source] = cycle
