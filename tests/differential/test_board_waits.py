"""What the processor goes over, and pins it takes on its way: one long run against one instruction at a time.

A run of one instruction has nothing to go over, and its pins are set between two instructions, not queued.
"""

import random

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from pin_drive import drive

from firmware_model import Mcs51, read_hex
from firmware_model.hexfile import Image
from rtec.board import Microcontroller
from rtec.injector import Design

TIMINGS = ["12-clock", "one-clock"]
TCON, TMOD, IE, IP, SCON, PCON, T2CON = 0x88, 0x89, 0xA8, 0xB8, 0x98, 0x87, 0xC8
TL0, TL1, TH0, TH1, RCAP2L, RCAP2H, TL2, TH2 = 0x8A, 0x8B, 0x8C, 0x8D, 0xCA, 0xCB, 0xCC, 0xCD
RETI = 0x32


def same(ours, peer):
    assert (ours.pc, ours.cycles, ours.instructions) == (peer.pc, peer.cycles, peer.instructions)
    np.testing.assert_array_equal(ours.iram, peer.iram)
    np.testing.assert_array_equal(ours.sfr, peer.sfr)
    np.testing.assert_array_equal(ours.xram, peer.xram)
    assert ours.fault == peer.fault


def at_once_and_by_steps(image, timing, until, changes=(), cuts=()):
    """Run to the cuts and to the end at once with the changes queued, and by single steps; compare at each cut."""
    whole, single = Mcs51(image, timing=timing), Mcs51(image, timing=timing)
    for cpu in (whole, single):
        cpu.record()
        if changes:
            drive(cpu, *(np.array(column) for column in zip(*changes, strict=True)))
    for cut in [*sorted(cuts), until]:
        whole.run(max(cut - whole.cycles, 0))
        while single.cycles < whole.cycles and single.fault is None:
            single.run(1)
        same(whole, single)
    np.testing.assert_array_equal(whole.port_rows(), single.port_rows())
    assert whole.sent() == single.sent()


# --- the images


def asked(cpu):
    cpu.xram[0xFF12] = 4


@pytest.mark.one_in(5)
@pytest.mark.parametrize("name", ["8051-12mhz", "one-clock-25mhz"])
@pytest.mark.parametrize("design", list(Design))
@pytest.mark.parametrize("gap", [3, 17, 150])
def test_the_images_wait_as_if_by_steps(design, name, gap):
    draw = random.Random(f"{design} {name} {gap}")  # noqa: S311 - no secret
    processor = Microcontroller.named(name)
    image = read_hex(processor.image(design))
    reading = 1000 if processor.timing == "12-clock" else 1041 * 12
    whole, single = Mcs51(image, timing=processor.timing), Mcs51(image, timing=processor.timing)
    cycle, state, enable, trip = 0, 0, 0, 1
    for part in range(7):
        until = (part + 1) * reading + draw.randrange(20)
        changes, cycle = [], max(cycle, whole.cycles + 1)
        while cycle < until:
            cycle += max(1, round(gap * draw.uniform(0.2, 1.8)))
            if draw.random() < 0.95:
                state = (state + (1 if part % 3 else -1)) % 4
            elif draw.random() < 0.5:
                trip ^= 1
            a, b = ((0, 0), (1, 0), (1, 1), (0, 1))[state]
            circuit = (a | b) if design is Design.ORIGINAL else a ^ b
            changes.append((cycle, 3, 0xC2 | enable | circuit << 2 | trip << 3 | a << 4 | b << 5))
        for cpu in (whole, single):
            # the words of the PC, and a decoder that has moved
            cpu.xram[0xFF10:0xFF13] = (0, 0, 4) if part < 2 else (min(part - 2, 3), 0, 0)
            cpu.xram[0xFF01] = 10 * part if gap > 10 else 0
            drive(cpu, *(np.array(column) for column in zip(*changes, strict=True)))
        whole.run(until - whole.cycles)
        while single.cycles < whole.cycles:
            single.run(1)
        same(whole, single)
    assert whole.fault is None


