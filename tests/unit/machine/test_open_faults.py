"""Faults on the open path: what finds nothing changes nothing, what takes effect says so; which counts are off."""

import dataclasses
import itertools

import line_fault_oracle as oracle
import numpy as np
import pytest

from rtec.axis import Encoder, Imperfections
from rtec.axis.motion import MotionKind
from rtec.board import Microcontroller
from rtec.controller import IllegalPolicy, ReceiverSettings
from rtec.errors import ArgumentError
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.injector._wave_kernels import LEVEL_OUT, TIME
from rtec.machine import OpenPath, simulate, windows, with_motion
from rtec.machine.open_fault_kinds import OPEN_FAULTS, open_fault_named, why_not, word_of
from rtec.machine.open_fault_outcome import NOT_ACTIVATED
from rtec.machine.open_faults import faults_at, length_ps, simulate_faults

FLAWED = Imperfections(phase_error_deg=10.0, duty_error_a=0.03, jitter_ps=4_000, glitch_probability=0.1)
FIRMWARE = Microcontroller.named("8051-12mhz")
MS, US = 10**9, 10**6


def path_of(design, processor=Processor.FAST, *, hold=True, gate=True, firmware=False, **more):
    timing = Timing.of(design, processor)
    timing = timing if gate else dataclasses.replace(timing, gate_margin=None)
    real_edges = RealEdges.HOLD if hold else RealEdges.MERGE
    slow = 5e3 if firmware else 9e3 if processor is Processor.MCS51 else 100e3
    words = {"frequency_hz": slow, "cycles": 100, "corrections": 10} | more
    box = InjectorSettings(design=design, timing=timing, real_edges=real_edges)
    return OpenPath(injector=box, microcontroller=FIRMWARE if firmware else None, **words)


def run(path, *wanted, seed=0, **more):
    """Carry out faults, each as (name, from_ps) or (name, from_ps, until_ps)."""
    rows = [(open_fault_named(name), *times, *[None] * (2 - len(times))) for name, *times in wanted]
    return simulate_faults(path, faults_at(length_ps(path), rows, seed), **more)


CASES = [
    (design, processor, flaws, sign, hold, motion)
    for design, processor, flaws, sign, hold, motion in itertools.product(
        Design, (Processor.FAST, Processor.MCS51, "firmware"), (Imperfections(), FLAWED), (1, -1), (True, False),
        (MotionKind.STEADY, MotionKind.RAMP, MotionKind.DITHER),
    )
]  # fmt: skip


@pytest.mark.one_in(9)
@pytest.mark.parametrize(("design", "processor", "flaws", "sign", "hold", "motion"), CASES)
def test_faults_that_find_nothing_leave_the_run_as_it_is(monkeypatch, design, processor, flaws, sign, hold, motion):
    firmware = processor == "firmware"
    path = path_of(
        design, Processor.MCS51 if firmware else processor, hold=hold, firmware=firmware, direction=-sign,
        corrections=23 * sign, encoder=Encoder(imperfections=flaws, seed=9),
        receiver=ReceiverSettings(policy=IllegalPolicy.FAULT),
    )  # fmt: skip
    path = with_motion(path, motion)
    monkeypatch.setattr(windows, "_CHUNK_EDGES", 77)
    end_ps = length_ps(path) - 1
    right, found = simulate(path), run(path, ("missed edge", end_ps), ("request corrupted", end_ps))
    assert dataclasses.replace(found.result, wall_s=0.0) == dataclasses.replace(right, wall_s=0.0)
    outcome = found.outcome
    assert (outcome.word, outcome.noticed, outcome.good_without) == (NOT_ACTIVATED, (), right.good)
    assert [effect.activated_ps for effect in outcome.effects] == [None, None]
    assert not found.good


@pytest.mark.parametrize("row", OPEN_FAULTS, ids=word_of)
def test_every_class_takes_effect_and_not_before_its_time(row):
    path = path_of(Design.A, cycles=200, frequency_hz=500e3, gate=False)
    if row.words.startswith("hold latch"):
        path = with_motion(path, MotionKind.REVERSAL)
    begin_ps = length_ps(path) // 3
    found = simulate_faults(path, faults_at(length_ps(path), [(row, begin_ps, None)], 1))
    effect = found.outcome.effects[0]
    assert effect.activated_ps >= begin_ps and effect.changes >= 1
    assert found.outcome.word != NOT_ACTIVATED


