"""Random MCS-51 programs that run forwards through all 255 opcodes, for comparing simulators.

The encodings are written here from the User's Manual (MCS 51 Microcontroller Family User's Manual, Intel 1994,
chapter 2, "Instruction Set"), apart from any simulator's table. Jumps, calls and returns go forwards, so that a
program ends, in a loop on itself; stack instructions find a stack pointer that leaves room. Registers of peripherals
are neither read nor written, so that nothing but the instructions acts; what a peer is known to do wrong
(known_divergences.toml) has no consequences that last.
"""

from __future__ import annotations

import random
from dataclasses import dataclass

from firmware_model.hexfile import CODE_BYTES, Image

RESERVED = 0xA5
_PORTS = (0x80, 0x90, 0xA0, 0xB0)
SP, DPL, DPH, PSW, ACC, B = 0x81, 0x82, 0x83, 0xD0, 0xE0, 0xF0
REGISTERS = (*_PORTS, SP, DPL, DPH, PSW, ACC, B)
"""Addresses of the registers that the programs use, and no peripheral changes."""
_BIT_REGISTERS = (*_PORTS, PSW, ACC, B)

_OPERANDS = {
    # direct d, immediate i, bit b, relative r, 11 and 16 bits of an address a and l, immediate of 16 bits w
    0x02: "l", 0x12: "l", 0x90: "w",
    0x10: "br", 0x20: "br", 0x30: "br",
    0x40: "r", 0x50: "r", 0x60: "r", 0x70: "r", 0x80: "r",
    0xA0: "b", 0xB0: "b", 0x72: "b", 0x82: "b", 0x92: "b", 0xA2: "b", 0xB2: "b", 0xC2: "b", 0xD2: "b",
    0xC0: "d", 0xD0: "d", 0x42: "d", 0x52: "d", 0x62: "d",
    0x43: "di", 0x53: "di", 0x63: "di", 0x75: "di", 0x85: "dd",
    0x24: "i", 0x34: "i", 0x44: "i", 0x54: "i", 0x64: "i", 0x74: "i", 0x94: "i", 0xB4: "ir",
    0x05: "d", 0x15: "d", 0x25: "d", 0x35: "d", 0x45: "d", 0x55: "d", 0x65: "d", 0x95: "d", 0xC5: "d", 0xE5: "d",
    0xF5: "d", 0xB5: "dr", 0xD5: "dr",
}  # fmt: skip
for _low in range(6, 16):
    _OPERANDS |= {0x70 | _low: "i", 0x80 | _low: "d", 0xA0 | _low: "d", 0xB0 | _low: "ir"}
    if _low >= 8:
        _OPERANDS[0xD0 | _low] = "r"
for _page in range(8):
    _OPERANDS |= {_page << 5 | 0x01: "a", _page << 5 | 0x11: "a"}

_PUSHING = {0x12, 0xC0, *(page << 5 | 0x11 for page in range(8))}
_RETURNS = {0x22, 0x32}
_EXTERNAL = {0xE0, 0xE2, 0xE3, 0xF0, 0xF2, 0xF3}
_MOV_DIRECT, _MOV_A, _MOV_DPTR, _JMP, _SJMP, _POP = 0x75, 0x74, 0x90, 0x73, 0x80, 0xD0
_DIRECT_WRITES = {0x05, 0x15, 0x42, 0x43, 0x52, 0x53, 0x62, 0x63, 0x75, 0x85, 0x86, 0x87, 0xC5, 0xD0, 0xD5, 0xF5}
_DIRECT_WRITES |= {0x88 | register for register in range(8)}
_BIT_WRITES = {0x10, 0x92, 0xB2, 0xC2, 0xD2}
_PARITY_BIT, _BANK_BITS = 0xD0, {0xD3, 0xD4}
_CODE_AT_DPTR = 0x93
_ANL_DIRECT = 0x53
_AT_RI = 0x06  # the two columns of indirect addressing
OPCODES = frozenset(range(256)) - {RESERVED}


@dataclass(slots=True)
class _Unit:
    """Instructions that belong together; ``jump`` names how many units ahead the last one goes."""

    code: bytearray
    opcode: int
    kind: str = ""
    ahead: int = 0


def program(seed: int, units: int, *, ram_bytes: int = 256) -> Image:
    """Return a program of so many random instructions behind a start that fills the RAM.

    Parameters
    ----------
    seed
        Decides everything.
    units
        Random instructions, some of them with others before that prepare them; all opcodes come equally often, and
        some instructions are jumped over.
    ram_bytes
        Internal RAM of the part, 128 or 256; with 128, stack and pointers stay below.

    Raises
    ------
    ValueError
        More than fits into 64 KiB.
    """
    draw = random.Random(seed)  # noqa: S311 - no secret
    deck: list[int] = []
    body = _start(draw, ram_bytes)
    for _ in range(units):
        if not deck:
            deck = sorted(OPCODES)
            draw.shuffle(deck)
        body.append(_unit(draw, deck.pop(), ram_bytes))
    body += [_Unit(bytearray([_SJMP, 0xFE]), _SJMP)] * 5  # as far as a jump goes
    length = sum(len(unit.code) for unit in body)
    if length > CODE_BYTES:
        raise ValueError(f"{units} instructions take {length} bytes; use {CODE_BYTES}")
    code = _placed(body)
    whole = bytes(code) + draw.randbytes(CODE_BYTES - len(code))  # MOVC reads anywhere
    return Image(code=whole, used=((0, CODE_BYTES),), source=f"random program, seed {seed}")


