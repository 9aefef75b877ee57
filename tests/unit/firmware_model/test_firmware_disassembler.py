"""Texts of the disassembler against the assembler of SDCC, which must give back every byte."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from firmware_model import FirmwareError, read_hex
from firmware_model.isa.disassembler import disassemble, disassemble_image
from firmware_model.isa.table import INSTRUCTIONS, RESERVED_OPCODE, Operand

needs_assembler = pytest.mark.skipif(
    not (shutil.which("sdas8051") and shutil.which("sdld")), reason="sdas8051 and sdld (SDCC) are not installed"
)


START = 0x1000  # away from both ends, so that no branch leaves the memory


def _program() -> bytes:
    """Return every opcode but the reserved one with several operands each."""
    code = bytearray(START)
    for first, second in ((0x30, 0x05), (0x90, 0xFB), (0xE5, 0x80), (0xD7, 0x7F), (0x81, 0x00)):
        for row in INSTRUCTIONS:
            if row.opcode != RESERVED_OPCODE:
                code += bytes([row.opcode, first, second])[: row.length]
    return bytes(code)


@needs_assembler
def test_assembler_gives_back_every_byte(tmp_path: Path):
    code = _program()
    lines = list(disassemble_image(code, [(START, len(code))]))
    # the assembler takes the target of a branch relative to a label of the same stretch only
    source = [".area CODE (ABS)", f".org {START}", "first:"]
    for line in lines:
        branches = {Operand.REL, Operand.ADDR11} & {*line.instruction.operands}
        before, _, target = line.text.rpartition("0x")
        source.append(f"\t{before}first+({int(target, 16)}-{START})" if branches else f"\t{line.text}")
    (tmp_path / "all.asm").write_text("\n".join(source) + "\n")
    subprocess.run(["sdas8051", "-plosgff", "all.asm"], cwd=tmp_path, check=True, capture_output=True)
    subprocess.run(["sdld", "-i", "all.ihx", "all.rel"], cwd=tmp_path, check=True, capture_output=True)
    image = read_hex(tmp_path / "all.ihx")
    found = image.code[: len(code)]
    wrong = [str(line) for line in lines if found[line.address : line.address + len(line.code)] != line.code]
    assert wrong == []
    assert image.used == ((START, len(code)),)


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ("85 81 30", "mov 0x30,sp"),  # the source is coded first
        ("B2 97", "cpl p1.7"),
        ("B0 D7", "anl c,/cy"),
        ("80 FE", "sjmp 0x0000"),
        ("A5", ".db 0xa5"),
        ("90 12 34", "mov dptr,#0x1234"),
        ("D2 2F", "setb 0x2f"),
    ],
)
def test_texts(code, text):
    assert disassemble(bytes.fromhex(code)).text == text


def test_branch_over_the_end_of_memory_begins_anew():
    code = bytearray(65536)
    code[0xFFFE:] = b"\x80\x10"
    assert disassemble(bytes(code), 0xFFFE).text == "sjmp 0x0010"


def test_address_outside_is_refused():
    with pytest.raises(FirmwareError, match="address: 65536"):
        disassemble(b"\x00", 65536)