# --- small programs of loops


def turn(draw):
    """Return bytes that a turn may do, jumps forward within it among them."""
    one = [
        bytes([0x00]),
        bytes([0x05, draw(st.integers(0x30, 0x33))]),  # INC of internal RAM
        bytes([0x15, draw(st.integers(0x30, 0x33))]),
        bytes([0x75, 0x34, 0x55]),  # MOV 34H,#55H: the same again and again
        bytes([0x90, 0x12, 0x34, 0xE0, 0x04, 0xF0]),  # count in external RAM
        bytes([0x90, 0x12, 0x35, 0x74, 0x07, 0xF0]),  # the same byte into external RAM
        bytes([0x90, 0x12, 0x36, 0xE0]),  # only read it
        bytes([0xB2, draw(st.sampled_from([0x96, 0x97, 0xA0, 0x82]))]),  # CPL of P1.6, P1.7, P2.0, P0.2
        bytes([0xB2, 0x96, 0xB2, 0x96]),  # there and back
        bytes([0xB2, draw(st.sampled_from([0xB2, 0xB3, 0xB4, 0xB5, 0x90]))]),  # CPL of an input's latch
        bytes([0xE5, draw(st.sampled_from([TL0, TL1, TL2, TH0]))]),  # read a count
        bytes([0xC0, TL0, 0xD0, 0x35]),  # ... by the stack
        bytes([0x85, TL2, 0x36]),  # MOV 36H,TL2
        bytes([0xE5, TCON]),
        bytes([0xE5, draw(st.sampled_from([SCON, T2CON, 0x99]))]),
        bytes([0x05, TL1]),  # count a timer by hand
        bytes([0xC0, 0xE0, 0xD0, 0xE0]),
        bytes([0x12, 0x00, 0x38]),  # LCALL of a routine that returns at once
        bytes([0xF4]),  # CPL A
        bytes([0xB3]),
        bytes([0x93]),
        bytes([0xE5, 0x90]),  # port 1
        bytes([0xE5, 0xB0]),
        bytes([0x30, draw(st.sampled_from([0x92, 0x93, 0xB2, 0xB4])), 0x01, 0x04]),  # JNB pin,on; INC A
        bytes([0x10, draw(st.sampled_from([0x8D, 0x8F, 0x89, 0x8B])), 0x00]),  # JBC flag,on
        bytes([0x20, draw(st.sampled_from([0x8D, 0x8F, 0xCF, 0x99, 0x98])), 0x02, 0x80, 0x00]),  # inner jumps
        bytes([0x7B, draw(st.integers(1, 20)), 0xDB, 0xFE]),  # a delay
        bytes([0xA2, 0x8D, 0x92, 0x00]),  # MOV C,TF0; MOV 20H.0,C
        bytes([0xC2, 0xAF, 0xD2, 0xAF]),  # CLR EA; SETB EA
    ]
    return draw(st.sampled_from(one))


def close(draw, length):
    """Return the branch that closes a turn of ``length`` bytes."""

    def back(size):
        return (-length - size) & 255

    kind = draw(st.sampled_from(["jnb", "jb", "jbc", "djnz r", "djnz", "jz", "jnz", "jnc", "cjne", "sjmp"]))
    flag = draw(st.sampled_from([0x8D, 0x8F, 0x89, 0x8B, 0xCF, 0x98, 0x99, 0x92, 0xB2, 0xB5, 0xE0, 0x00]))
    return {
        "jnb": bytes([0x30, flag, back(3)]),
        "jb": bytes([0x20, flag, back(3)]),
        "jbc": bytes([0x10, flag, back(3)]),
        "djnz r": bytes([0xDC, back(2)]),
        "djnz": bytes([0xD5, 0x37, back(3)]),
        "jz": bytes([0x60, back(2)]),
        "jnz": bytes([0x70, back(2)]),
        "jnc": bytes([0x50, back(2)]),
        "cjne": bytes([0xB4, 0x13, back(3)]),
        "sjmp": bytes([0x80, back(2)]),
    }[kind]


