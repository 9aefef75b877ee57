"""The processor beyond arithmetic: memory, ports, timers, interrupts, serial port, power, faults.

Expectations are figures and rules of the MCS-51 User's Manual (1994), worked out by hand in each test.
"""

from __future__ import annotations

import numpy as np
import pytest
from pin_drive import drive

from firmware_model import FaultKind, FirmwareError, Mcs51

P0, SP, TCON, TMOD, TL0, TL1, TH0, TH1 = 0x80, 0x81, 0x88, 0x89, 0x8A, 0x8B, 0x8C, 0x8D
P1, SCON, SBUF, P2, IE, P3, PSW, ACC = 0x90, 0x98, 0x99, 0xA0, 0xA8, 0xB0, 0xD0, 0xE0
TL2 = 0xCC
NOP, RETI, HERE = b"\x00", b"\x32", b"\x80\xfe"


def _cpu(code: bytes | str, *, part: str = "8052", timing: str = "12-clock", **sfr: int) -> Mcs51:
    cpu = Mcs51(bytes.fromhex(code) if isinstance(code, str) else code, part=part, timing=timing)
    for name, value in sfr.items():
        cpu.sfr[globals()[name] - 0x80] = value
    return cpu


def _sfr(cpu: Mcs51, address: int) -> int:
    return int(cpu.sfr[address - 0x80])


def _program(main: bytes, **routines: bytes) -> bytes:
    """Return code: a jump to ``main`` at 40h, and service routines at ``at_0003`` and so on."""
    code = bytearray(0x40)
    code[:3] = b"\x02\x00\x40"
    for name, routine in routines.items():
        at = int(name.removeprefix("at_"), 16)
        code[at : at + len(routine)] = routine
    return bytes(code) + main


# --- reset, memory ---


def test_reset_values():
    # chapter 3, "Reset": ports FFh, SP 07h, all others 0 or undefined
    cpu = _cpu("00")
    expected = np.zeros(128, dtype=np.uint8)
    expected[[P0 - 0x80, P1 - 0x80, P2 - 0x80, P3 - 0x80]] = 0xFF
    expected[SP - 0x80] = 7
    np.testing.assert_array_equal(cpu.sfr, expected)
    assert (cpu.pc, cpu.cycles, cpu.instructions, cpu.fault) == (0, 0, 0, None)


def test_reset_keeps_ram_and_time():
    cpu = _cpu("75 30 12 75 90 00 80 FE")
    cpu.run(10)
    cpu.reset()
    assert (cpu.iram[0x30], _sfr(cpu, P1), cpu.pc, cpu.cycles) == (0x12, 0xFF, 0, 10)


# --- ports ---


@pytest.mark.parametrize("port", [P0, P1, P2, P3])
def test_reads_take_pins_and_read_modify_write_takes_the_latch(port):
    cpu = _cpu(bytes([0xE5, port, 0x43, port, 0x00, 0xA2, port]), ACC=0)
    cpu.pins[(port - P0) >> 4] = 0xF0
    cpu.run(1)
    assert _sfr(cpu, ACC) == 0xF0  # MOV A,direct: pins
    cpu.run(2)
    assert _sfr(cpu, port) == 0xFF  # ORL direct,#0: the latch is FFh, the pins would leave F0h
    cpu.run(1)
    assert _sfr(cpu, PSW) & 0x80 == 0  # MOV C,bit: the pin


@pytest.mark.parametrize(
    ("code", "latch"),
    [
        ("05 90", 0x00), ("15 90", 0xFE), ("B2 90", 0xFE), ("C2 90", 0xFE), ("D2 90", 0xFF), ("92 90", 0xFE),
        ("52 90", 0x3C), ("42 90", 0xFF), ("62 90", 0xC3), ("53 90 3C", 0x3C), ("63 90 3C", 0xC3),
        ("D5 90 00", 0xFE), ("10 90 00", 0xFE),
    ],
)  # fmt: skip
def test_all_read_modify_write_instructions_take_the_latch(code, latch):
    cpu = _cpu(code, ACC=0x3C)
    cpu.pins[1] = 0x00
    cpu.step()
    assert _sfr(cpu, P1) == latch


def test_a_latch_of_zero_pulls_its_pin_down():
    cpu = _cpu("75 90 0F E5 90")
    cpu.run(3)
    assert _sfr(cpu, ACC) == 0x0F


# --- timers ---


def test_mode_3_splits_timer_0():
    cpu = _cpu(b"\x75\x88\x50" + HERE, TMOD=0x03)  # TR0 and TR1 at once
    cpu.run(2 + 256 + 6)
    assert (_sfr(cpu, TL0), _sfr(cpu, TH0)) == (6, 6)
    assert _sfr(cpu, TCON) & 0xA0 == 0xA0
    # timer 1 runs on without TR1, since that is taken
    assert _sfr(cpu, TL1) + 32 * _sfr(cpu, TH1) == (2 + 256 + 6)


def test_a_pulse_between_two_samples_is_not_counted():
    cpu = _cpu(b"\xd2\x8c" + HERE, TMOD=0x05)
    drive(cpu, [10, 10, 12, 13], [3] * 4, [0xEF, 0xFF, 0xEF, 0xFF])
    cpu.run(30)
    assert _sfr(cpu, TL0) == 1


