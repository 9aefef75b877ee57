"""Loops that wait: the processor goes over turns that change nothing, and must end where it does turn by turn.

Turn by turn means one instruction a run, where there is nothing to go over; that way of running is held to ucsim in
the other files, and here again where ucsim agrees on the timing.
"""

import random

import numpy as np
import pytest
import ucsim
from pin_drive import drive

from firmware_model import Mcs51
from firmware_model.hexfile import Image

TCON, TMOD, TL0, TL1, TH0, TH1 = range(0x88, 0x8E)
PCON, SCON, SBUF, IE, IP, T2CON, RCAP2L, RCAP2H, TL2, TH2 = 0x87, 0x98, 0x99, 0xA8, 0xB8, 0xC8, 0xCA, 0xCB, 0xCC, 0xCD
RETI = b"\x32"

# a turn that waits, as bytes; branches lead back to its begin
WAITS = {
    "flag of timer 0": "30 8D FD C2 8D",  # JNB TF0,$; CLR TF0
    "flag of timer 1, with NOP": "00 30 8F FC C2 8F",
    "flag of timer 2": "30 CF FD C2 CF",
    "clearing the flag": "10 8D 02 80 FB",  # JBC TF0,on; SJMP back
    "edge at INT0": "30 89 FD C2 89",  # JNB IE0,$
    "pin": "20 95 FD",  # JB P1.5,$
    "pin low": "30 95 FD",
    "port and mask": "E5 90 54 20 70 FA",  # MOV A,P1; ANL A,#20H; JNZ
    "count": "E5 8A 30 E4 FB",  # MOV A,TL0; JNB ACC.4,back
    "count of timer 1": "E5 8B 30 E3 FB",
    "a byte that a routine sets": "E5 30 60 FC 75 30 00",  # MOV A,30H; JZ; MOV 30H,#0
    "delay": "7E 00 DE FE",  # MOV R6,#0; DJNZ R6,$
    "delay of a word": "7D 04 7E 00 DE FE DD FA",
    "turns counted": "0F BF 00 FC",  # INC R7; CJNE R7,#0,back
    "turns counted outside": "90 12 34 E0 04 F0 70 FB",  # MOVX A,@DPTR; INC A; MOVX; JNZ
    "sent": "75 99 55 30 99 FD C2 99",  # MOV SBUF,#55H; JNB TI,$
    "push and pop": "C0 E0 D0 E0 30 8D F9 C2 8D",
    "toggling": "B2 96 30 8D FB C2 8D",  # CPL P1.6; JNB TF0,back
}


def waiting_program(draw, names):
    """Return a program that does these waits again and again with all timers running, routines and pins about."""
    code = bytearray(0x40)
    code[:3] = b"\x02\x00\x40"
    for vector, routine in ((0x0B, b"\x05\x30"), (0x13, b"\x05\x31\x05\x30"), (0x23, b"\xc2\x98\x05\x32")):
        code[vector : vector + len(routine) + 1] = routine + RETI
    enabled = draw.choice([0x00, 0x00, 0x82, 0x86])
    if "a byte that a routine sets" in names:
        enabled = 0x86
    if any("timer 0" in name or name in {"clearing the flag", "push and pop", "toggling"} for name in names):
        enabled &= ~0x02  # the routine would take the flag away
    settings = [(TMOD, draw.choice([0x22, 0x21, 0x12, 0x11])), (PCON, draw.choice([0, 0x80])), (SCON, 0x40)]
    settings += [(register, draw.randrange(256)) for register in (TL0, TL1, TH0, TH1, TL2, TH2)]
    settings += [(RCAP2L, draw.randrange(256)), (RCAP2H, 0xFE), (0x30, 0), (IE, enabled), (T2CON, 4), (TCON, 0x55)]
    main = b"".join(bytes([0x75, *one]) for one in settings)
    again = len(code) + len(main)
    main += b"".join(bytes.fromhex(WAITS[name]) + b"\x05\x40" for name in names)  # INC 40H behind each
    return Image.of(bytes(code) + main + b"\x02" + again.to_bytes(2))


def pins(draw, until):
    """Return changes of P1.5, INT0 and INT1 at random cycles."""
    cycles = sorted(draw.randrange(20, until) for _ in range(until // 150))
    rows, levels = [], {1: 0xFF, 3: 0xFF}
    for cycle in cycles:
        port, bit = draw.choice([(1, 0x20), (1, 0x20), (3, 0x04), (3, 0x08)])
        levels[port] ^= bit
        rows.append((cycle, port, levels[port]))
    return zip(*rows, strict=True)


def states(cpu):
    return cpu.pc, cpu.cycles, cpu.instructions, cpu.iram.tobytes(), cpu.sfr.tobytes(), cpu.pins.tobytes()


@pytest.mark.one_in(5)
@pytest.mark.parametrize("timing", ["12-clock", "one-clock"])
@pytest.mark.parametrize("seed", range(12))
def test_going_over_turns_changes_nothing(seed, timing):
    draw = random.Random(seed)  # noqa: S311 - no secret
    image = waiting_program(draw, draw.sample(sorted(WAITS), 4))
    until = 30_000
    changes = [np.array(column) for column in pins(draw, until)]
    whole, single = Mcs51(image, timing=timing), Mcs51(image, timing=timing)
    for cpu in (whole, single):
        cpu.record()
        drive(cpu, *changes)
    stops = sorted(draw.randrange(until) for _ in range(12))
    for stop in [*stops, until]:
        whole.run(max(stop - whole.cycles, 0))
        while single.cycles < whole.cycles:
            single.run(1)
        assert states(whole) == states(single)
    np.testing.assert_array_equal(whole.port_rows(), single.port_rows())
    np.testing.assert_array_equal(whole.xram, single.xram)
    assert whole.sent() == single.sent()
    assert whole.fault is None


@pytest.mark.parametrize("name", WAITS)
def test_each_wait_comes_to_its_end(name):
    # so that what is compared above is no loop for ever
    draw = random.Random(1)  # noqa: S311 - no secret
    image = waiting_program(draw, [name])
    cpu = Mcs51(image)
    drive(cpu, *pins(draw, 400_000))
    cpu.run(400_000)
    assert cpu.iram[0x40] > 0, cpu.pc


@pytest.mark.skipif(ucsim.absent(), reason="ucsim (s51) is not on PATH; package sdcc-ucsim")
@pytest.mark.parametrize("name", ["flag of timer 0", "flag of timer 2", "delay", "delay of a word", "turns counted"])
def test_waits_end_when_ucsim_has_them(name):
    image = waiting_program(random.Random(4), [name])  # noqa: S311 - no secret
    looks = ucsim.follow(image, [997] * 12)
    cpu = Mcs51(image)
    for look in looks:
        cpu.run(look.cycles - cpu.cycles)
        assert (cpu.pc, cpu.cycles, cpu.instructions) == (look.pc, look.cycles, look.instructions)
        assert cpu.iram.tobytes() == look.iram
