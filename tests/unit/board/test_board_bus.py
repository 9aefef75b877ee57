"""Reads of the external bus: they stop the processor, and nothing may slip in between; the decoder chip's RST."""

import pytest

from firmware_model.hexfile import Image
from rtec.board import Board, Microcontroller
from rtec.injector import Design
from rtec.signal import EdgeStream

US = 1_000_000
MCU = Microcontroller.named("8051-12mhz")
LEVELS = (1, 3, 2, 0)


def program(main, routines=None):
    code = bytearray(b"\x32" * 0x40)
    code[:3] = b"\x02\x00\x40"
    for vector, routine in (routines or {}).items():
        code[vector : vector + len(routine)] = routine
    return Image.of(bytes(code) + bytes.fromhex(main))


@pytest.mark.parametrize(("nops", "seen"), [(0, 0x00), (1, 0x55)])
def test_one_instruction_comes_between_two_routines_even_where_it_reads_the_bus(nops, seen):
    """After RETI one more instruction is executed before the next call (manual, "How Interrupts Are Handled")."""
    # the routine of INT0 asks for that of INT1, which notes A: by then MOVX has been executed, if RETI led to it
    image = program(
        "78007455D288D28A75A885D289" + nops * "00" + "E20980FE",
        {0x03: b"\xd2\x8b\x0f\x32", 0x13: b"\xf5\x30\x32"},  # setb ie1; inc r7; reti - mov 30h,a; reti
    )
    board = Board(Design.C, MCU, image)
    board.idle(until_ps=100 * US)
    assert board.fault is None
    assert (int(board.cpu.iram[7]), int(board.cpu.iram[0x30])) == (1, seen)


def test_the_decoder_stands_at_zero_while_its_reset_is_low():
    image = program(
        "7801"  # mov r0,#1
        "E2F530"  # movx a,@r0; mov 30h,a
        "C296"  # clr p1.6
        "7A64DAFE"  # 200 us
        "E2F531"  # movx a,@r0; mov 31h,a
        "D296"  # setb p1.6
        "7A64DAFE"
        "E2F532"
        "80FE"
    )
    board = Board(Design.C, MCU, image)
    # three counts before the first read is too soon for the program; ten come in each wait
    times = [8 * US + 20 * US * k for k in range(20)]
    board.process(EdgeStream(times, [LEVELS[k % 4] for k in range(20)], initial=0), until_ps=1000 * US)
    before, low, after = (int(byte) for byte in board.cpu.iram[0x30:0x33])
    assert (before, low) == (0, 0)
    set_ps = 2 * US + US + 2 * US + US + US + US + 200 * US + 2 * US + US + US  # up to the end of SETB
    released = [t for t in times if set_ps < t < set_ps + 201 * US]
    assert abs(after - len(released)) <= 1
    assert after > 5
