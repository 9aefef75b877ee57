"""A program as an insertion algorithm: the board of `rtec.board` says what has to come out."""

import dataclasses
from functools import cache

import pytest

from firmware_model import Image, read_hex
from rtec.board import Microcontroller
from rtec.injector import Design
from rtec.signal import EdgeStream
from rtec.verify.bench import Bench
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.hunt import hunt
from rtec.verify.contract.judge import Fault
from rtec.verify.contract.streams import Stream
from rtec.verify.contract.trials import Case, Trials
from rtec.verify.firmware import algorithm as firmware_algorithm
from rtec.verify.firmware.algorithm import Firmware

CHIP = dataclasses.replace(Microcontroller.named("8051-12mhz"), part="8051")
STREAMS = [
    "00 500ns:r1 9ms:end",
    "10 1ms:+ 1.2ms:+ 1.4ms:r-1 1.41ms:+ 1.6ms:+ 1.8ms:+ 2ms:+ 2.2ms:- 2.4ms:- 2.6ms:- 2.8ms:- 3ms:- 12ms:end",
    "11 30us:- 500us:r1 1.001ms:r0 4ms:r3 4.0002ms:+ 4.0004ms:- 25ms:end",
    "01 7ms:end",
    "00 2ms:r5 20ms:end",
]


def on_board(design, chip=CHIP, *, image=None, latch=True):
    return Firmware(Bench(design, chip, image or read_hex(chip.image(design)), hold_latch=latch))


def changed(design, old, new, chip=CHIP):
    """The shipped image with some bytes, in hex, put in other words."""
    whole = read_hex(chip.image(design))
    assert bytes.fromhex(old) in whole.code
    code = whole.code.replace(bytes.fromhex(old), bytes.fromhex(new))
    return Image(code=code, used=whole.used, source="changed")


def by_small_steps(firmware, stimulus):
    """The same run by the board alone, a few microseconds at a time, its words looked at in between."""
    bench, board = firmware.bench, firmware.bench.board
    bench.reset(firmware._homes[stimulus.edges.initial])
    begun_ps, edges = board.now_ps, stimulus.edges
    asked = dict(zip(stimulus.requests.times_ps.tolist(), stimulus.requests.totals.tolist(), strict=True))
    looks = sorted({*range(0, stimulus.until_ps, 7_000_000), *asked, stimulus.until_ps} - {0})
    seen, done, before, level = [], [(0, 0)], 0, edges.initial
    for t_ps in looks:
        here = (edges.times_ps >= before) & (edges.times_ps < t_ps)
        part = EdgeStream(edges.times_ps[here] + begun_ps, edges.levels[here], level)
        level, before = part.final, t_ps
        seen.append(board.process(part, until_ps=begun_ps + t_ps))
        if bench.valid and board.words.completed != done[-1][1]:
            done.append((t_ps, board.words.completed))
        if t_ps in asked:
            board.ask(asked[t_ps])
    return EdgeStream.concatenate(seen), done[1:], begun_ps


@cache
def streams_by_small_steps(design, name):
    """Streams and what comes of each, which depends on the board alone."""
    stimuli = [Stream.read(text).stimulus() for text in STREAMS]
    firmware = on_board(design, chip_of(name))
    return stimuli, [by_small_steps(firmware, stimulus) for stimulus in stimuli]


def chip_of(name):
    return CHIP if name == "8051-12mhz" else Microcontroller.named(name)


@pytest.mark.parametrize(
    ("design", "name"),
    [
        (Design.ORIGINAL, "8051-12mhz"),
        (Design.A, "one-clock-25mhz"),
        (Design.B, "8051-12mhz"),
        (Design.C, "8051-12mhz"),
    ],
)
@pytest.mark.parametrize("room", [16_384, 24], ids=["quick", "recorded"])
def test_what_comes_out_is_what_the_board_does(design, name, room, monkeypatch):
    stimuli, expected = streams_by_small_steps(design, name)
    monkeypatch.setattr(firmware_algorithm, "_ROOM", room)  # with little room a run goes the way that is recorded
    firmware = on_board(design, chip_of(name))
    for response, (edges, done, begun_ps) in zip(firmware.play(stimuli), expected, strict=True):
        assert response.edges.times_ps.tolist() == (edges.times_ps - begun_ps).tolist()
        assert response.edges.levels.tolist() == edges.levels.tolist()
        assert response.broken is None
        totals = response.completed
        assert totals.totals.tolist() == [total for _, total in done]
        for t_ps, (looked_ps, _) in zip(totals.times_ps.tolist(), done, strict=True):
            assert looked_ps - 7_000_000 <= t_ps <= looked_ps
    assert all(response.edges.counts().illegal == 0 for response in firmware.play(stimuli))