@pytest.mark.parametrize("word", [word_of(row) for row in OPEN_FAULTS if row.lines is not None] + ["missed-edge"])
def test_the_controller_counts_what_the_model_of_the_lines_counts(word):
    # slow edges and nothing asked for: what an ideal decoder makes of the signal
    path = path_of(Design.C, cycles=5, corrections=0, frequency_hz=2.5e6)
    begin_ps = 1_234_567 // 100 * 100
    edges = [(50 + 100 * k, *((1, 0), (1, 1), (0, 1), (0, 0))[k % 4]) for k in range(20)]  # in ns
    right = oracle.signal_of(edges, (0, 0), 2_001)
    begin = begin_ps // 1_000 + 1  # the first ns with the fault
    wrong = {
        "encoder-cable-open": lambda: oracle.cable_open(right, begin, 9_999),
        "a-and-b-swapped": lambda: oracle.exchanged(right, begin, 9_999),
        "one-line-of-a-pair-broken": lambda: oracle.line_broken(right, begin, 9_999),
        "missed-edge": lambda: oracle.missed_edge(right, begin),
    }.get(word, lambda: oracle.stuck(right, word[0] == "b", int(word.endswith("high")), begin, 9_999))()
    found = run(path, (word, begin_ps))
    assert found.result.encoder_counts == oracle.counted(right) == 20
    assert found.result.controller_counts == oracle.counted(wrong)
    assert found.outcome.off_counts == oracle.counted(wrong) - 20
    assert found.outcome.effects[0].activated_ps // 1_000 in (
        begin - 1, next(t for t in range(2_001) if wrong[t] != right[t])
    )  # fmt: skip


@pytest.mark.parametrize("firmware", [False, True])
@pytest.mark.parametrize("design", list(Design))
@pytest.mark.parametrize("word", ["power-lost", "processor-hung"])
def test_lines_beside_a_dead_processor_go_on_and_those_through_it_end(word, design, firmware):
    path = path_of(design, Processor.MCS51, firmware=firmware)
    moment_ps = length_ps(path) // 2
    found = run(path, (word, moment_ps))
    result = found.result
    assert 0 < result.insertions.completed < 10
    assert result.encoder_counts == 400
    if design.in_path:
        assert found.outcome.off_counts == pytest.approx(-200, abs=3)
        assert "audit: count mismatch" in found.outcome.noticed
    else:
        assert result.controller_counts == 400 + result.insertions.completed * design.step_counts
        # an odd number of half turns is let go at once where the program's inverters lose their power
        jumps = ("controller: illegal",) if (design, word, firmware) == (Design.C, "power-lost", True) else ()
        assert found.outcome.noticed == (*jumps, "audit: corrections left over")
    assert found.outcome.word == "detected"