def shown(image: Image, pc: int) -> str:
    """Return the instruction at an address as numbers, for messages."""
    opcode = image.code[pc]
    length = 1 + sum(2 if kind in "lw" else 1 for kind in _OPERANDS.get(opcode, ""))
    return image.code[pc : pc + length].hex(" ")


def _start(draw: random.Random, ram_bytes: int) -> list[_Unit]:
    units = [_Unit(bytearray([_MOV_DIRECT, at, draw.randrange(256)]), _MOV_DIRECT) for at in range(2, 0x80)]
    for at in range(0x80, ram_bytes):
        units.append(_Unit(bytearray([0x78, at, 0x76, draw.randrange(256)]), 0x76))  # MOV R0,#at; MOV @R0,#value
    units += [_Unit(bytearray([_MOV_DIRECT, at, draw.randrange(256)]), _MOV_DIRECT) for at in REGISTERS]
    return units


def _unit(draw: random.Random, opcode: int, ram_bytes: int) -> _Unit:
    before, ahead = _preparation(draw, opcode, ram_bytes), draw.randint(1, 4)
    if opcode in _RETURNS:
        top = draw.randint(0x08, 0x7F)
        before += bytes([_MOV_DIRECT, SP, top, _MOV_DIRECT, top, 0, _MOV_DIRECT, top - 1, 0])
        return _Unit(before + bytes([opcode]), opcode, "return", ahead)
    if opcode == _JMP:
        before += bytes([_MOV_DPTR, 0, 0, _MOV_A, draw.randrange(256)])
        return _Unit(before + bytes([opcode]), opcode, "computed", ahead)
    code, kind = before + bytes([opcode]), ""
    branches = "r" in _OPERANDS.get(opcode, "")
    at = -1
    for operand in _OPERANDS.get(opcode, ""):
        if operand == "d":
            at = _direct(draw, {PSW} if branches and opcode in _DIRECT_WRITES else set())
            code.append(at)
        elif operand == "b":
            at = _bit(draw, {_PARITY_BIT, *_BANK_BITS} if branches and opcode in _BIT_WRITES else set())
            code.append(at)
        elif operand == "i":
            code.append(draw.randrange(256))
        elif operand == "w":
            code += draw.randbytes(2)
        else:
            kind = operand
            code += bytes(2 if operand == "l" else 1)
    if (at == PSW and opcode in _DIRECT_WRITES) or (at == _PARITY_BIT and opcode in _BIT_WRITES):
        code += bytes([_MOV_A, draw.randrange(256)])  # known_divergences.toml, "parity"
    if at in _BANK_BITS and opcode in _BIT_WRITES:
        code += bytes([_ANL_DIRECT, PSW, 0xFF])  # known_divergences.toml, "register bank"
    return _Unit(code, opcode, kind, ahead)


def _preparation(draw: random.Random, opcode: int, ram_bytes: int) -> bytearray:
    if opcode in _PUSHING or opcode == _POP:
        return bytearray([_MOV_DIRECT, SP, draw.randint(1, ram_bytes - 3)])
    if opcode & 0x0E == _AT_RI and ram_bytes < 256:
        return bytearray([_ANL_DIRECT, PSW, 0xE7, _ANL_DIRECT, opcode & 1, ram_bytes - 1])  # bank 0, and its pointer
    if opcode in _EXTERNAL:
        return bytearray([_MOV_DIRECT, _PORTS[0], 0xFF])  # known_divergences.toml, "port 0"
    if opcode == _CODE_AT_DPTR:
        return bytearray([_MOV_DIRECT, DPH, draw.randrange(0xFF)])  # known_divergences.toml, "code beyond 64 KiB"
    return bytearray()


def _direct(draw: random.Random, without: set[int]) -> int:
    return draw.choice([at for at in REGISTERS if at not in without]) if draw.random() < 0.4 else draw.randrange(0x80)


def _bit(draw: random.Random, without: set[int]) -> int:
    registers = [at + k for at in _BIT_REGISTERS for k in range(8) if at + k not in without]
    return draw.choice(registers) if draw.random() < 0.5 else draw.randrange(0x80)


def _placed(units: list[_Unit]) -> bytearray:
    """Put the units one behind the other and let each jump know its target."""
    places = [0]
    for unit in units:
        places.append(places[-1] + len(unit.code))
    code = bytearray()
    for k, unit in enumerate(units):
        if unit.kind:
            _aim(unit, places[k + 1], places[k + unit.ahead])
        code += unit.code
    return code


def _aim(unit: _Unit, behind: int, target: int) -> None:
    if unit.kind == "r":
        unit.code[-1] = target - behind
    elif unit.kind == "l":
        unit.code[-2:] = target.to_bytes(2)
    elif unit.kind == "a" and target >> 11 == behind >> 11:
        unit.code[-2:] = bytes([target >> 8 << 5 & 0xE0 | unit.opcode & 0x1F, target & 0xFF])
    elif unit.kind == "a":  # the page ends here, which the instruction cannot leave
        unit.code[-2:] = bytes([_SJMP, target - behind])
    elif unit.kind == "return":
        unit.code[5], unit.code[8] = target >> 8, target & 0xFF
    else:
        unit.code[1:3] = ((target - unit.code[4]) % CODE_BYTES).to_bytes(2)
