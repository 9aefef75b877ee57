"""Cyclic redundancy checks bit by bit, as the division of polynomials that they are.

Nothing here imports rtec.
"""

from __future__ import annotations

from collections.abc import Iterable


def bits_of(data: bytes) -> list[int]:
    """Return the bits of some bytes, the highest of each byte first."""
    return [(byte >> place) & 1 for byte in data for place in range(7, -1, -1)]


def remainder(bits: Iterable[int], width: int, polynomial: int, start: int) -> int:
    """Return the register of a CRC after the bits have been shifted through it."""
    register = start
    for bit in bits:
        out = (register >> (width - 1)) & 1
        register = (register << 1) & ((1 << width) - 1)
        if out ^ bit:
            register ^= polynomial
    return register


def crc8h2f(data: bytes) -> int:
    """Return CRC8H2F: x^8 + x^5 + x^3 + x^2 + x + 1, start 0xFF, inverted at the end (AUTOSAR, CRC Routines)."""
    return remainder(bits_of(data), 8, 0x2F, 0xFF) ^ 0xFF


def frame_checksum(identifier: int, data: bytes) -> int:
    """Return the checksum of one of our frames: over the identifier, low byte first, and bytes 1 to 7."""
    return crc8h2f(bytes([identifier & 0xFF, identifier >> 8]) + data[1:])


def crc15_can(bits: Iterable[int]) -> int:
    """Return the checksum of CAN itself (ISO 11898-1): polynomial 0x4599, start 0."""
    return remainder(bits, 15, 0x4599, 0)
