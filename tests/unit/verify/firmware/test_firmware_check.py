"""A firmware is held to its design's contract. The shipped images pass; each planted mistake fails where it belongs.

Mistakes are single instructions of the shipped images put in other words (opcodes: MCS-51 User's Manual, chapter 2,
"Instruction Set"), so what has to fail is known from what the instruction is for.
"""

import dataclasses
import re

import pytest

from firmware_model import Image, read_hex
from rtec.board import Microcontroller
from rtec.errors import ArgumentError
from rtec.injector import Design
from rtec.verify.contract.endurance import Endured
from rtec.verify.firmware.check import FirmwareCheckPlan, check_firmware, default_frequencies

CHIP = dataclasses.replace(Microcontroller.named("8051-12mhz"), part="8051")
START = ["starts", "answers", "home"]
INSERTIONS = [
    "runs", "passes", "inserts at rest", "inserts in motion", "reversals", "dither", "changing requests", "jitter",
    "many steps", "long travel", "long rests", "jumps", "worst case", "separation", "delay",
]  # fmt: skip
BOX = ["window", "disbelief", "large correction", "switch", "probing", "position", "words", "reset"]
NAMES = [*START, "pins", *INSERTIONS, "inserts at speed", *BOX]
TRIES = 16
"""Of the hunt, which tests/unit/verify/firmware/test_firmware_algorithm.py lets run for longer."""


def shipped(design, chip=CHIP):
    return read_hex(chip.image(design))


def with_mistake(design, old, new, *, every=False):
    """The shipped image with some bytes other than they are; ``.`` in ``old`` is any byte, and stays in ``new``."""
    image = shipped(design)
    pattern = b"".join(b"(.)" if pair == ".." else re.escape(bytes.fromhex(pair)) for pair in old.split())
    found = list(re.finditer(pattern, image.code, re.DOTALL))
    assert found, "the image has changed: the instruction is not there any more"
    code = bytearray(image.code)
    for match in found if every else found[:1]:
        kept = iter(match.groups())
        put = b"".join(next(kept) if pair == ".." else bytes.fromhex(pair) for pair in new.split())
        assert len(put) == len(match[0])
        code[match.start() : match.end()] = put
    return Image(code=bytes(code), used=image.used, source="with a mistake")


@pytest.fixture
def no_speeds(monkeypatch):
    """Leave out how fast it goes, most of the runs: the shipped images are asked for that."""
    none = Endured(wrong=None, made=1, depth=0, limit="")
    monkeypatch.setattr("rtec.verify.contract.suite.endure", lambda trials, kind: none)
    monkeypatch.setattr("rtec.verify.contract.suite.measure_speeds", lambda *_: None)


def judged(image, design=Design.ORIGINAL, chip=CHIP, **settings):
    plan = FirmwareCheckPlan(image=image, design=design, microcontroller=chip, phases=1, tries=TRIES, **settings)
    verdict = check_firmware(plan)
    names = [check.name for check in verdict.checks]
    assert names == (NAMES if verdict.suite is not None else [*START, *(BOX if len(names) > 4 else ["all else"])])
    return verdict, {check.name: check for check in verdict.checks}


