"""The timing profiles, the limit frequencies and the speed gate, against figures worked out by hand."""

import math

import pytest

from rtec.errors import ArgumentError
from rtec.injector import Design, Processor, Timing

NS, US = 1_000, 1_000_000


@pytest.mark.parametrize(
    ("design", "worst_us"),
    [
        (Design.ORIGINAL, 2 + 4 + 3),  # polling, deciding, three steps between four changes
        (Design.A, 2 + 8 + 3),
        (Design.B, 4 + 5 + 5),  # polling, copying, inserting
        (Design.C, 2 + 5 + 1),
    ],
)
def test_worst_time_and_limit_on_the_8051(design, worst_us):
    timing = Timing.of(design, Processor.MCS51)
    assert timing.worst_ps(design) == worst_us * US
    assert math.isclose(timing.limit_hz(design), 1e6 / (4 * worst_us))


def test_reports_figures_of_the_original():
    timing = Timing.of(Design.ORIGINAL, Processor.MCS51)
    assert (timing.poll_ps, timing.decide_ps, timing.step_ps, timing.recover_ps) == (2 * US, 4 * US, US, 2 * US)
    # 4 us to the first pulse, 3 us of pulses, 2 us after them
    assert timing.decide_ps + 3 * timing.step_ps + timing.recover_ps == 9 * US
    assert round(timing.limit_hz(Design.ORIGINAL) / 100) == 278


@pytest.mark.parametrize(("design", "worst_ns"), [("original", 400), ("a", 400), ("b", 200), ("c", 250)])
def test_fast_profile_is_within_reach_of_500_khz(design, worst_ns):
    design = Design.named(design)
    timing = Timing.of(design, Processor.FAST)
    assert timing.worst_ps(design) == worst_ns * NS
    assert timing.limit_hz(design) >= 500e3
    # and so is the gate: at 500 kHz a quarter lasts 500 ns
    quarters = 4 if design is Design.ORIGINAL else 2
    assert timing.gate_ps(design) <= quarters * 500 * NS


def test_gate_is_the_worst_time_with_a_margin_on_a_cycle_or_half_of_one():
    assert Timing.of(Design.ORIGINAL, Processor.MCS51).gate_ps(Design.ORIGINAL) == 41_400_000  # 4 * 9 us * 1.15
    assert Timing.of(Design.A, Processor.MCS51).gate_ps(Design.A) == 29_900_000  # 2 * 13 us * 1.15
    assert Timing.of(Design.C, Processor.FAST).gate_ps(Design.C) == 575_000
    assert Timing(gate_margin=None).gate_ps(Design.C) == 0
    assert Timing(gate_margin=0.0).gate_ps(Design.C) == 400 * NS


def test_words_and_steps():
    assert [design.step_counts for design in Design] == [4, 4, 1, 2]
    assert [design.word_limit for design in Design] == [127, 127, 32767, 127]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("poll_ps", -1),
        ("poll_ps", 1.5),
        ("poll_offset_ps", 1),
        ("decide_ps", 0),
        ("step_ps", 0),
        ("latency_ps", 0),
        ("rest_ps", 0),
        ("recover_ps", -1),
        ("recover_ps", 10**13),
        ("gate_margin", -0.1),
        ("gate_margin", math.nan),
        ("gate_margin", math.inf),
        ("step_ps", True),
    ],
)
def test_times_outside_their_range_are_named(name, value):
    with pytest.raises(ArgumentError, match=name):
        Timing(**{name: value})


def test_an_unknown_design_is_answered_with_the_nearest():
    with pytest.raises(ArgumentError, match="did you mean 'original'"):
        Design.named("orginal")
    assert Design.named("C") is Design.C
