"""The suite: which checks in which order, what stops it, and what scripts get."""

import json
import re

import pytest

from rtec.examples import mutants
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.verify.contract.built_in import BuiltIn
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.streams import Stream
from rtec.verify.contract.suite import check_algorithm
from rtec.verify.contract.trials import Case
from tests.played import InProcess, Wires

ORDER = [
    "runs", "passes", "inserts at rest", "inserts in motion", "reversals", "dither", "changing requests", "jitter",
    "many steps", "long travel", "long rests", "jumps", "worst case", "separation", "delay",
]  # fmt: skip


SHARES: list[float] = []
NO_SPEEDS = lambda *_: None  # noqa: E731 - most of the runs, of which the right design has all


def fast(design, real_edges):
    timing = Timing.of(design, Processor.FAST)
    return BuiltIn(InjectorSettings(design=design, timing=timing, real_edges=real_edges))


@pytest.fixture(scope="module")
def right():
    algorithm = fast(Design.B, RealEdges.HOLD)
    return check_algorithm(algorithm, Contract(step_counts=1), tries=160, progress=SHARES.append)


@pytest.fixture(scope="module")
def wrong():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rtec.verify.contract.suite.measure_speeds", NO_SPEEDS)
        return check_algorithm(InProcess(mutants.CRawPins), Contract(step_counts=2), tries=160)


def test_a_right_design_passes_every_check_in_order(right):
    assert [check.name for check in right.checks] == ORDER
    assert right.passed
    assert all(check.passed and check.run is None for check in right.checks)
    assert right.speeds.frequencies.max_passing_hz >= 500e3
    assert right.worst.right  # the narrowest


def test_a_mutant_fails_with_the_moment_and_the_shortest_stream(wrong):
    assert [check.name for check in wrong.checks] == ORDER
    assert not wrong.passed
    failed = [check for check in wrong.checks if check.passed is False]
    assert "worst case" in [check.name for check in failed]
    assert all(re.search(r", (at|since) \d", check.reason) and not check.run.right for check in failed)
    shortest = min(len(check.run.case.stream) for check in failed)
    assert len(wrong.worst.case.stream) <= shortest
    assert not wrong.worst.right


def test_keys_that_scripts_rely_on(right, wrong):
    for verdict in (right, wrong):
        said = json.loads(json.dumps(verdict.to_dict()))
        assert {"algorithm", "passed", "checks", "max_inserting_hz", "max_passing_hz"} <= said.keys()
        for check in said["checks"]:
            assert {"name", "passed", "reason"} <= check.keys()
        assert said["passed"] is verdict.passed
        assert said["passed"] is all(check["passed"] is True for check in said["checks"])
        for text in [said["worst_stream"], *filter(None, (check["stream"] for check in said["checks"]))]:
            assert str(Stream.read(text)) == text
    assert right.to_dict()["worst_reason"] is None
    assert re.search(r", (at|since) \d", wrong.to_dict()["worst_reason"])


def test_the_data_sheet_says_how_deep_it_went(right, wrong):
    sheet = dict(right.data_sheet())
    assert [sheet[name] for name in ("many steps", "long travel", "long rests", "jumps")] == [
        "70000 steps each way", "70000 counts each way", "4500 s", "33000 steps each way",
    ]  # fmt: skip
    assert right.to_dict()["endurance"] == {
        "steps": 70_000, "travel_counts": 70_000, "rest_ps": 4500 * 10**12, "jump_steps": 33_000
    }  # fmt: skip


def test_the_data_sheet_has_units(right):
    sheet = dict(right.data_sheet())
    assert sheet["step"] == "1 counts"
    assert sheet["frequency"].startswith("500 kHz: inserts; ")
    assert "(60 ns at least)" in sheet["from A to B at the controller"]


def test_what_inserts_nothing_is_not_tried_on():
    verdict = check_algorithm(Wires(), Contract(step_counts=2))
    outcome = {check.name: check.passed for check in verdict.checks}
    assert list(outcome) == ORDER
    assert outcome["inserts at rest"] is False
    assert outcome["passes"] is True
    assert outcome["worst case"] is None
    assert "not tried: it inserts nothing at rest" in [check.reason for check in verdict.checks]
    assert verdict.speeds is None
    assert verdict.to_dict()["max_passing_hz"] is None


def test_what_breaks_ends_the_trials():
    class Raises:
        def step(self, t_ps, ab, requested):
            raise ValueError("no")

    verdict = check_algorithm(InProcess(Raises), Contract(step_counts=2))
    outcome = {check.name: check.passed for check in verdict.checks}
    assert outcome["runs"] is False
    assert "ValueError: no in test_suite.py, line" in verdict.checks[0].reason
    assert outcome["passes"] is outcome["worst case"] is None
    assert not verdict.passed
    assert verdict.runs < 40


@pytest.mark.parametrize(
    ("own", "passed", "says"),
    [
        ([], None, "not tried: no insertion"),
        (
            [Case(title="mine", stream=Stream.read("00 500ns:r1 600ns:+ 20us:end"))],
            False,
            "mine: +1 step asked for, 0 completed",
        ),
    ],
)
def test_cases_of_ones_own_are_one_more_check(monkeypatch, own, passed, says):
    monkeypatch.setattr("rtec.verify.contract.suite.measure_speeds", NO_SPEEDS)
    monkeypatch.setattr("rtec.verify.contract.suite.KINDS", ())
    verdict = check_algorithm(fast(Design.C, RealEdges.MERGE), Contract(step_counts=2), tries=16, more=lambda _: own)
    (check,) = [check for check in verdict.checks if check.name == "motion"]
    assert check.passed is passed
    assert check.reason.startswith(says)


def test_progress_rises_to_one(right):
    assert SHARES == sorted(SHARES)
    assert len(set(SHARES)) > 20
    assert 0.9 < SHARES[-1] <= 1.0