def test_timer_2_counts_only_edges_that_come_while_it_looks():
    cpu = _cpu(NOP * 30 + b"\x75\xc8\x06" + HERE)  # the counter is let to count from cycle 32 on
    drive(cpu, [5, 7, 9, 50, 60, 70], [1] * 6, [0xFE, 0xFF, 0xFE, 0xFF, 0xFE, 0xFF])
    cpu.run(100)
    assert (_sfr(cpu, TL2), cpu.pins[1]) == (1, 0xFF)


def test_driven_pins_are_seen_in_their_cycle():
    # loop: MOV A,P1 (1); MOV @R0,A (1); INC R0 (1); SJMP (2): P1 is read in cycles 1, 6, 11, ...
    cpu = _cpu("78 40 E5 90 F6 08 80 FA")
    cycles = np.array([1, 2, 11, 12, 13, 16, 22, 27])
    levels = np.arange(1, 9)
    drive(cpu, cycles, np.ones(8, dtype=int), levels)
    cpu.run(40)
    seen = [levels[cycles <= at][-1] for at in range(1, 37, 5)]
    assert cpu.iram[0x40:0x48].tolist() == seen


def test_timers_of_the_one_clock_part_count_a_twelfth():
    cpu = _cpu(b"\xd2\x8c" + NOP * 600, timing="one-clock", TMOD=1)
    cpu.run(2 + 12 * 20)
    assert _sfr(cpu, TL0) == 20


# --- interrupts ---


def test_response_to_an_edge_takes_three_cycles():
    # "Response Time": more than three complete cycles between the request and the first instruction of the routine
    cpu = _cpu(_program(b"\x75\x88\x01\x75\xa8\x81" + NOP * 64, at_0003=b"\xf5\x30" + RETI))
    drive(cpu, [20], [3], [0xFB])  # sampled in cycle 20, polled in 21, called in 22 and 23, first instruction in 24
    while cpu.pc != 0x0003:
        cpu.run(1)
    assert cpu.cycles == 24
    assert _sfr(cpu, TCON) & 2 == 0  # cleared by hardware


def test_level_asks_again_until_it_ends():
    code = _program(b"\x75\xa8\x81" + HERE, at_0003=b"\x05\x30" + RETI)
    cpu = _cpu(code)
    drive(cpu, [20, 40], [3, 3], [0xFB, 0xFF])
    cpu.run(200)
    calls = int(cpu.iram[0x30])
    # a call (2), INC (1), RETI (2) and the one instruction that must follow (2) take 7 cycles
    assert calls == 3  # in cycles 22, 29 and 36
    cpu.run(200)
    assert cpu.iram[0x30] == calls


@pytest.mark.parametrize(
    ("instruction", "low_cycles", "served"),
    [
        ("00", 1, True),  # polled in the cycle behind, which is the last of a NOP
        ("75 32 00", 1, False),  # polled in the first of two cycles, which calls nothing, and gone for the second
        ("75 32 00", 2, True),
        ("A4", 3, False), ("A4", 4, True),  # MUL AB
        ("E5 A8", 1, False), ("E5 A8", 2, True),  # an access to IE lets one more instruction come
    ],
)  # fmt: skip
def test_a_level_counts_as_it_was_a_cycle_before_the_call(instruction, low_cycles, served):
    # "How Interrupts Are Handled": polled are the values of S5P2 of the previous machine cycle; what was not served
    # is not remembered. The level is low from the cycle before the instruction on, cycle 20.
    code = bytes.fromhex(instruction)
    cpu = _cpu(_program(NOP * 19 + code + NOP * 20, at_0003=b"\x05\x30" + RETI), IE=0x81)
    drive(cpu, [20, 20 + low_cycles], [3, 3], [0xFB, 0xFF])
    cpu.run(60)
    assert cpu.iram[0x30] == served


@pytest.mark.parametrize(
    ("instruction", "cycles", "held"),
    [
        ("75 A8 81", 2, True), ("E5 A8", 1, True), ("D2 B8", 1, True), ("53 B8 FF", 2, True), ("A2 AF", 1, True),
        ("75 30 81", 2, False), ("E5 30", 1, False), ("D2 D5", 1, False), ("53 D0 FF", 2, False),
    ],
)  # fmt: skip
def test_no_interrupt_right_behind_an_access_to_ie_or_ip(instruction, cycles, held):
    cpu = _cpu(NOP * 10 + bytes.fromhex(instruction) + b"\x0f\x0f" + HERE, IE=0x81, TCON=0x01)
    # the request is ripe at the very boundary behind the instruction, which ends in cycle 10 + cycles
    drive(cpu, [10 + cycles - 2], [3], [0xFB])
    while cpu.pc != 0x0003 or cpu.cycles < 10 + cycles:
        cpu.run(1)
    assert cpu.iram[7] == (1 if held else 0)
    assert cpu.cycles == 10 + cycles + (1 if held else 0) + 2


