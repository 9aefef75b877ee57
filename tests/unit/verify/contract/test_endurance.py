"""Endurance: what shows late is found by the check that the page names, and right designs go the whole way."""

import inspect
import re
from pathlib import Path

import pytest

from rtec.examples import designs, late_mutants
from rtec.injector import Design, InjectorSettings, Processor, Reach, RealEdges, Timing
from rtec.verify.contract import endurance
from rtec.verify.contract.built_in import BuiltIn
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.endurance import KINDS, endure
from rtec.verify.contract.streams import can_be
from rtec.verify.contract.trials import Trials
from tests.played import InProcess
from tools.mutants import designs_of

MUTANTS = designs_of(late_mutants)
LONG = ("CByteTotal", "AWordTotal", "BWordUnsigned", "ASaturatesDown", "BTwoCounters")
"""Up to half a minute each, in plain Python."""
PAGE = (Path(__file__).parents[4] / "docs" / "mutants.md").read_text(encoding="utf-8")
DEEPEST = {"many steps": 70_000, "long travel": 70_000, "long rests": 4500 * 10**12, "jumps": 33_000}
STEPS, TRAVEL, RESTS, JUMPS = KINDS


def on_the_bench(algorithm, design):
    trials = Trials(algorithm, Contract.of(design))
    assert trials.measure_settling() is None
    return trials


def fast(design):
    timing = Timing.of(design, Processor.FAST)
    return BuiltIn(InjectorSettings(design=design, timing=timing, real_edges=RealEdges.HOLD))


def test_the_page_has_every_mutant_that_shows_late():
    assert len(MUTANTS) >= 26
    for name in MUTANTS:
        assert f"| `{name}` | {inspect.getdoc(getattr(late_mutants, name)).splitlines()[0]} |" in PAGE


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    "name",
    [*sorted(MUTANTS.keys() - set(LONG)), *(pytest.param(name, marks=pytest.mark.sweep) for name in LONG)],
)
def test_a_mutant_is_found_by_the_first_check_that_the_page_names(name):
    first = re.search(rf"^\| `{name}` \| [^|]+ \| ([\w ]+)", PAGE, re.MULTILINE)[1].strip()
    kind = next(kind for kind in KINDS if kind.name == first)
    found = endure(on_the_bench(InProcess(getattr(late_mutants, name)), MUTANTS[name]), kind, most_s=1e9)
    assert found.wrong is not None
    assert found.depth < DEEPEST[first]


@pytest.mark.parametrize("design", Design)
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_right_design_goes_the_whole_way_by_streams_that_an_encoder_can_send(design, kind):
    trials = on_the_bench(fast(design), design)
    found = endure(trials, kind, most_s=1e9)
    assert (found.wrong, found.depth, found.limit) == (None, DEEPEST[kind.name], "")
    for level in kind.levels(trials):
        for case in level.cases:
            assert can_be(case.stream, trials.contract), case.title
            assert case.must_finish, case.title


class Byte(designs.C):
    """Refuses, with a reason, what a signed byte cannot hold, and a jump of more than three steps."""

    REASONS = ("", "the word is full", "a jump")
    target = 0

    def step(self, t_ps, ab, requested):
        code = 1 if abs(requested) > 127 else 2 if abs(requested - self.target) > 3 else 0
        if code == 0:
            self.target = requested
        return *super().step(t_ps, ab, self.target), code


def test_a_refusal_with_a_reason_is_right_and_told():
    trials = on_the_bench(InProcess(Byte), Design.C)
    assert [(found.depth, found.limit) for found in (endure(trials, kind) for kind in (STEPS, JUMPS))] == [
        (127, "more is refused: the word is full"),
        (3, "more is refused: the word is full"),
    ]


@pytest.mark.parametrize(
    ("reach", "depth", "limit"),
    [
        (Reach(total=127), 127, ""),
        (Reach(longest_ps=50_000_000_000), 300, "its output is kept for 50 ms"),
    ],
)
def test_nothing_is_asked_for_that_the_interface_cannot_take(reach, depth, limit):
    class Limited(InProcess):
        def play(self, stimuli):
            for stimulus in stimuli:
                assert abs(stimulus.requests.totals).max(initial=0) <= reach.total
                assert stimulus.until_ps <= (reach.longest_ps or stimulus.until_ps)
            return super().play(stimuli)

    algorithm = Limited(designs.C)
    algorithm.reach = reach
    found = endure(on_the_bench(algorithm, Design.C), STEPS)
    assert (found.wrong, found.depth, found.limit) == (None, depth, limit)


def test_what_would_take_minutes_is_left_out_and_told(monkeypatch):
    seconds = iter(range(0, 1000, 10))  # each level takes ten
    monkeypatch.setattr(endurance.time, "monotonic", lambda: next(seconds))
    found = endure(on_the_bench(fast(Design.C), Design.C), TRAVEL)
    assert (found.wrong, found.depth, found.limit) == (None, 1_000, "8000 counts each way would take about 80 s here")
