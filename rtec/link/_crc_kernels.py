"""Compiled checksum of a frame: CRC-8 with the polynomial 0x2F.

The polynomial x^8 + x^5 + x^3 + x^2 + x + 1 (0x2F, start 0xFF, inverted at the end) is the one that the CRC library
of AUTOSAR names CRC8H2F: it finds every error of up to three bits in itself and the nine bytes that it is taken over
here. CAN's own checksum guards the wire; this one guards all the way from the sender's memory to the receiver's. The
identifier is part of it: a frame that is delivered under another identifier of its axis, or of its kind, is refused.
"""

from __future__ import annotations

import numpy as np

from rtec._jit import helper, kernel

POLYNOMIAL = 0x2F
START = 0xFF


def _table() -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return the checksum table: the effect of each byte."""
    table = np.zeros(256, dtype=np.int64)
    for byte in range(256):
        value = byte
        for _ in range(8):
            value = (value << 1) ^ (POLYNOMIAL if value & 0x80 else 0)
            value &= 0xFF
        table[byte] = value
    return table


TABLE = _table()


@helper
def checksum(identifier: int, payload: int) -> int:
    """Return the checksum of a frame: over its identifier, low byte first, and bytes 1 to 7 of its payload."""
    crc = TABLE[START ^ (identifier & 0xFF)]
    crc = TABLE[crc ^ ((identifier >> 8) & 0xFF)]
    for shift in range(8, 64, 8):
        crc = TABLE[crc ^ ((payload >> shift) & 0xFF)]
    return int(crc ^ 0xFF)


@kernel
def sealed(identifier: int, payload: int) -> int:
    """Return the payload with its checksum in byte 0."""
    return (payload & ~0xFF) | checksum(identifier, payload)


@helper
def is_sealed(identifier: int, payload: int) -> bool:
    """Return whether the checksum of a frame is right."""
    return checksum(identifier, payload) == payload & 0xFF