@pytest.mark.parametrize("firmware", [False, True])
def test_power_that_comes_back_begins_with_empty_totals(firmware):
    path = path_of(Design.C, Processor.MCS51, firmware=firmware)
    found = run(path, ("power lost", length_ps(path) // 2, length_ps(path) // 2 + 30 * US))
    # nobody takes homes on the open path: the model follows the next request, the program waits for its home
    assert found.result.insertions.completed == (0 if firmware else 10)
    assert found.outcome.off_counts == 2 * 5
    assert "audit: count mismatch" in found.outcome.noticed


class Rows:
    """What is seen of a run."""

    done = False

    def __init__(self):
        self.rows = []

    def show(self, rows):
        self.rows.append(rows[1:].copy())

    def gaps(self, from_ps):
        """Times between the changes at the controller from a moment on."""
        rows = np.concatenate(self.rows)
        times = rows[1:, TIME][np.diff(rows[:, LEVEL_OUT]) != 0]
        return np.diff(times[times >= from_ps])


@pytest.mark.parametrize(("word", "rate"), [("clock fast", 2), ("clock slow", 0.5)])
@pytest.mark.parametrize("firmware", [False, True])
def test_another_clock_stretches_what_the_processor_does(word, rate, firmware):
    path = path_of(Design.C, Processor.MCS51, firmware=firmware, frequency_hz=2e3, corrections=50)
    moment_ps, seen, without = length_ps(path) // 2, Rows(), Rows()
    found = run(path, (word, moment_ps), seen=seen)
    simulate(path, seen=without)
    assert (found.outcome.word, found.outcome.off_counts) == ("masked", 0)
    # the two changes of an insertion
    assert seen.gaps(moment_ps).min() == without.gaps(moment_ps).min() / rate
    before = without.gaps(0)[:50]
    assert seen.gaps(0)[: before.size].tolist() == before.tolist()


@pytest.mark.parametrize("firmware", [False, True])
def test_a_hold_latch_that_sticks_closed_keeps_the_lines(firmware):
    path = path_of(Design.A, Processor.MCS51, firmware=firmware)
    until_ps = length_ps(path) * 3 // 4
    found = run(path, ("hold latch stuck closed", length_ps(path) // 2, until_ps))
    lost = found.result.controller_counts - 400 - 4 * found.result.insertions.completed
    # a quarter of the way, and what jumps when the latch opens again
    assert lost == pytest.approx(-100, abs=3)
    assert "audit: count mismatch" in found.outcome.noticed


def test_a_latch_that_sticks_open_merges_real_edges():
    held = with_motion(path_of(Design.C, frequency_hz=500e3, cycles=200, corrections=100), MotionKind.REVERSAL)
    merged = dataclasses.replace(held, injector=dataclasses.replace(held.injector, real_edges=RealEdges.MERGE))
    assert simulate(held).good
    right, found = simulate(merged), run(held, ("hold latch stuck open", 0))
    assert found.result.controller_counts == right.controller_counts
    assert found.result.received == right.received


@pytest.mark.parametrize("firmware", [False, True])
def test_the_last_request_with_a_wrong_bit_is_followed(firmware):
    path = path_of(Design.C, Processor.MCS51, firmware=firmware, frequency_hz=1e3, corrections=3, cycles=30)
    path = with_motion(path, MotionKind.RAMP)
    found = run(path, ("request corrupted", length_ps(path) * 7 // 10), seed=5)
    completed = found.result.insertions.completed
    assert (completed ^ 3).bit_count() == 1
    assert found.result.controller_counts == 2 * completed + 120
    assert found.result.insertions.requested == 3
    assert found.outcome.noticed in ((), ("audit: corrections left over",))


def test_two_faults_prove_themselves_each_and_together_take_what_one_alone_would_leave():
    path = path_of(Design.C, cycles=1000, corrections=40)
    alone = [run(path, one).outcome for one in (("missed edge", 2 * MS), ("power lost", 5 * MS))]
    both = run(path, ("missed edge", 2 * MS), ("power lost", 5 * MS)).outcome
    assert [one.word for one in alone] == ["silent corruption", "detected"]
    assert (both.word, both.off_counts) == ("detected", -4)
    assert [effect.activated_ps for effect in both.effects] == [one.effects[0].activated_ps for one in alone]
    late = run(path, ("missed edge", 2 * MS), ("power lost", length_ps(path) - 1)).outcome
    assert (late.word, late.effects[0].changes, late.effects[1].activated_ps) == (NOT_ACTIVATED, 2, None)


def test_a_wrong_request_is_in_the_twin_of_the_other_fault_too():
    path = path_of(Design.C, cycles=1000, corrections=40)
    alone = run(path, ("power lost", 5 * MS)).outcome.effects[0]
    both = run(path, ("request corrupted", MS), ("power lost", 5 * MS)).outcome.effects
    assert (both[1].activated_ps, both[1].changes) == (alone.activated_ps, alone.changes)
    assert both[0].changes == 1


@pytest.mark.parametrize("firmware", [False, True])
def test_a_box_without_power_cannot_be_restarted(firmware):
    path = path_of(Design.C, Processor.MCS51, firmware=firmware)
    at_ps = length_ps(path) // 2
    found = run(path, ("power lost", at_ps), ("box restarted", at_ps * 3 // 2)).outcome
    assert (found.word, found.effects[1].activated_ps) == (NOT_ACTIVATED, None)
    # an end behind that of the run is none
    assert run(path, ("power lost", at_ps, 3600 * 10**12)).outcome.effects[0].fault.until_ps is None


def test_windows_make_no_difference(monkeypatch):
    wanted = ("noise burst", MS), ("clock slow", 300 * US, 2 * MS)
    path = path_of(Design.ORIGINAL, cycles=300, corrections=40, encoder=Encoder(imperfections=FLAWED, seed=2))
    whole = run(path, *wanted)
    monkeypatch.setattr(windows, "_CHUNK_EDGES", 13)
    parts = run(path, *wanted)
    assert parts.outcome == whole.outcome
    assert parts.result.received == whole.result.received


@pytest.mark.parametrize(
    ("design", "words", "said"),
    [
        (Design.C, [("power lost", 2 * MS)], "a moment before the run ends, at 0.001 s"),
        (Design.C, [("power lost", 5, 5)], "a time after its begin"),
        (Design.C, [("glitch on A", 5, 9)], "is over at once"),
        (Design.C, [("glitches", 5), ("glitches", 9)], "is given twice"),
        (Design.C, [("glitches", 5), ("missed edge", 9), ("phase error", 9)], "a combination of two"),
        (Design.B, [("hold latch stuck open", 5)], "pass through its processor"),
    ],
)
def test_what_cannot_be_is_refused(design, words, said):
    with pytest.raises(ArgumentError, match=said):
        run(path_of(design), *words)


def test_without_a_hold_latch_none_can_stick():
    row = open_fault_named("hold latch stuck closed")
    assert why_not(row, Design.A, RealEdges.MERGE) == "real edges that merge pass no hold latch"
    assert why_not(row, Design.A, RealEdges.HOLD) is None