# the Original is held whole by `rtec firmware check` in tests/unit/cli
@pytest.mark.parametrize(
    "design", [Design.C, *(pytest.param(d, marks=pytest.mark.sweep) for d in (Design.ORIGINAL, Design.A, Design.B))]
)
def test_the_shipped_images_pass(design):
    verdict, points = judged(shipped(design), design)
    assert verdict.passed, [(point.name, point.detail) for point in points.values() if not point.passed]
    # docs/firmware.md, "Timing of the insertions": cycle of the last change, and up to two cycles of the look before
    # it (six for Design B), and a quarter of a cycle from look to pin
    last = {Design.ORIGINAL: 9, Design.A: 11, Design.B: 16, Design.C: 7}[design]
    loop = 6 if design is Design.B else 2
    assert last <= verdict.worst_insertion_cycles <= last + loop + 0.25
    assert verdict.worst_insertion_us == verdict.worst_insertion_cycles  # a cycle of 12 MHz is 1 us
    assert verdict.reading_us == pytest.approx(1000.0, rel=0.02)
    # "Active low": a reset can be an illegal transition, and lets go of all lines
    assert verdict.reset_illegal
    speeds = verdict.suite.speeds
    # the gate of the table waits, where there is one, and the lines go on; Design B passes about 7 kHz and more
    gate_us = {Design.ORIGINAL: 51.0, Design.A: 60.0, Design.C: 42.0}.get(design)
    if gate_us:
        assert verdict.suite.contract.frequency_hz == 500e3
        assert 0.7e6 / gate_us < speeds.frequencies.max_inserting_hz < 1.1e6 / gate_us
        assert speeds.frequencies.max_passing_hz > 2e6  # there is nothing in the way but gates
    else:
        assert verdict.suite.contract.frequency_hz == 5e3
        assert verdict.suite.margin.separation_ps == 8_000_000  # from the copy to the step behind it
        assert 7_000 < speeds.frequencies.max_inserting_hz <= speeds.frequencies.max_passing_hz < 12_000


@pytest.mark.usefixtures("no_speeds")
@pytest.mark.parametrize("design", [Design.ORIGINAL, Design.A, Design.C])
def test_gates_alone_let_an_axis_that_creeps_into_the_insertion(design):
    # NISTIR 4832 has no latch: an edge during the pulses merges with them, and nothing tells the controller so
    verdict, points = judged(shipped(design), design, hold_latch=False)
    assert {point.name for point in points.values() if not point.passed} == {"reversals"}
    assert "creeps over an edge" in points["reversals"].detail
    assert points["reversals"].pc is not None
    assert verdict.trace.mark_ps is not None


@pytest.mark.usefixtures("no_speeds")
@pytest.mark.parametrize(
    ("name", "design"),
    [
        ("8051-12mhz", Design.A),
        ("one-clock-25mhz", Design.C),
        pytest.param("one-clock-100mhz", Design.C, marks=pytest.mark.sweep),
    ],
)
def test_an_image_of_another_part_or_design_passes(name, design):
    chip = Microcontroller.named(name)
    verdict, points = judged(shipped(design, chip), design, chip)
    assert verdict.passed, [(point.name, point.detail) for point in points.values() if not point.passed]
    # no insertion takes longer than its gate (processors/*.inc)
    assert 0.0 < verdict.worst_insertion_cycles < 43


MISTAKES = {
    # clr P1.0, clr P1.1, setb P1.0, setb P1.1: the pulses of +1
    "swapped pulses": (
        "C2 90 C2 91 D2 90 D2 91",
        "C2 91 C2 90 D2 91 D2 90",
        "inserts at rest",
        "counts -4 where +4 is right",
    ),
    "no release": (
        "C2 90 C2 91 D2 90 D2 91",
        "C2 90 C2 91 D2 90 00 00",
        "inserts at rest",
        "counts +3 where +4 is right",
    ),
    "another pin": ("C2 90 C2 91 D2 90 D2 91", "C2 92 C2 91 D2 92 D2 91", "pins", "drives P1.2 low"),
    # jnb P3.0,believe -> sjmp believe; jb P3.0,owed_none -> nop
    "switch not asked": ("30 B0 ..", "00 80 ..", "switch", "message 0 (OK) instead of message 3 (DISABLED)"),
    # jb ACC.0,accept -> sjmp accept; -> jb F_FATAL,accept
    "no window": ("20 E0 ..", "00 80 ..", "disbelief", "total +4, beyond the window"),
    "large not asked": ("20 E0 ..", "20 01 ..", "large correction", "total +20 with Large Correction"),
    # setb F_FATAL; inc TRIPS; anl a,#0Fh; jnz judged, before home is taken -> mov r0,#..
    "never fatal": ("75 47 05 D2 01", "75 47 05 00 00", "disbelief", "total +1"),
    "trips not counted": ("05 4B", "00 00", "probing", "0 trips counted"),
    "not modulo 4096": ("54 0F 30 E3 ..", "54 FF 30 E7 ..", "position", "instead of"),
    "home at any request": ("E5 32 45 33 70 ..", "E5 32 45 33 78 ..", "home", "home with a request of +1"),
    # setb P3.1 -> nop: the words change while they are said to be valid
    "always valid": ("D2 B1", "00 00", "words", "words change while Data Valid is high"),
    # setb IT1 -> clr P1.0
    "driven after reset": ("D2 8A", "C2 90", "reset", "P1.0 driven low afterwards"),
    # setb IT1 -> clr P3.4
    "an input driven": ("D2 8A", "C2 B4", "pins", "drives P3.4 low"),
}