def test_response_of_the_one_clock_part_takes_five_clocks():
    cpu = _cpu(NOP * 64, timing="one-clock", IE=0x81, TCON=0x01)
    drive(cpu, [20], [3], [0xFB])  # one clock to detect, four for the call
    while cpu.pc != 0x0003 or cpu.cycles < 20:
        cpu.run(1)
    assert cpu.cycles == 25


def test_slowest_response_of_the_one_clock_part_takes_eighteen_clocks():
    # C8051F02x data sheet, section 12.3.4, page 118: detected in one clock, RETI takes 5, DIV behind it 8, the call 4
    code = _program(b"\xd2\x88\x75\xa8\x83\xd2\x8d\x84" + NOP * 20, at_000b=NOP * 3 + RETI)
    cpu = _cpu(code, timing="one-clock")
    while cpu.pc != 0x000D:
        cpu.step()
    begun = cpu.cycles  # the last NOP before RETI takes the clock in which the edge of INT0 is detected
    drive(cpu, [begun], [3], [0xFB])
    while cpu.pc != 0x0003:
        cpu.run(1)
    assert cpu.cycles - begun == 1 + 5 + 8 + 4


# --- serial port ---


def test_bytes_received_in_mode_1():
    main = b"\x75\x89\x20\x75\x8d\xfd\x75\x8b\xfd\x75\x98\x50\xd2\x8e" + HERE
    cpu = _cpu(main)
    cpu.run(100)
    cpu.receive(0x5A)
    cpu.run(9 * 96)
    assert _sfr(cpu, SCON) & 1 == 0
    cpu.run(96)
    assert (_sfr(cpu, SCON) & 5, _sfr(cpu, SBUF)) == (5, 0x5A)
    cpu.receive(0xA5)  # RI still set: the byte is lost ("More About Mode 1")
    cpu.run(10 * 96)
    assert _sfr(cpu, SBUF) == 0x5A


# --- power ---


def test_power_down_stops_everything():
    cpu = _cpu("D2 8C 75 87 02 05 30", TMOD=1)
    result = cpu.run(1000)
    assert (result.reason, result.instructions, result.cycles) == ("power-down", 2, 3)
    assert cpu.run(1000).cycles == 0
    cpu.reset()
    assert cpu.run(3).reason == "power-down"


# --- faults ---


@pytest.mark.parametrize(
    ("code", "part", "kind", "pc", "cycle"),
    [
        ("00 A5", "8052", FaultKind.RESERVED_OPCODE, 1, 1),
        ("00 00", "8052", FaultKind.OUTSIDE_IMAGE, 2, 2),
        ("00 75 30", "8052", FaultKind.OUTSIDE_IMAGE, 1, 1),
        ("E5 C8", "8051", FaultKind.UNMAPPED_SFR, 0, 0),
        ("00 F5 FF", "8052", FaultKind.UNMAPPED_SFR, 1, 1),
        ("D2 F9", "8052", FaultKind.UNMAPPED_SFR, 0, 0),
        ("85 30 FE", "8052", FaultKind.UNMAPPED_SFR, 0, 0),
        ("75 81 7F C0 E0", "8051", FaultKind.STACK_OVERFLOW, 3, 2),
        ("75 81 FE 12 00 00", "8052", FaultKind.STACK_OVERFLOW, 3, 2),
        ("78 80 E6", "8051", FaultKind.UNMAPPED_RAM, 2, 1),
    ],
)
def test_faults_name_place_and_cycle(code, part, kind, pc, cycle):
    cpu = _cpu(code, part=part)
    before = cpu.iram.copy()
    assert cpu.run(100).reason == "fault"
    fault = cpu.fault
    assert fault is not None
    assert (fault.kind, fault.pc, fault.cycle) == (kind, pc, cycle)
    assert fault.opcode == (bytes.fromhex(code) + b"\xff")[pc]
    assert cpu.run(100).instructions == 0
    np.testing.assert_array_equal(cpu.iram[8:], before[8:])


# --- runs ---


def test_every_port_change_is_recorded_however_many():
    cpu = _cpu("B2 90 80 FC")
    cpu.record()
    cpu.run(3 * 10_000)
    rows = cpu.port_rows()
    np.testing.assert_array_equal(rows[:, 0], 1 + 3 * np.arange(10_000))
    np.testing.assert_array_equal(rows[:, 2], np.where(np.arange(10_000) % 2, 0xFF, 0xFE))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Mcs51(b""), "image: 0 bytes"),
        (lambda: Mcs51(bytes(65537)), "image: 65537 bytes"),
        (lambda: Mcs51(b"\0", part="8048"), "part: '8048'"),
        (lambda: Mcs51(b"\0", timing="6-clock"), "timing: '6-clock'"),
        (lambda: Mcs51(b"\0").run(-1), "cycles: -1"),
        (lambda: Mcs51(b"\0").receive(256), "0 to 255"),
        (lambda: Mcs51(b"\0").receive(1), "serial mode: 0"),
        (lambda: setattr(Mcs51(b"\0"), "pc", 65536), "pc: 65536"),
    ],
)
def test_bad_values_are_refused(call, message):
    with pytest.raises(FirmwareError, match=message):
        call()
