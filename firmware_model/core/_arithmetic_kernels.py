"""Compiled arithmetic of the accumulator, with the flags that it leaves in PSW.

Sections named are those of the MCS-51 User's Manual (1994), chapter 2, "Instruction Definitions".
"""

from __future__ import annotations

from firmware_model._jit import helper, step
from firmware_model.core import _layout as at
from firmware_model.core._request_kernels import Bytes, byte


@step
def carry(m: Bytes) -> int:
    """Return CY."""
    return byte(m, at.PSW) >> 7


@step
def set_carry(m: Bytes, cy: int) -> None:
    """Set CY alone."""
    m[at.PSW] = (byte(m, at.PSW) & 0x7F) | (cy << 7)


@helper
def add(m: Bytes, value: int, cy: int) -> None:
    """Add to A with the three flags: OV is the carry into bit 7 against the carry out of it."""
    a = byte(m, at.ACC)
    total = a + value + cy
    half = (a ^ value ^ total) & 0x10
    over = ((a ^ total) & (value ^ total) & 0x80) >> 5
    m[at.PSW] = (byte(m, at.PSW) & 0x3B) | ((total & 0x100) >> 1) | (half << 2) | over
    m[at.ACC] = total & 255


@helper
def subtract(m: Bytes, value: int) -> None:
    """Subtract from A with borrow; the flags are borrows."""
    a = byte(m, at.ACC)
    total = a - value - carry(m)
    half = (a ^ value ^ total) & 0x10
    over = ((a ^ value) & (a ^ total) & 0x80) >> 5
    m[at.PSW] = (byte(m, at.PSW) & 0x3B) | ((total & 0x100) >> 1) | (half << 2) | over
    m[at.ACC] = total & 255


@helper
def decimal_adjust(m: Bytes) -> None:
    """Correct A after a decimal addition; CY can be set, never cleared ("DA A")."""
    a = byte(m, at.ACC)
    psw = byte(m, at.PSW)
    if a & 15 > 9 or psw & 0x40 != 0:
        a += 6
    cy = (psw >> 7) | (a >> 8)
    if (a & 255) > 0x9F or cy != 0:
        a = (a & 255) + 0x60
        cy |= a >> 8
    m[at.ACC] = a & 255
    m[at.PSW] = (psw & 0x7F) | (cy << 7)


@helper
def multiply(m: Bytes) -> None:
    """Multiply A by B: OV where the product needs B, CY cleared."""
    product = byte(m, at.ACC) * byte(m, at.B)
    m[at.ACC] = product & 255
    m[at.B] = product >> 8
    m[at.PSW] = (byte(m, at.PSW) & 0x7B) | (4 if product > 255 else 0)


@helper
def divide(m: Bytes) -> None:
    """Divide A by B: CY cleared, OV where B is 0; A and B, undefined then, are left as they are."""
    a, b = byte(m, at.ACC), byte(m, at.B)
    m[at.PSW] = (byte(m, at.PSW) & 0x7B) | (4 if b == 0 else 0)
    if b != 0:
        m[at.ACC] = a // b
        m[at.B] = a % b