IN_FULL = (
    "swapped pulses",
    "no release",
    "another pin",
    "large not asked",
    "never fatal",
    "not modulo 4096",
    "an input driven",
)
"""A whole check takes seconds; of mistakes that fail alike, one stands for the others."""


@pytest.mark.usefixtures("no_speeds")
@pytest.mark.parametrize(
    "mistake",
    [pytest.param(name, marks=[pytest.mark.sweep] * (name in IN_FULL)) for name in MISTAKES],
)
def test_a_mistake_fails_where_it_belongs(mistake, monkeypatch):
    old, new, name, says = MISTAKES[mistake]
    if name in BOX:  # checked from the same home, whatever was inserted before
        monkeypatch.setattr("rtec.verify.firmware.check._Campaign._insertions", lambda self, firmware: None)
    image = with_mistake(Design.ORIGINAL, old, new, every=old in ("D2 B1",))
    verdict, points = judged(image)
    assert not verdict.passed
    assert points[name].passed is False, {point.name: point.detail for point in points.values()}
    assert says in points[name].detail
    assert points[name].cycle > 0
    assert points[name].time_ps == pytest.approx(points[name].cycle * 1e6, abs=1e6)


@pytest.mark.usefixtures("no_speeds")
@pytest.mark.parametrize(
    ("design", "old", "new", "name"),
    [
        # cpl P1.0, cpl P1.1 the other way round; Design A: P1.0 in place of P1.2; Design B: the table's first state
        (Design.C, "B2 90 B2 91", "B2 91 B2 90", "inserts at rest"),
        (Design.A, "C2 92", "C2 90", "inserts at rest"),
        (Design.B, "CF DF FF EF", "CF EF FF DF", "inserts in motion"),
    ],
)
def test_a_mistake_of_another_design_fails(design, old, new, name):
    verdict, points = judged(with_mistake(design, old, new, every=True), design)
    assert points[name].passed is False
    assert verdict.trace.mark_ps is not None


@pytest.mark.usefixtures("no_speeds")
def test_a_board_with_a_hold_latch_needs_its_pin():
    image = with_mistake(Design.C, "C2 97", "00 00", every=True)  # clr P1.7
    _, without = judged(image, Design.C, hold_latch=False)
    _, points = judged(image, Design.C)
    assert without["pins"].passed
    assert points["pins"].passed is False
    assert "never drives P1.7" in points["pins"].detail


@pytest.mark.usefixtures("no_speeds")
def test_an_axis_faster_than_the_gate_gets_no_insertion():
    # Original: the gate lasts 42 us a cycle, which is 23.8 kHz
    _, points = judged(shipped(Design.ORIGINAL), frequencies_hz=(30_000.0,))
    assert [point.name for point in points.values() if not point.passed] == ["inserts at speed"]
    assert "at 30 kHz" in points["inserts at speed"].detail
    assert "nothing inserted while the axis moves" in points["inserts at speed"].detail


# from reset on


