"""The hunt alone finds every mutant of the published list, as the page says, and no fault in the right designs."""

import inspect
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rtec.examples import designs, mutants
from rtec.injector import Design
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.hunt import hunt
from rtec.verify.contract.judge import Fault
from rtec.verify.contract.random_streams import MOST_STEPS, possible, random_stream
from rtec.verify.contract.shrink import shrink
from rtec.verify.contract.streams import Stream, can_be
from rtec.verify.contract.suite import TRIES
from rtec.verify.contract.trials import Trials
from tests.played import InProcess, Wires
from tools.mutants import designs_of

MUTANTS = designs_of(mutants)
RIGHT = {design.value: kind for design in Design for kind in [getattr(designs, design.value.capitalize())]}
PAGE = (Path(__file__).parents[4] / "docs" / "mutants.md").read_text(encoding="utf-8")


def on_the_bench(kind, design):
    trials = Trials(InProcess(kind), Contract.of(design))
    return trials, trials.measure_settling()


def row_of(name):
    """Return runs of the hunts, and events and text of the shortest stream, as the page tells them."""
    found = re.search(rf"^\| `{name}` \| ([\w, ]+) \| (\d+) \| `(.*)` \|$", PAGE, re.MULTILINE)
    return found[1].split(", "), int(found[2]), found[3]


def test_the_list_has_twenty_mutants_five_of_each_design_and_the_page_has_them_all():
    assert [list(MUTANTS.values()).count(design) for design in Design] == [5, 5, 5, 5]
    for name in MUTANTS:
        assert f"| `{name}` | {inspect.getdoc(getattr(mutants, name)).splitlines()[0]} |" in PAGE
        assert "none" not in row_of(name)[0]


@pytest.mark.parametrize("name", MUTANTS)
def test_the_hunt_alone_finds_it_in_as_many_runs_as_the_page_says(name):
    trials, _ = on_the_bench(getattr(mutants, name), MUTANTS[name])
    worst, made = hunt(trials, tries=TRIES, seed=0)
    assert worst is not None
    assert str(made) == row_of(name)[0][0]
    stream = worst.case.stream
    assert can_be(stream, trials.contract)
    assert len(stream) <= 7, str(stream)
    # read from its own text, it breaks the contract in the same way
    again = trials.one(trials.case("again", Stream.read(str(stream)))).judgement.violation
    assert again.fault is worst.judgement.violation.fault


@pytest.mark.parametrize("name", MUTANTS)
def test_the_shortest_stream_of_the_page_breaks_the_mutant_and_not_the_right_design(name):
    design = MUTANTS[name]
    _, events, text = row_of(name)
    stream = Stream.read(text)
    assert len(stream) == events
    trials, _ = on_the_bench(getattr(mutants, name), design)
    case = trials.case("the page's", stream)
    assert not trials.one(case).right
    kind = RIGHT[design.value]
    if "GAP_PS" in vars(getattr(mutants, name)) and name != "ATooSlow":  # slower by design, not by mistake
        kind = type("Slow", (kind,), {"GAP_PS": getattr(mutants, name).GAP_PS})
    right, _ = on_the_bench(kind, design)
    assert right.one(case).right


@pytest.mark.parametrize("design", Design)
def test_the_right_designs_stand_the_hunt(design):
    trials, wrong = on_the_bench(RIGHT[design.value], design)
    assert wrong is None
    worst, made = hunt(trials, tries=600, seed=1)
    assert worst is None
    assert 400 < made <= 608


def test_the_same_seed_hunts_the_same_streams():
    class Seen(InProcess):
        def play(self, stimuli):
            self.texts += [(s.edges.times_ps.tolist(), s.requests.totals.tolist(), s.until_ps) for s in stimuli]
            return super().play(stimuli)

    texts = []
    for seed in (3, 3, 4):
        algorithm = Seen(designs.C)
        algorithm.texts = []
        trials = Trials(algorithm, Contract.of(Design.C))
        trials.measure_settling()
        hunt(trials, tries=160, seed=seed)
        texts.append(algorithm.texts)
    assert texts[0] == texts[1] != texts[2]


def test_the_budget_is_kept_and_told():
    shares = []
    trials, _ = on_the_bench(designs.C, Design.C)
    before = trials.made
    _, made = hunt(trials, tries=64, progress=shares.append)
    assert trials.made - before == made <= 64
    assert shares == [0.25, 0.5, 0.75, 1.0]


# --- streams of the hunt ---
def test_drawn_streams_reach_the_highest_speed_and_stay_in_what_a_box_believes():
    trials, _ = on_the_bench(designs.C, Design.C)
    rng = np.random.default_rng(0)
    streams = [random_stream(trials, rng) for _ in range(400)]
    possible_ones = [stream for stream in streams if can_be(stream, trials.contract)]
    assert len(possible_ones) > 300
    gaps = [np.diff(stream.edges_ps).min() for stream in possible_ones if stream.edges_ps.size > 3]
    assert sum(gap < 1.2 * trials.contract.quarter_ps for gap in gaps) > 20
    assert any(np.ptp(np.r_[0, stream.totals]) == MOST_STEPS for stream in streams)
    assert all(np.ptp(np.r_[0, stream.totals]) <= MOST_STEPS for stream in streams)


def test_edges_wait_until_they_can_be():
    contract = Contract(step_counts=2)
    stream = replace(Stream.read("00 90us:+ 90.5us:+ 99us:end"), until_ps=10**9)
    assert not can_be(stream, contract)
    assert can_be(possible(stream, contract), contract)


# --- cut short ---
def test_nothing_is_left_that_can_go():
    trials = Trials(Wires(), Contract(step_counts=2))
    long = "00 1.234567us:+ 1.9us:r3 2.5us:+ 3.1us:- 40.123us:r2 90us:- 99us:end"
    run = trials.one(trials.case("long", Stream.read(long)))
    short, made = shrink(trials, run)
    assert short.judgement.violation.fault is Fault.UNFINISHED
    assert str(short.case.stream).startswith("00 10us:r1 ")
    assert len(short.case.stream) == 1
    assert 0 < made < 300


def test_a_fault_of_one_kind_is_not_cut_to_one_of_another():
    trials, _ = on_the_bench(mutants.BTooSoon, Design.B)
    worst, _ = hunt(trials, seed=2)
    assert worst.judgement.violation.fault is Fault.SEPARATION


def test_what_is_right_is_not_cut():
    trials, _ = on_the_bench(designs.C, Design.C)
    run = trials.one(trials.case("right", Stream.read("00 1.5us:r1 9us:end")))
    assert shrink(trials, run) == (run, 0)
