"""Loops that wait: where the processor goes over turns that change nothing, it ends when ucsim does."""

import random

import pytest
import ucsim

from firmware_model import Mcs51
from firmware_model.hexfile import Image

TCON, TMOD, TL0, TL1, TH0, TH1 = range(0x88, 0x8E)
PCON, SCON, SBUF, IE, IP, T2CON, RCAP2L, RCAP2H, TL2, TH2 = 0x87, 0x98, 0x99, 0xA8, 0xB8, 0xC8, 0xCA, 0xCB, 0xCC, 0xCD
RETI = b"\x32"

# a turn that waits, as bytes; branches lead back to its begin
WAITS = {
    "flag of timer 0": "30 8D FD C2 8D",  # JNB TF0,$; CLR TF0
    "flag of timer 2": "30 CF FD C2 CF",
    "delay": "7E 00 DE FE",  # MOV R6,#0; DJNZ R6,$
    "delay of a word": "7D 04 7E 00 DE FE DD FA",
    "turns counted": "0F BF 00 FC",  # INC R7; CJNE R7,#0,back
}


def waiting_program(draw, name):
    """Return a program that waits again and again, all timers running, routines about."""
    code = bytearray(0x40)
    code[:3] = b"\x02\x00\x40"
    for vector, routine in ((0x0B, b"\x05\x30"), (0x13, b"\x05\x31\x05\x30"), (0x23, b"\xc2\x98\x05\x32")):
        code[vector : vector + len(routine) + 1] = routine + RETI
    enabled = draw.choice([0x00, 0x00, 0x82, 0x86])
    if "timer 0" in name:
        enabled &= ~0x02  # the routine would take the flag away
    settings = [(TMOD, draw.choice([0x22, 0x21, 0x12, 0x11])), (PCON, draw.choice([0, 0x80])), (SCON, 0x40)]
    settings += [(register, draw.randrange(256)) for register in (TL0, TL1, TH0, TH1, TL2, TH2)]
    settings += [(RCAP2L, draw.randrange(256)), (RCAP2H, 0xFE), (0x30, 0), (IE, enabled), (T2CON, 4), (TCON, 0x55)]
    main = b"".join(bytes([0x75, *one]) for one in settings)
    again = len(code) + len(main)
    main += bytes.fromhex(WAITS[name]) + b"\x05\x40"  # INC 40H behind it
    return Image.of(bytes(code) + main + b"\x02" + again.to_bytes(2))


@pytest.mark.skipif(ucsim.absent(), reason="ucsim (s51) is not on PATH; package sdcc-ucsim")
@pytest.mark.parametrize("name", WAITS)
def test_waits_end_when_ucsim_has_them(name):
    image = waiting_program(random.Random(4), name)  # noqa: S311 - no secret
    looks = ucsim.follow(image, [997] * 12)
    cpu = Mcs51(image)
    for look in looks:
        cpu.run(look.cycles - cpu.cycles)
        assert (cpu.pc, cpu.cycles, cpu.instructions) == (look.pc, look.cycles, look.instructions)
        assert cpu.iram.tobytes() == look.iram