def started(code, chip=CHIP):
    """Verdict on a program that is not the shipped one from its first instruction on."""
    image = shipped(Design.C)
    at = image.code[2] + 256 * image.code[1]  # ljmp start
    changed = bytearray(image.code)
    changed[at : at + len(code)] = code
    return judged(Image(code=bytes(changed), used=image.used, source="started"), Design.C, chip)


@pytest.mark.parametrize(
    ("code", "says"),
    [
        ("A5", "reserved opcode at 0030h"),
        ("02 F0 00", "code outside the image at F000h"),
        (
            "75 C8 04",
            "unmapped SFR at 0030h (opcode 75h) in cycle 2; is the image for another part than the 8051?",
        ),  # mov T2CON,#4: there is no timer 2 in an 8051
        ("75 81 7F C0 E0", "stack overflow at 0033h"),  # mov SP,#7Fh; push ACC: the 8051 has 128 bytes
        ("75 87 02", "power-down"),
    ],
)
def test_what_stops_the_processor_fails_first(code, says):
    verdict, points = started(bytes.fromhex(code))
    assert points["starts"].passed is False
    assert says in points["starts"].detail
    # the first instruction is the ljmp at 0, two cycles
    assert 2 <= points["starts"].cycle <= 5
    assert {point.passed for point in points.values()} == {False, None}
    assert verdict.trace is None
    assert not verdict.passed


@pytest.mark.usefixtures("no_speeds")
def test_timer_2_is_there_on_an_8052():
    larger = dataclasses.replace(CHIP, part="8052")
    _, points = started(bytes.fromhex("75 C8 00"), larger)
    assert points["starts"].passed


def test_an_endless_loop_is_named_with_its_addresses():
    _, points = started(bytes.fromhex("00 80 FD"))  # loop: nop; sjmp loop
    answer = points["answers"]
    assert answer.passed is False
    assert "never publishes" in answer.detail
    assert "between 0030h and 0031h" in answer.detail
    assert 100_000 <= answer.cycle < 200_000
    assert answer.pc in (0x30, 0x31)


def test_words_that_are_never_valid_are_no_answer():
    # clr P3.1 -> nop, every time
    _, points = judged(with_mistake(Design.C, "C2 B1", "00 00", every=True), Design.C)
    assert points["answers"].passed is False
    assert "P3.1 has not gone low" in points["answers"].detail


# what is kept


def test_plans_are_checked():
    settings = {"image": shipped(Design.C), "design": Design.C, "microcontroller": CHIP}
    with pytest.raises(ArgumentError, match="frequency"):
        FirmwareCheckPlan(**settings, frequencies_hz=(50.0,))
    for wrong in ({"phases": 0}, {"tries": -1}, {"seed": -1}):
        with pytest.raises(ArgumentError, match=next(iter(wrong))):
            FirmwareCheckPlan(**settings, **wrong)
    assert FirmwareCheckPlan(**settings).speeds_hz == default_frequencies(CHIP) == (1_000.0, 5_000.0)
    assert FirmwareCheckPlan(**settings, frequencies_hz=(3e3, 2e3)).speeds_hz == (2e3, 3e3)


def test_every_count_is_asked_for_up_to_the_speed_that_the_lines_can_have():
    def contract(design, **settings):
        plan = FirmwareCheckPlan(image=shipped(design), design=design, microcontroller=CHIP, **settings)
        return plan.contract(delay_ps=5_000_000_000)

    # round the processor, by gates: any speed of the contract; through it: no more than it is to insert at
    assert contract(Design.C).frequency_hz == 500e3
    assert contract(Design.C, frequencies_hz=(2e3, 1e6)).frequency_hz == 1e6
    assert contract(Design.B).frequency_hz == 5e3
    assert contract(Design.B, frequencies_hz=(2e3, 1e3)).frequency_hz == 2e3
    assert contract(Design.ORIGINAL).states == (0,)
    assert contract(Design.A).delay_ps == 5_000_000_000
