"""Contract, cases and trials: what is asked, what is tried, and when an insertion happens."""

import pytest

from rtec.errors import ArgumentError
from rtec.examples import designs
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.verify.contract import cases
from rtec.verify.contract.built_in import BuiltIn
from rtec.verify.contract.contract import Contract, states_of
from rtec.verify.contract.judge import Fault
from rtec.verify.contract.streams import Stream, can_be
from rtec.verify.contract.trials import Case, Trials
from tests.played import InProcess, Wires

MAKERS = (
    cases.running, cases.passing, cases.at_rest, cases.in_motion, cases.jittering, cases.reversing, cases.dithering,
    cases.asking,
)  # fmt: skip


def box(design, *, edges=RealEdges.HOLD):
    timing = Timing.of(design, Processor.FAST)
    return BuiltIn(InjectorSettings(design=design, timing=timing, real_edges=edges))


@pytest.fixture(params=[Design.ORIGINAL, Design.C], ids=["one state", "all states"])
def trials(request):
    made = Trials(box(request.param), Contract.of(request.param))
    assert made.measure_settling() is None
    return made


# --- contract ---
@pytest.mark.parametrize(
    "wrong",
    [
        {"step_counts": 0},
        {"step_counts": 2, "states": ()},
        {"step_counts": 2, "states": (4,)},
        {"step_counts": 2, "frequency_hz": 0.0},
        {"step_counts": 2, "frequency_hz": float("nan")},
        {"step_counts": 2, "jitter": 0.95},
        {"step_counts": 2, "delay_ps": 0},
        {"step_counts": 2, "acceleration_hz_s": -1.0},
        {"step_counts": 2, "separation_ps": -1},
        {"step_counts": 2, "turn_ps": 0},
    ],
)
def test_a_contract_with_a_value_out_of_range(wrong):
    with pytest.raises(ArgumentError):
        Contract(**wrong)


@pytest.mark.parametrize("text", ["", "02", "00;11", "00,", "every"])
def test_states_that_are_none(text):
    with pytest.raises(ArgumentError):
        states_of(text)


def test_steps_of_the_designs_are_those_of_the_report():
    assert [Contract.of(design).step_counts for design in Design] == [4, 4, 1, 2]


# --- cases ---
def test_an_encoder_can_send_every_case(trials):
    for make in MAKERS:
        made = list(make(trials))
        assert made
        for case in made:
            assert can_be(case.stream, trials.contract), (case.title, str(case.stream))


def test_steps_are_asked_for_where_they_can_be_completed(trials):
    inserting = trials.contract.states
    for make in (cases.at_rest, cases.in_motion, cases.jittering, cases.asking):
        for case in make(trials):
            assert case.must_finish, case.title
            assert case.stream.final_state in inserting
            assert case.stream.requests_ps.size


def test_motion_comes_up_to_the_highest_speed_both_ways_from_every_state(trials):
    made = list(cases.passing(trials))
    for direction in (1, -1):
        fastest = [
            case.stream.state
            for case in made
            if case.stream.edges_ps.size > 50
            and set(case.stream.moves.tolist()) == {direction}
            and (case.stream.edges_ps[1:] - case.stream.edges_ps[:-1]).min() <= trials.contract.quarter_ps
        ]
        assert set(fastest) == {0, 1, 2, 3}
    assert not any(case.stream.requests_ps.size for case in made)


# --- trials ---
def test_settling_is_as_long_as_an_insertion_with_reserve():
    slow = type("Slow", (designs.A,), {"GAP_PS": 3_000_000})
    trials = Trials(InProcess(slow), Contract.of(Design.A))
    assert trials.measure_settling() is None
    # the last of four changes comes 9 us behind the first; an axis that has just arrived adds its own spacing
    assert 2 * 9_000_000 <= trials.settle_ps <= 2 * 9_300_000 + 40 * trials.contract.quarter_ps


def test_what_inserts_nothing_is_unfinished_after_a_second():
    run = Trials(Wires(), Contract(step_counts=2)).measure_settling()
    assert run.judgement.violation.fault is Fault.UNFINISHED
    assert run.case.stream.until_ps > 10**12


def test_refusing_a_step_at_rest_is_no_way_out():
    class Refuses:
        REASONS = ("", "the box is shy")

        def step(self, t_ps, ab, requested):
            return ab, 0, 0, 1 if requested else 0

    run = Trials(InProcess(Refuses), Contract(step_counts=2)).measure_settling()
    assert "refused: the box is shy" in str(run.judgement.violation)


def test_the_window_of_an_insertion_reaches_from_its_first_change_to_its_last():
    trials = Trials(InProcess(designs.A), Contract.of(Design.A))
    case = Case(title="one", stream=Stream.read("00 2us:+ 5us:r1 50us:end"))
    assert trials.window(case) == (5_000_000, 5_300_000)
    twice = Case(title="two", stream=Stream.read("00 5us:r1 9us:r2 50us:end"))
    assert trials.window(twice) == (9_000_000, 9_300_000)


def test_no_window_where_nothing_is_inserted():
    trials = Trials(Wires(), Contract(step_counts=2))
    assert trials.window(Case(title="one", stream=Stream.read("00 5us:r1 50us:end"))) is None


def test_the_first_wrong_run_ends_the_trials():
    trials = Trials(Wires(), Contract(step_counts=2))
    right = Case(title="right", stream=Stream.read("00 1us:+ 9us:end"))
    wrong = Case(title="wrong", stream=Stream.read("00 1us:r1 9us:end"))
    found, made = trials.first_wrong([right] * 40 + [wrong] + [right] * 400)
    assert (found.case.title, made) == ("wrong", trials.made)
    assert made < 100
    assert trials.first_wrong([right] * 20) == (None, 20)


def test_the_narrowest_is_taken_from_runs_that_are_right_only():
    trials = Trials(Wires(), Contract(step_counts=2))
    trials.one(Case(title="wrong", stream=Stream.read("00 1us:+ 1.451us:+ 2us:r1 9us:end")))
    assert trials.margin.separation_ps is None
    trials.one(Case(title="right", stream=Stream.read("00 1us:+ 1.5us:+ 9us:end")))
    assert trials.margin.separation_ps == 500_000
