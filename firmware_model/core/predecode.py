"""Program memory decoded once: one word an address, so that the loop fetches an instruction with one load.

The code of an MCS-51 cannot change while it runs (program and data memory are apart), so everything that depends on
the code alone is decided here: operands, branch targets, cost in either timing, whether an operand has side effects,
and the faults of fetching outside the image or naming a register that the part lacks.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firmware_model.core import _layout as at
from firmware_model.isa.parts import Part, Timing
from firmware_model.isa.table import INSTRUCTIONS, Instruction, Operand

_PLAIN_SFR = (at.SP, at.DPL, at.DPH, at.ACC, at.B)
"""Registers that hold a byte and do nothing; all others are read or written with side effects."""

_WAITING_LOOP_BYTES = 32
"""A branch back by fewer bytes may close a loop that waits for something, worth a second look while executing."""

_BITS = (Operand.BIT, Operand.NOT_BIT)


def _direct(address: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.where(address < 0x80, address, address + at.SFR_BASE)


def _bit_byte(address: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.where(address < 0x80, 0x20 + (address >> 3), (address & 0xF8) + at.SFR_BASE)


def _operands(row: Instruction, here: NDArray[np.int64], bytes_behind: list[NDArray[np.int64]]) -> dict[str, object]:
    """Return the fields x, y, bit of a form and the places it names, for all addresses ``here`` that hold it."""
    zero = np.zeros_like(here)
    x, y, bit = zero, zero, zero
    places: list[NDArray[np.int64]] = []
    behind = iter(bytes_behind)
    following = here + row.length
    for operand in row.operands:
        if operand is Operand.DIRECT:
            place = _direct(next(behind))
            # MOV direct,direct is the only form with two: the source comes first and stays in y
            x, y = (place, y) if places else (x, place)
            places.append(place)
        elif operand in _BITS:
            address = next(behind)
            y, bit = _bit_byte(address), address & 7
            places.append(y)
        elif operand is Operand.IMMEDIATE:
            value = next(behind)
            x, y = (value, y) if places else (x, value)
        elif operand is Operand.REL:
            offset = next(behind)
            x = (following + offset - 256 * (offset >> 7)) & 0xFFFF
        elif operand in {Operand.ADDR16, Operand.IMMEDIATE16}:
            x = next(behind) * 256 + next(behind)
        elif operand is Operand.ADDR11:
            x = (following & 0xF800) | ((row.opcode >> 5) << 8) | next(behind)
    return {"x": x, "y": y, "bit": bit, "places": places}


def _one_opcode(
    row: Instruction, here: NDArray[np.int64], code: NDArray[np.int64], *, timing: Timing, mapped: NDArray[np.bool_]
) -> NDArray[np.int64]:
    fields = _operands(row, here, [code[(here + 1) & 0xFFFF], code[(here + 2) & 0xFFFF]])
    places = fields["places"]
    assert isinstance(places, list)  # noqa: S101 - narrows the type
    special = np.zeros(here.size, dtype=bool)
    unmapped = np.zeros(here.size, dtype=bool)
    for place in places:
        special |= (place >= at.SFR_BASE) & ~np.isin(place, _PLAIN_SFR)
        unmapped |= ~mapped[place]
    one_clock = timing.clocks_per_cycle == 1
    back = np.zeros(here.size, dtype=bool)
    if Operand.REL in row.operands:
        x = np.asarray(fields["x"])
        back = (x <= here) & (here - x < _WAITING_LOOP_BYTES)
    cost = row.clocks if one_clock else row.cycles
    taken = row.clocks_taken - row.clocks if one_clock else 0
    word = (
        np.where(unmapped, at.UNMAPPED_SFR, row.form)
        | (cost << at.COST_AT)
        | (taken << at.TAKEN_AT)
        | (row.length << at.LENGTH_AT)
        | ((row.opcode & 7 if Operand.RN in row.operands else row.opcode & 1) << at.N_AT)
        | (special.astype(np.int64) << at.SPECIAL_AT)
        | (back.astype(np.int64) << at.BACK_AT)
    )
    shifts = (("x", at.X_AT), ("y", at.Y_AT), ("bit", at.BIT_AT))
    for name, shift in shifts:
        word = word | (np.asarray(fields[name], dtype=np.int64) << shift)
    return np.asarray(word, dtype=np.int64)


def decode(code: bytes, used: Sequence[tuple[int, int]], part: Part, timing: Timing) -> NDArray[np.int64]:
    """Return the decoded word of each of the 65 536 addresses.

    Parameters
    ----------
    code
        65 536 bytes of program memory.
    used
        Ranges ``(begin, end)`` of addresses that the image fills; an instruction with a byte outside is a fault.
    part, timing
        The part simulated.

    Examples
    --------
    >>> from firmware_model.isa.parts import PARTS, TIMINGS
    >>> words = decode(bytes(65536), [(0, 1)], PARTS["8051"], TIMINGS["12-clock"])
    >>> int(words[0]) & 0x1FF, int(words[1]) & 0x1FF  # NOP, and nothing
    (0, 256)
    """
    values = np.frombuffer(code, dtype=np.uint8).astype(np.int64)
    filled = np.zeros(0x10000 + 2, dtype=bool)
    for begin, end in used:
        filled[begin:end] = True
    filled[0x10000:] = filled[:2]
    mapped = np.zeros(0x200, dtype=bool)
    mapped[:0x80] = True
    mapped[[address + at.SFR_BASE for address in part.sfr]] = True
    words = np.zeros(0x10000, dtype=np.int64)
    lengths = np.array([row.length for row in INSTRUCTIONS])[values]
    order = np.argsort(values, kind="stable")
    bounds = np.searchsorted(values[order], np.arange(257))
    for row in INSTRUCTIONS:
        here = order[bounds[row.opcode] : bounds[row.opcode + 1]]
        if here.size:
            words[here] = _one_opcode(row, here, values, timing=timing, mapped=mapped)
    here = np.arange(0x10000)
    outside = ~filled[:0x10000] | ((lengths > 1) & ~filled[here + 1]) | ((lengths > 2) & ~filled[here + 2])
    words[outside] = at.OUTSIDE_IMAGE
    return words
