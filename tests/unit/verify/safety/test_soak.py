"""Hours of cutting under random faults: tolerated, or a safe stop."""

import dataclasses

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.injector import Design
from rtec.injector.design import BESIDE
from rtec.machine.faults import FaultKind
from rtec.verify.safety.matrix import Outcome
from rtec.verify.safety.phases import Phase, twin_of
from rtec.verify.safety.soak import EpisodeJob, Injected, SoakPlan, flaw, run_soak
from rtec.verify.safety.soak_program import draw_programs
from rtec.verify.safety.variants import VARIANTS


@pytest.fixture(scope="module")
def soak():
    return run_soak(SoakPlan(hours=2.0, seed=1))


def held_to_account(soak, hours):
    assert soak.hours() >= 1.1 * hours
    assert [(e.design, e.number, e.wrong) for e in soak.undetected()] == []
    assert set(soak.fired()) == set(FaultKind)
    assert soak.good
    for design in BESIDE:
        assert soak.hours([design]) >= hours / 3.0
    for episode in soak.episodes:
        assert episode.outcome is not Outcome.SAFE_STOP or episode.reason
        assert episode.outcome is not Outcome.TOLERATED or episode.checks > 0


def test_two_hours(soak):
    held_to_account(soak, 2.0)


def test_the_ledger_adds_up(soak):
    """Every episode ended in one way, those of Design B too, and each undetected error stands in one account."""
    assert {episode.design for episode in soak.episodes} == set(Design)
    assert sum(soak.outcomes.values()) == len(soak.episodes)
    accounts = [soak.undetected(where) for where in (None, "before the box", "with the processor")]
    assert sum(map(len, accounts)) == soak.outcomes[Outcome.UNDETECTED]


@pytest.mark.parametrize(
    ("design", "fault", "good"),
    [
        (Design.B, "frame-lost", False),
        (Design.B, "power-lost", True),
        (Design.C, "power-lost", False),
        (Design.B, "line-broken", True),
    ],
)
def test_an_undetected_error_fails_the_soak_unless_no_supervision_can_catch_it(soak, design, fault, good):
    """The lines of Design B are lost with its processor; a fault of the encoder shows the same to everybody."""
    variant = next(v for v in VARIANTS if v.kind is FaultKind[fault.upper().replace("-", "_")])
    number = next(n for n, episode in enumerate(soak.episodes) if episode.design is design)
    bad = dataclasses.replace(
        soak.episodes[number],
        outcome=Outcome.UNDETECTED,
        injected=(Injected(variant=variant, phase=Phase.CUTTING, axis=1, activated_ps=0),),
        wrong="1 counts",
    )
    episodes = list(soak.episodes)
    episodes[number] = bad
    assert dataclasses.replace(soak, episodes=tuple(episodes)).undetected() == (() if good else (bad,))
    assert dataclasses.replace(soak, episodes=tuple(episodes)).good == good


@pytest.mark.sweep
def test_a_hundred_hours():
    held_to_account(run_soak(SoakPlan(hours=100.0, seed=1)), 100.0)


def test_any_number_of_threads_gives_the_same():
    one, two = (run_soak(SoakPlan(hours=0.02, episode_s=20.0, threads=threads)) for threads in (1, 2))
    assert one.episodes == two.episodes


def test_an_episode_can_be_run_again(soak):
    episode = soak.episodes[3]
    assert EpisodeJob(plan=soak.plan, design=episode.design, number=episode.number).run() == episode


def test_programs_cut_at_the_feeds_that_are_meant():
    programs = draw_programs(np.random.default_rng(3), axes=3, length_s=600.0)
    speeds = np.array([move.speed_mm_s for moves in programs.moves for move in moves])
    cutting = speeds[speeds < 20.0]
    assert cutting.min() >= 0.5
    assert cutting.max() <= 5.0
    assert (speeds >= 20.0).any()
    assert 0.2 < np.mean([move.rest_s > 0.0 for moves in programs.moves for move in moves]) < 0.8


@pytest.fixture(scope="module")
def healthy():
    return twin_of(Phase.CUTTING, Design.C, 0).cell.monitored[0]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, ""),
        ({"off_counts": 1}, "1 counts of the encoder"),
        ({"uninserted_counts": -4}, "-4 of the insertions"),
        ({"asked_counts": 3.5}, "the total is off by 3.5 counts"),
        ({"pending_steps": 2}, "2 steps are never inserted"),
        ({"wrong_s": 2.0, "wrong_counts": 7.0}, "wrong by 7.0 counts for 2.00 s"),
        ({"checks": 0}, "never seen at rest"),
    ],
)
def test_every_flaw_is_seen(healthy, changes, words):
    assert words in flaw(dataclasses.replace(healthy, **changes), Design.C)
    assert (flaw(dataclasses.replace(healthy, **changes), Design.C) == "") == (words == "")


@pytest.mark.parametrize("changes", [{"hours": 0.0}, {"episode_s": 1.0}, {"seed": -1}, {"threads": 0}])
def test_a_plan_that_is_none_is_refused(changes):
    with pytest.raises(ArgumentError, match=next(iter(changes))):
        SoakPlan(**changes)


@pytest.mark.parametrize(("design", "number"), [(Design.ORIGINAL, 98), (Design.C, 166)])
def test_a_request_on_its_way_when_probing_begins_is_no_error(design, number):
    """All frames come 15 ms late, and the last request before the probing mode is still to be carried out."""
    assert EpisodeJob(plan=SoakPlan(seed=1), design=design, number=number).run().outcome is Outcome.TOLERATED
