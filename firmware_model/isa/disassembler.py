"""The text of an instruction, of a stretch of memory, of an image: from the table, in the syntax of sdas8051."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from firmware_model.errors import FirmwareError
from firmware_model.isa.parts import BIT_NAMES, SFR_NAMES
from firmware_model.isa.table import INSTRUCTIONS, RESERVED_OPCODE, Instruction, Operand

_FIXED = {
    Operand.A: "a",
    Operand.AB: "ab",
    Operand.C: "c",
    Operand.DPTR: "dptr",
    Operand.AT_DPTR: "@dptr",
    Operand.AT_A_DPTR: "@a+dptr",
    Operand.AT_A_PC: "@a+pc",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One instruction of a program."""

    address: int
    """Of its opcode."""
    code: bytes
    """Its bytes."""
    text: str
    """As the assembler writes it."""
    instruction: Instruction
    """Its row of the table."""

    def __str__(self) -> str:
        return f"{self.address:04X}  {self.code.hex(' ').upper():<8}  {self.text}"


def _bit(address: int) -> str:
    if address in BIT_NAMES:
        return BIT_NAMES[address].lower()
    if address >= 0x80 and (address & 0xF8) in SFR_NAMES:
        return f"{SFR_NAMES[address & 0xF8].lower()}.{address & 7}"
    return f"0x{address:02x}"


def _direct(address: int) -> str:
    return SFR_NAMES[address].lower() if address in SFR_NAMES else f"0x{address:02x}"


def _operand(operand: Operand, row: Instruction, behind: Iterator[int], following: int) -> str:  # noqa: PLR0911 - a line for each mode
    if operand in _FIXED:
        return _FIXED[operand]
    if operand is Operand.RN:
        return f"r{row.opcode & 7}"
    if operand is Operand.AT_RI:
        return f"@r{row.opcode & 1}"
    value = next(behind)
    if operand is Operand.DIRECT:
        return _direct(value)
    if operand is Operand.BIT:
        return _bit(value)
    if operand is Operand.NOT_BIT:
        return f"/{_bit(value)}"
    if operand is Operand.IMMEDIATE:
        return f"#0x{value:02x}"
    if operand is Operand.REL:
        return f"0x{(following + (value ^ 0x80) - 0x80) & 0xFFFF:04x}"
    if operand is Operand.ADDR11:
        return f"0x{(following & 0xF800) | (row.opcode >> 5 << 8) | value:04x}"
    value = value * 256 + next(behind)
    return f"#0x{value:04x}" if operand is Operand.IMMEDIATE16 else f"0x{value:04x}"


def disassemble(code: bytes, address: int = 0) -> Line:
    r"""Return the instruction at an address.

    Parameters
    ----------
    code
        Program memory from address 0 on; beyond its end 0xFF is read, beyond 0xFFFF it begins anew.
    address
        0..0xFFFF.

    Raises
    ------
    FirmwareError
        An address outside program memory.

    Examples
    --------
    >>> print(disassemble(bytes([0x00, 0x20, 0x91, 0xFC]), 1))
    0001  20 91 FC  jb p1.1,0x0000
    """
    if not 0 <= address < 0x10000:
        raise FirmwareError("address", address, "0 to 65535")

    def fetch(where: int) -> int:
        where &= 0xFFFF
        return code[where] if where < len(code) else 0xFF

    row = INSTRUCTIONS[fetch(address)]
    taken = bytes(fetch(address + i) for i in range(row.length))
    if row.opcode == RESERVED_OPCODE:
        return Line(address=address, code=taken, text=".db 0xa5", instruction=row)
    behind = iter(taken[1:])
    texts = [_operand(operand, row, behind, address + row.length) for operand in row.operands]
    if row.operands == (Operand.DIRECT, Operand.DIRECT):
        texts.reverse()  # the only form that codes its source first
    text = f"{row.mnemonic.lower()} {','.join(texts)}".strip()
    return Line(address=address, code=taken, text=text, instruction=row)


def disassemble_image(code: bytes, used: Sequence[tuple[int, int]]) -> Iterator[Line]:
    """Yield the instructions of an image one after another, as a listing; tables in it appear as instructions.

    Examples
    --------
    >>> [line.text for line in disassemble_image(bytes([0xE4, 0x80, 0xFE]), [(0, 3)])]
    ['clr a', 'sjmp 0x0001']
    """
    for begin, end in used:
        address = begin
        while address < end:
            line = disassemble(code, address)
            yield line
            address += line.instruction.length
