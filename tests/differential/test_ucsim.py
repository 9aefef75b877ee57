"""The peer itself: what it is asked and how its answers are read, on programs worked out by hand."""

import mcs51_programs as programs
import pytest
import ucsim

from firmware_model.hexfile import Image

pytestmark = pytest.mark.skipif(ucsim.absent(), reason="ucsim (s51) is not on PATH; package sdcc-ucsim")


def test_its_answers_are_read():
    # MOV A,#12H; ADD A,#34H; MOV 30H,A; MUL AB; SJMP $ take 1, 1, 1, 4 and 2 cycles
    image = Image.of(bytes.fromhex("7412 2434 F530 A4 80FE"))
    first, second, third = ucsim.follow(image, [0, 3, 3])
    assert (first.pc, first.instructions, first.cycles) == (0, 0, 0)
    assert first.iram == bytes(256)
    assert (second.pc, second.instructions, second.cycles) == (6, 3, 3)
    assert second.iram == bytes(0x30) + b"\x46" + bytes(0xCF)
    assert second.sfr[programs.ACC - 0x80] == 0x46
    assert second.sfr[programs.SP - 0x80] == 7
    assert (third.pc, third.instructions, third.cycles) == (7, 6, 11)
    assert third.sfr[programs.ACC - 0x80] == 0


def test_external_memory_is_read():
    # MOV DPTR,#1234H; MOV A,#77H; MOVX @DPTR,A
    memory = ucsim.xram_after(Image.of(bytes.fromhex("901234 7477 F0 80FE")), 3)
    assert (len(memory), memory[0x1234], sum(memory)) == (65536, 0x77, 0x77)


def test_a_long_run_is_timed():
    end, seconds = ucsim.timed(Image.of(bytes.fromhex("80FE")), 200_000)
    assert (end.pc, end.instructions, end.cycles) == (0, 200_000, 400_000)
    assert 0 < seconds < 60


def test_what_stops_it_is_said():
    # MOV SP,#0FFH; PUSH ACC
    image = Image.of(bytes.fromhex("7581FF C0E0") + bytes(8))
    with pytest.raises(ucsim.UcsimError, match=r"after 2 of 4 instructions, at 0x0005: .*overflow"):
        ucsim.follow(image, [4])


def test_a_peer_that_hangs_is_ended():
    with pytest.raises(ucsim.UcsimError, match=r"took longer than 0\.2 s"):
        ucsim.follow(Image.of(bytes.fromhex("80FE")), [100_000_000], timeout_s=0.2)


def test_programs_are_decided_by_their_seed():
    assert programs.program(5, 200) == programs.program(5, 200)
    assert programs.program(5, 200).code != programs.program(6, 200).code
    with pytest.raises(ValueError, match="use 65536"):
        programs.program(1, 40_000)


def test_programs_end_in_their_last_loop_and_meet_every_opcode():
    image = programs.program(2, 1500)
    looks = ucsim.follow(image, [1] * 1500)
    assert {image.code[look.pc] for look in looks} == programs.OPCODES
    end = ucsim.follow(image, [6000, 1])
    assert end[0].pc == end[1].pc
    assert image.code[end[0].pc : end[0].pc + 2] == b"\x80\xfe"
