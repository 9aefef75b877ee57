"""Compiled parts of a node's way to the bus: the frames that it wants to send, and the order of those it receives."""

from __future__ import annotations

import numpy as np

from rtec._jit import Record, helper

ROOM = 16
"""Frames that a node may want to send before anybody takes them; it makes at most five in a millisecond."""

MOST_LOST = 5
"""Frames of one kind that may be missing in a row: with more, the silence is too long to go on."""

IN_ORDER, REPEATED, DISORDERED, JUMPED = 0, 1, 2, 3

OUTBOX = np.dtype(
    [
        ("waiting", np.int64),
        ("identifier", np.int64, (ROOM,)),
        ("payload", np.int64, (ROOM,)),
        ("overrun", np.int64),  # frames that found no room: the ones before were not taken
    ],
    align=True,
)


@helper
def put(o: Record, identifier: int, payload: int) -> None:
    """Want to send a frame."""
    if o.waiting == ROOM:
        o.overrun += 1
        return
    o.identifier[o.waiting] = identifier
    o.payload[o.waiting] = payload
    o.waiting += 1


@helper
def order_of(last: int, sequence: int) -> int:
    """Return whether a sequence counter follows the last one."""
    ahead = (sequence - last) & 0xFF
    if ahead == 0:
        return REPEATED
    if ahead <= MOST_LOST + 1:
        return IN_ORDER
    return DISORDERED if ahead >= 0x80 else JUMPED
