"""Arithmetic of the processor against the manual's rules written out in whole numbers, for every operand there is.

The results are produced by machine code that runs on the processor itself: it loops over one operand and leaves
result and PSW in external memory.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from firmware_model import Mcs51

R5, R6, R7 = 5, 6, 7
CY, AC, OV, P = 0x80, 0x40, 0x04, 0x01


def _sweep(operation: bytes, psw: int, a: int, *, a_is_swept: bool = False) -> NDArray[np.uint8]:
    """Return A, B, PSW after ``operation`` for each value 0..255 of R7, which is also B."""
    load_a = b"\xef" if a_is_swept else b"\xee"  # MOV A,R7 or MOV A,R6
    store = b"\xf0\xa3"  # MOVX @DPTR,A; INC DPTR
    body = b"\x8f\xf0" + load_a + b"\x8d\xd0" + operation  # MOV B,R7; ...; MOV PSW,R5
    body += b"\xc0\xd0" + store + b"\xe5\xf0" + store + b"\xd0\xe0" + store + b"\x0f"  # PUSH PSW ... POP ACC; INC R7
    loop = body + bytes([0xBF, 0x00, 256 - len(body) - 3]) + b"\x80\xfe"  # CJNE R7,#0,loop; SJMP $
    cpu = Mcs51(loop)
    cpu.iram[[R5, R6, R7]] = (psw, a, 0)
    cpu.run(256 * 40)
    assert cpu.pc == len(loop) - 2
    return cpu.xram[:768].reshape(256, 3).copy()


def _parity(a: int) -> int:
    return a.bit_count() & 1


def _added(a: int, b: int, cy: int) -> tuple[int, int]:
    low = (a & 15) + (b & 15) + cy
    signed = (a ^ 128) - 128 + (b ^ 128) - 128 + cy
    total = a + b + cy
    flags = (CY if total > 255 else 0) | (AC if low > 15 else 0) | (0 if -128 <= signed <= 127 else OV)
    return total % 256, flags | _parity(total % 256)


def _subtracted(a: int, b: int, cy: int) -> tuple[int, int]:
    low = (a & 15) - (b & 15) - cy
    signed = (a ^ 128) - 128 - ((b ^ 128) - 128) - cy
    total = a - b - cy
    flags = (CY if total < 0 else 0) | (AC if low < 0 else 0) | (0 if -128 <= signed <= 127 else OV)
    return total % 256, flags | _parity(total % 256)


@pytest.mark.parametrize("cy", [0, 1])
@pytest.mark.parametrize(
    ("opcode", "rule", "uses_carry"),
    [(0x2F, _added, False), (0x3F, _added, True), (0x9F, _subtracted, True)],
    ids=["ADD", "ADDC", "SUBB"],
)
def test_sums_and_differences(opcode, rule, uses_carry, cy):
    # AC and OV are set before, so that an operation that left them alone would be seen
    for a in range(256):
        found = _sweep(bytes([opcode]), psw=(CY if cy else 0) | AC | OV, a=a)
        expected = [rule(a, b, cy if uses_carry else 0) for b in range(256)]
        np.testing.assert_array_equal(found[:, [0, 2]], expected)


def test_products():
    for a in range(256):
        found = _sweep(b"\xa4", psw=CY | AC, a=a)
        b = np.arange(256)
        product = a * b
        flags = [AC | (OV if p > 255 else 0) | _parity(int(p) & 255) for p in product]
        np.testing.assert_array_equal(found, np.column_stack([product & 255, product >> 8, flags]))


def test_quotients():
    for a in range(256):
        found = _sweep(b"\x84", psw=CY | AC | OV, a=a)
        expected = [(a, 0, AC | OV | _parity(a))]  # B = 0: OV, CY cleared; what A and B are is this model's choice
        expected += [(a // b, a % b, AC | _parity(a // b)) for b in range(1, 256)]
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("ac", [0, 1])
@pytest.mark.parametrize("cy", [0, 1])
def test_decimal_adjustment(cy, ac):
    found = _sweep(b"\xd4", psw=(CY if cy else 0) | (AC if ac else 0), a=0, a_is_swept=True)
    for a in range(256):
        total = a + (6 if a % 16 > 9 or ac else 0)
        carried = cy or total > 255
        total %= 256
        if total // 16 > 9 or carried:
            total += 0x60
            carried = carried or total > 255
        total %= 256
        flags = (CY if carried else 0) | (AC if ac else 0) | _parity(total)
        assert tuple(found[a, [0, 2]]) == (total, flags), f"A={a:02X}h CY={cy} AC={ac}"


@pytest.mark.parametrize(
    ("opcode", "expected"),
    [
        (0x03, lambda a: ((a >> 1) | (a << 7)) & 255),
        (0x23, lambda a: ((a << 1) | (a >> 7)) & 255),
        (0x13, lambda a: (a >> 1) | 128),
        (0x33, lambda a: ((a << 1) | 1) & 255),
        (0xC4, lambda a: a // 16 + a % 16 * 16),
        (0xF4, lambda a: 255 - a),
        (0xE4, lambda a: 0),
        (0x04, lambda a: (a + 1) % 256),
        (0x14, lambda a: (a - 1) % 256),
    ],
    ids=["RR", "RL", "RRC", "RLC", "SWAP", "CPL", "CLR", "INC", "DEC"],
)
def test_accumulator(opcode, expected):
    found = _sweep(bytes([opcode]), psw=CY | AC | OV, a=0, a_is_swept=True)
    carry_out = {0x13: lambda a: a & 1, 0x33: lambda a: a >> 7}.get(opcode, lambda a: 1)
    for a in range(256):
        result = expected(a)
        assert tuple(found[a, [0, 2]]) == (result, carry_out(a) * CY | AC | OV | _parity(result))