@st.composite
def programs(draw):
    code = bytearray([RETI] * 0x40)
    code[0:3] = b"\x02\x00\x40"
    for vector in (0x0B, 0x13, 0x1B):
        code[vector : vector + 3] = bytes([0x05, draw(st.integers(0x30, 0x3A)), RETI])
    code[0x23:0x26] = b"\xc2\x98\x32"
    code[0x2B:0x2E] = b"\xc2\xcf\x32"
    code[0x38] = 0x22
    main = b""
    ie = draw(st.sampled_from([0, 0, 0x82, 0x8A, 0x85, 0xA0, 0x90, 0xBF]))
    values = {
        # no gates: one that changes within an instruction that polls a flag is off by a count (docs/fidelity.md)
        TMOD: draw(st.sampled_from([0x21, 0x22, 0x11, 0x12, 0x00, 0x23, 0x13, 0x66, 0x15])),
        PCON: draw(st.sampled_from([0, 0x80])),
        SCON: draw(st.sampled_from([0x50, 0x40, 0x90, 0x10, 0xF0])),
        TH0: draw(st.integers(0, 255)),
        TH1: draw(st.integers(0, 255)),
        TL0: draw(st.integers(0, 255)),
        TL1: draw(st.integers(0, 255)),
        RCAP2L: draw(st.integers(0, 255)),
        RCAP2H: draw(st.sampled_from([0xFE, 0xFF])),
        T2CON: draw(st.sampled_from([0, 4, 4, 0x34, 0x0C, 0x0D, 0x06])),
        TCON: draw(st.sampled_from([0x50, 0x55, 0x10, 0x41, 0x04])),
        IP: draw(st.sampled_from([0, 0x02, 0x04])),
        IE: ie,
    }
    for register, value in values.items():
        main += bytes([0x75, register, value])
    if draw(st.booleans()):
        main += bytes([0x75, 0x99, 0xA5])  # send
    if draw(st.booleans()):
        main += bytes([0x75, 0x30 + draw(st.integers(0, 7)), 0xF0])
    again = len(code) + len(main)
    for _ in range(draw(st.integers(1, 3))):
        body = b"".join(turn(draw) for _ in range(draw(st.integers(0, 3))))
        main += body + close(draw, len(body))
        if draw(st.booleans()):
            main += bytes([0xC2, draw(st.sampled_from([0x8D, 0x8F, 0x89, 0xCF, 0x99]))])  # clear a flag
    if draw(st.booleans()) and len(code) + len(main) - again < 120:  # an outer loop closed by a branch
        main += bytes([0xDD, (again - len(code) - len(main) - 2) & 255])
    main += b"\x02" + again.to_bytes(2)
    return Image.of(bytes(code) + main)


@st.composite
def pin_changes(draw, until):
    """Changes of P1 and P3, many in a few cycles, some in the same one."""
    rows, cycle, levels = [], 0, {1: 255, 3: 255}
    for _ in range(draw(st.integers(0, 25))):
        cycle += draw(st.sampled_from([0, 1, 1, 2, 3, 5, 8, 60, 400]))
        port = draw(st.sampled_from([1, 3, 3, 3]))
        levels[port] ^= draw(st.sampled_from([1, 2, 4, 8] if port == 1 else [4, 4, 8, 16, 32, 12]))
        if cycle < until:
            rows.append((cycle, port, levels[port]))
    return rows


@pytest.mark.parametrize("timing", TIMINGS)
@settings(max_examples=120, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_loops_end_as_if_by_steps(timing, data):
    until = 2500
    image = data.draw(programs())
    changes = data.draw(pin_changes(until))
    cuts = data.draw(st.lists(st.integers(1, until), max_size=3))
    at_once_and_by_steps(image, timing, until, changes, cuts=cuts)