def test_a_total_beyond_the_window_is_refused_with_the_reports_words():
    within, beyond = on_board(Design.C).play(
        [Stream.read(text).stimulus() for text in ("00 1ms:r3 30ms:end", "00 1ms:r4 30ms:end")]
    )
    assert within.refusals == ()
    assert within.completed.final == 3
    assert [reason for _, reason in beyond.refusals] == ["I Don't Believe You"]
    assert 10**9 < beyond.refusals[0][0] < 3 * 10**9  # by the next reading but one
    assert beyond.completed.final == 0


def test_doubt_within_the_window_is_no_excuse():
    # add a,#(255 - 2 * WINDOW) -> #255: of all changes but -3 "I Don't Believe You" is said
    image = changed(Design.C, "24 F9", "24 FF")
    trials = Trials(on_board(Design.C, image=image), Contract.of(Design.C))
    run = trials.one(Case(title="three", stream=Stream.read("00 1ms:r3 30ms:end")))
    assert run.response.completed.final == 0
    assert run.judgement.violation.fault is Fault.UNFINISHED


def test_a_program_that_jumps_into_nothing_breaks_its_run_alone():
    # cpl P1.0, cpl P1.1 -> ljmp F000h, nop: where +1 begins in states 1 and 3
    firmware = on_board(Design.C, image=changed(Design.C, "B2 90 B2 91", "02 F0 00 00"))
    texts = ("00 500ns:r1 9ms:end", "00 500ns:r-1 9ms:end", "11 500ns:r1 9ms:end", "00 9ms:end")
    first, second, third, fourth = firmware.play([Stream.read(text).stimulus() for text in texts])
    for response in (first, third):
        assert "code outside the image at F000h" in response.broken.reason
        assert 0 < response.broken.time_ps < 2 * 10**9  # a reading and a bit
    assert (second.broken, second.completed.final) == (None, -1)
    assert (fourth.broken, len(fourth.edges)) == (None, 0)


def test_a_program_that_starts_again_at_each_insertion_completes_nothing():
    firmware = on_board(Design.C, image=changed(Design.C, "B2 90 B2 91", "02 00 00 00"))
    run = Trials(firmware, Contract.of(Design.C)).one(Case(title="", stream=Stream.read(STREAMS[0])))
    assert run.judgement.violation.fault is Fault.UNFINISHED


def test_a_wrong_step_at_rest_is_waited_for_in_what_follows():
    # cpl P1.0, cpl P1.1 the other way round: the first step at rest is wrong, and its time is known nevertheless
    trials = Trials(on_board(Design.C, image=changed(Design.C, "B2 90 B2 91", "B2 91 B2 90")), Contract.of(Design.C))
    assert trials.measure_settling().judgement.violation.fault is Fault.COUNT
    assert 10**9 < trials.settle_ps < 10**10  # a reading of the PC's words at least


@pytest.mark.parametrize(
    ("code", "part", "says"),
    [
        ("80 FE", "8051", "never publishes its words"),
        ("02 00 00", "8051", "never publishes its words"),  # starts again for ever
        ("02 F0 00", "8051", "code outside the image at F000h"),
        ("00", "8051", "code outside the image at 0001h"),
        ("75 C8 04 80 FE", "8051", "is the image for another part than the 8051?"),  # mov T2CON,#4
        ("75 C8 04 80 FE", "8052", "never publishes its words"),
        ("78 80 76 01 80 FE", "8051", "is the image for another part than the 8051?"),  # mov @R0,#1 beyond 128 bytes
        ("A5", "8051", "reserved opcode at 0000h"),
        ("75 87 02", "8051", "power-down"),
    ],
)
def test_a_program_that_does_not_come_so_far_says_why(code, part, says):
    chip = dataclasses.replace(CHIP, part=part)
    firmware = on_board(Design.C, chip, image=Image.of(bytes.fromhex(code)))
    (response,) = firmware.play([Stream.read("11 9ms:end").stimulus()])
    assert says in response.broken.reason
    assert len(response.edges) == 0


# --- what the hunt finds in what is shipped ---


def hunted(design, chip, *, tries):
    firmware = on_board(design, chip)
    contract = Contract.of(design, delay_ps=firmware.delay_ps, frequency_hz=5e3 if design is Design.B else 500e3)
    trials = Trials(firmware, contract)
    assert trials.measure_settling() is None
    return hunt(trials, tries=tries)[0]


@pytest.mark.parametrize("design", list(Design))
def test_the_programs_stand_the_hunt(design):
    # docs/firmware.md, "A turn before the latch": what they insert in is looked at behind the closed latch
    assert hunted(design, CHIP, tries=700) is None
