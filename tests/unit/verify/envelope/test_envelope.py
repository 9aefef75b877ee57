"""The envelope of the firmware. Expected limits are cycles counted in the listings, by hand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from firmware_model import Image
from rtec.board import Microcontroller
from rtec.controller import Receiver, ReceiverSettings
from rtec.errors import ArgumentError
from rtec.injector import Design, Response, Totals
from rtec.report.campaign_page import limit_cells
from rtec.signal import EdgeStream
from rtec.units import PS_PER_S
from rtec.verify.bench import quarter_ps
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.frequencies import Does
from rtec.verify.contract.judge import Fault, Judgement, Violation
from rtec.verify.contract.streams import Stream
from rtec.verify.contract.trials import Case, Run
from rtec.verify.envelope.bench import CLOCKS_APART, Motion, PhaseSweepBench
from rtec.verify.envelope.jobs import row_record
from rtec.verify.envelope.mechanism import Mechanism
from rtec.verify.envelope.moments import armed_moments, loop_cycles, waiting_ps
from rtec.verify.envelope.motion import broken_in
from rtec.verify.envelope.rows import EnvelopePlan, find_envelope
from rtec.verify.envelope.speeds import starts_are_right
from rtec.verify.envelope.trials import Bursts, Streams, largest_safe

PAGE = (Path(__file__).parents[4] / "docs" / "envelope.md").read_text(encoding="utf-8")
US = 1_000_000
MHZ_12, MHZ_24 = (Microcontroller.named(name) for name in ("8051-12mhz", "8051-24mhz"))

# Cycles of the 12-clock part from a transition that the look has just missed to the last change at the pins: the
# waiting loop, the cycles to the last change, and a quarter of one from S5P2 of the look to S1P1 of the change.
WINDOW_CYCLES = {Design.ORIGINAL: 2 + 9 + 0.25, Design.A: 2 + 11 + 0.25, Design.C: 2 + 7 + 0.25}


def limit_of(trials):
    return largest_safe(trials.fails, 5_000.0, 1e6)


@pytest.fixture(scope="module")
def original():
    return Bursts(PhaseSweepBench(Design.ORIGINAL, MHZ_12))


@pytest.mark.parametrize("design", WINDOW_CYCLES)
@pytest.mark.parametrize("processor", [MHZ_12, MHZ_24], ids=lambda processor: processor.name)
def test_the_limit_is_the_window_counted_in_cycles(design, processor):
    # the next transition, a quarter period later, must not come before the last change
    cycle_s = 12.0 / processor.clock_hz
    expected_hz = 1.0 / (4.0 * WINDOW_CYCLES[design] * cycle_s)
    found = limit_of(Bursts(PhaseSweepBench(design, processor)))
    # the search resolves 1 %; the controller's filter wants 20 ns more, 0.4 % of the shortest window
    assert 0.984 * expected_hz < found.safe <= expected_hz


def test_the_original_is_consistent_with_the_report():
    # "at 30 kHz A&B low lasts about 8 us", shorter than its 9 us: it may run into the next transition
    [row] = find_envelope(EnvelopePlan(designs=[Design.ORIGINAL], processors=[MHZ_12]))
    assert 20_000 < row.max_safe_hz < 30_000
    assert row.limited_by is Mechanism.WINDOW
    assert not row.reaches_500khz
    assert row.loop_cycles == 2  # JB bit,rel
    assert row.failing.behind_state == 1
    assert row.max_safe_hz < row.failing.frequency_hz < 1.01 * row.max_safe_hz
    # its gate: 51 cycles or more from one A&B low to the next, in a loop of 4 cycles and more
    assert 1e6 / 59 < row.gate_hz < 1e6 / 51
    assert row.counts_right
    assert row.checked_to_hz > 10 * row.gate_hz
    # up to there the gate lets a step through at some phase within two readings; within many it does at all phases
    found = row.speeds.frequencies
    assert 0.95 * row.gate_hz < found.max_inserting_hz < 1.03 * row.gate_hz
    assert row.speeds.at_top is Does.PASSES
    assert row.speeds.summary.startswith("500 kHz: passes; inserts to 1")
    assert row.speeds.summary.endswith("passes beyond 2 MHz")
    # edges inside an insertion are merged into it, however slow the axis is
    assert row.speeds.max_acceleration_hz_s == 0.0
    assert f"| {' | '.join(limit_cells(row_record(row)))} |" in PAGE


def test_a_safe_frequency_holds_under_a_slow_check(original):
    # through the board's own face, with every stream kept, a receiver for each, and the counts of an ideal decoder
    safe_hz = limit_of(original).safe
    for armed in original.armed:
        count = 20 + (-(armed.moment.state + 20 * armed.direction) * armed.direction) % 4
        motion = Motion(times_ps=quarter_ps(safe_hz, count), direction=armed.direction, total=armed.sign)
        bench = original.bench
        first = round(waiting_ps(bench) / bench.clock_ps)
        for clocks in range(first, first + 24, 2):
            bench.play(armed.moment, motion, clocks)
            expected = armed.direction * count + 4 * armed.sign
            assert bench.words.completed == armed.sign
            assert bench.controller.counts() == (expected, 0)
            result = bench.received()
            assert (result.count, result.illegal_transitions) == (expected, 0)


def counts_right(bench, expected):
    """Return whether receivers whose clocks are apart by equal shares of a period all come to a count."""
    seen, apart_ps = bench.controller, PS_PER_S // ReceiverSettings().clock_hz // CLOCKS_APART
    for k in range(CLOCKS_APART):
        receiver = Receiver(ReceiverSettings(), initial=seen.initial)
        receiver.process(seen.shift(k * apart_ps))
        result = receiver.result(at_ps=int(seen.times_ps[-1]) + 1_000 * US)
        if (result.count, result.illegal_transitions) != (expected, 0):
            return False
    return True


def test_the_kernel_and_the_boards_face_agree_trial_by_trial():
    # around the limit, where some phases fail and some do not
    bursts = Bursts(PhaseSweepBench(Design.C, MHZ_12))
    clocks = np.arange(8_000, 8_024)
    verdicts = set()
    for armed in bursts.armed[::5]:
        motion = Motion(times_ps=quarter_ps(37_000.0, 8), direction=armed.direction, total=armed.sign)
        shifts_ps = bursts.bench.shifts(armed.moment, clocks)
        found, _ = bursts.bench.sweep(armed.moment, motion, shifts_ps, stop=False)
        for verdict, phase in zip(found, clocks, strict=True):
            bursts.bench.play(armed.moment, motion, phase)
            completed = bursts.bench.words.completed
            right = counts_right(bursts.bench, 8 * armed.direction + 2 * completed)
            assert (verdict == 0) == (right and completed == armed.sign)
            verdicts.add(int(verdict))
    assert 0 in verdicts
    assert len(verdicts) > 1


def test_jitter_takes_its_share_of_the_window():
    # at its worst the trigger is late and the next transition early: twice the bound of a quarter period is gone
    bench = PhaseSweepBench(Design.ORIGINAL, MHZ_12)
    shaken_hz = limit_of(Bursts(bench, jitter_ps=500_000)).safe
    expected_hz = 1e12 / (4.0 * (11.25 + 1.0) * US)
    assert 0.984 * expected_hz < shaken_hz <= expected_hz


@pytest.mark.parametrize("hold_latch", [False, True])
def test_starts_from_rest_do_harm_without_the_latch_alone(hold_latch):
    # at 100 MHz/s the first two edges are 71 us apart: one of them falls into an insertion of 9 us, never both
    bench = PhaseSweepBench(Design.C, MHZ_12, hold_latch=hold_latch)
    assert starts_are_right(bench, Contract.of(Design.C)) is hold_latch
    # two edges within it are too many for the latch: 2.2 us and 0.9 us apart
    assert not starts_are_right(bench, replace(Contract.of(Design.C), acceleration_hz_s=1e11))


def test_what_a_wrong_run_shows_is_told_by_its_edges():
    def run(fault, seen_us):
        stream = Stream.of(0, [(10 * US, 1), (20 * US, 1)], [(1, 1)], 100 * US)
        levels = [(0b01, 0b11, 0b10, 0b00)[k % 4] for k in range(len(seen_us))]
        response = Response(edges=EdgeStream([int(t * US) for t in seen_us], levels, 0), completed=Totals())
        violation = Violation(fault=fault, time_ps=0, reason="")
        judgement = Judgement(violation=violation, completed=0, separation_ps=None, pulse_ps=None, delay_ps=0)
        return Run(case=Case(title="", stream=stream), response=response, judgement=judgement)

    loop_ps = 2 * US
    # the box's own changes at 15 and 23 us: the edge at 20 us fell between the look and the last of them
    assert broken_in(run(Fault.COUNT, [10.0, 15.0, 20.0, 23.0]), Design.C, loop_ps) is Mechanism.WINDOW
    # both edges within a loop of 12 us, or an edge lost with no insertion in sight
    assert broken_in(run(Fault.COUNT, [10.0, 15.0, 20.0, 23.0]), Design.C, 12 * US) is Mechanism.POLLING
    assert broken_in(run(Fault.COUNT, [20.0]), Design.C, loop_ps) is Mechanism.POLLING
    assert broken_in(run(Fault.SEPARATION, [10.0, 20.0]), Design.C, loop_ps) is Mechanism.FILTER
    assert broken_in(run(Fault.UNFINISHED, [10.0, 20.0]), Design.C, loop_ps) is Mechanism.GATE
    assert broken_in(run(Fault.BROKEN, []), Design.C, loop_ps) is Mechanism.NO_ANSWER


# --- programs of a user's own ---
NOTHING = Image.of(bytes([0x80, 0xFE]))  # SJMP $


def test_a_program_that_never_inserts_has_no_answer():
    [row] = find_envelope(EnvelopePlan(designs=[Design.C], processors=[MHZ_12], image=NOTHING))
    assert (row.max_safe_hz, row.limited_by, row.gate_hz, row.failing) == (0.0, Mechanism.NO_ANSWER, None, None)
    # the gates pass the lines on
    assert row.speeds.at_top is Does.PASSES
    assert row.speeds.summary == "500 kHz: passes; passes beyond 2 MHz"


def copy_image(copies):
    """MOV P1,P3 over and over, two cycles each, and LJMP 0, two cycles."""
    return Image.of(bytes([0x85, 0xB0, 0x90]) * copies + bytes([0x02, 0, 0]))


@pytest.mark.parametrize(("copies", "look_cycles"), [(1, 4.0), (20_000, 2.0)])
def test_the_bare_copy_passes_what_two_looks_tell_apart(copies, look_cycles):
    # Two transitions between two looks are lost; with a jump behind each copy a look comes every four cycles.
    # Unrolled, 20 000 copies take 40 ms, and the jump is met by none of these streams.
    bench = PhaseSweepBench(Design.B, MHZ_12, copy_image(copies))
    found = limit_of(Streams(bench, asked=False))
    expected_hz = 1e6 / (4.0 * look_cycles)
    assert 0.984 * expected_hz < found.safe <= expected_hz
    assert (found.safe > 100_000) == (copies > 1)


def test_design_b_is_safe_where_its_looks_are_dense_enough():
    # no two looks are more than 36 cycles apart, and no fewer than 6: the limit lies between
    [row] = find_envelope(EnvelopePlan(designs=[Design.B], processors=[MHZ_12]))
    assert 1e6 / (4 * 36) < row.max_safe_hz < 1e6 / (4 * 6)
    assert row.limited_by in (Mechanism.LATENCY, Mechanism.POLLING)
    assert row.loop_cycles is None
    # above that its lines are lost; below, a step is inserted within many readings at all phases
    assert row.max_safe_hz / 1.03 < row.speeds.frequencies.max_passing_hz <= row.max_safe_hz
    assert row.speeds.frequencies.max_inserting_hz == row.speeds.frequencies.max_passing_hz
    assert row.speeds.at_top is Does.FAILS


def test_the_waiting_loop_is_measured():
    # JB bit,rel: two machine cycles, or four clocks of the one-clock part
    for name, cycles in (("8051-12mhz", 2), ("one-clock-25mhz", 4)):
        bench = PhaseSweepBench(Design.C, Microcontroller.named(name))
        assert loop_cycles(bench, armed_moments(bench)[0].moment) == cycles


@pytest.mark.parametrize("jitter_ps", [-1, 10**10])
def test_a_jitter_out_of_range_is_refused(jitter_ps):
    with pytest.raises(ArgumentError, match="jitter_ps"):
        EnvelopePlan(jitter_ps=jitter_ps)
