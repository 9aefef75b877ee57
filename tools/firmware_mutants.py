"""Mutants of the four firmware images: one instruction each, drawn from all that some rules make, and their verdicts.

python -m tools.firmware_mutants
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from firmware_model import Image, read_hex
from firmware_model.isa.disassembler import Line, disassemble, disassemble_image
from firmware_model.isa.table import Operand
from rtec.board import Microcontroller
from rtec.injector import Design
from rtec.verify.bench import Bench, Failed
from rtec.verify.firmware.check import FirmwareCheckPlan, _Campaign, check_firmware
from rtec.verify.firmware.handshake import START

CHIP = Microcontroller.named("8051-12mhz")
SEED = 43
OF_EACH_DESIGN = 30

_INVERTED = {0x20: 0x30, 0x30: 0x20, 0x40: 0x50, 0x50: 0x40, 0x60: 0x70, 0x70: 0x60}
"""JB and JNB, JC and JNC, JZ and JNZ."""
_OTHER_LEVEL = {0xC2: 0xD2, 0xD2: 0xC2, 0xC3: 0xD3, 0xD3: 0xC3}
"""CLR and SETB, of a bit and of the carry."""
_OTHER_SUM = (
    {0x24 + k: 0x34 + k for k in (0, 1, *range(4, 12))}  # ADD and ADDC
    | {0x34 + k: 0x24 + k for k in (0, 1, *range(4, 12))}
    | {0x94 + k: 0x34 + k for k in (0, 1, *range(4, 12))}  # SUBB as ADDC
    | {0x04 + k: 0x14 + k for k in range(12)}  # INC as DEC
    | {0x44 + k: 0x54 + k for k in range(2)}  # ORL and ANL
    | {0x54 + k: 0x44 + k for k in range(2)}
    | {0xA2: 0xB3, 0xB3: 0xC3}  # MOV C,bit as CPL C is longer: only CPL C as CLR C
)
del _OTHER_SUM[0xA2]
_JUMPS = ("SJMP", "AJMP", "LJMP", "JMP", "RET", "RETI")


@dataclass(frozen=True, slots=True, kw_only=True)
class FirmwareMutant:
    """One instruction of a shipped image in other bytes."""

    design: Design
    rule: str
    before: Line
    code: bytes = field(repr=False)

    @property
    def name(self) -> str:
        """Return what it is called on the page."""
        address = self.before.address
        after = ", ".join(line.text for line in disassemble_image(self.code, ((0, len(self.code)),)))
        if "rel" in (operand.value for operand in self.before.instruction.operands):
            after = disassemble(bytes(address) + self.code, address).text
        after = "nop" if set(self.code) == {0} else after
        return f"{self.design.value} {address:04X}h: {self.before.text} → {after}"

    @property
    def image(self) -> Image:
        """Return the whole image."""
        shipped = _shipped(self.design)
        at = self.before.address
        code = shipped.code[:at] + self.code + shipped.code[at + len(self.code) :]
        return Image(code=code, used=shipped.used, source=self.name)


@cache
def _shipped(design: Design) -> Image:
    return read_hex(CHIP.image(design))


def rules(line: Line) -> Iterator[tuple[str, bytes]]:
    """Yield every mutation of an instruction: the rule and the new bytes."""
    code, row = line.code, line.instruction
    if row.opcode in _INVERTED:
        yield "condition inverted", bytes([_INVERTED[row.opcode]]) + code[1:]
    if Operand.REL in row.operands and row.mnemonic != "SJMP":
        yield "never jumps", code[:-1] + b"\x00"
    if row.opcode in _OTHER_LEVEL:
        yield "SETB and CLR", bytes([_OTHER_LEVEL[row.opcode]]) + code[1:]
    if row.opcode in _OTHER_SUM:
        yield "another operation", bytes([_OTHER_SUM[row.opcode]]) + code[1:]
    if row.mnemonic not in _JUMPS and Operand.REL not in row.operands and row.mnemonic != "NOP":
        yield "missing", bytes(len(code))
    at = 1  # of the operand's bytes
    for operand in row.operands if row.operands != (Operand.DIRECT, Operand.DIRECT) else row.operands[::-1]:
        if operand is Operand.IMMEDIATE:
            for by in (1, -1):
                yield "constant ±1", code[:at] + bytes([(code[at] + by) & 0xFF]) + code[at + 1 :]
        elif operand is Operand.BIT:
            yield "the bit beside it", code[:at] + bytes([code[at] ^ 1]) + code[at + 1 :]
        elif operand is Operand.DIRECT:
            yield "the byte beside it", code[:at] + bytes([code[at] ^ 1]) + code[at + 1 :]
        at += {Operand.IMMEDIATE16: 2, Operand.ADDR16: 2}.get(
            operand, int(operand in (Operand.IMMEDIATE, Operand.BIT, Operand.NOT_BIT, Operand.DIRECT, Operand.REL))
        )


def all_mutants(design: Design) -> list[FirmwareMutant]:
    """Return everything that the rules make of an image; its tables of data are left out."""
    shipped = _shipped(design)
    used = shipped.used[:-3] if design is Design.B else shipped.used
    lines = [line for line in disassemble_image(shipped.code, used)]
    if design is Design.B:
        lines = [line for line in lines if line.address < used[-1][1] - 4]
    return [
        FirmwareMutant(design=design, rule=rule, before=line, code=code)
        for line in lines
        for rule, code in rules(line)
    ]


def drawn() -> list[FirmwareMutant]:
    """Return those that are tried: of each design as many, of each rule as many as there are, one at an address."""
    generator = np.random.default_rng(SEED)
    chosen: list[FirmwareMutant] = []
    for design in Design:
        all_of_it = all_mutants(design)
        names = sorted({mutant.rule for mutant in all_of_it})
        taken: set[int] = set()
        while len(taken) < OF_EACH_DESIGN:
            rule = names[len(taken) % len(names)]
            left = [m for m in all_of_it if m.rule == rule and m.before.address not in taken]
            mutant = left[int(generator.integers(len(left)))]
            taken.add(mutant.before.address)
            chosen.append(mutant)
    return chosen


def found_by(mutant: FirmwareMutant) -> str:
    """Return the first check of `rtec firmware check` that fails, the quick ones tried first; "" where none does."""
    plan = FirmwareCheckPlan(image=mutant.image, design=mutant.design, microcontroller=CHIP)
    quick = of_the_box(plan)
    return quick or next((check.name for check in check_firmware(plan).checks if check.passed is False), "")


def of_the_box(plan: FirmwareCheckPlan) -> str:
    """Return the first check that fails, without those of the insertions; "" where none does."""
    bench = Bench(plan.design, plan.microcontroller, plan.image, hold_latch=True)
    for name, check in START.items():
        try:
            check(bench)
        except Failed:
            return name
    campaign = _Campaign(plan, lambda share: None, bench)
    campaign._of_the_box(bench.keep())
    return next((check.name for check in campaign.checks if check.passed is False), "")


def notes() -> dict[str, tuple[str, str]]:
    """Return of each survivor what it is and why, as firmware_mutants.toml says."""
    rows = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))["survivors"]
    return {row["name"]: (row["is"], row["why"]) for row in rows}


def main() -> None:
    """Print what finds each mutant."""
    for mutant in drawn():
        sys.stdout.write(f"{mutant.rule:18} {mutant.name}: {found_by(mutant) or 'NOTHING'}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
