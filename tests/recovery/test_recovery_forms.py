"""Forms of effects that no published line plays: hidden as physics, named where a plan shows them, else tied."""

from dataclasses import replace

import pytest

from rtec.blind.game import play
from rtec.blind.plan import PLANS, Passes
from rtec.blind.scenario import Scenario
from rtec.dataset.load import load_dataset
from rtec.effects.experiments import Ask
from rtec.inference.diagnose import diagnose
from rtec.inference.results import Verdict
from tools.rounds import two_rounds

TURN = PLANS["turn"]
SURE = (Verdict.NAMED, Verdict.LIKELY)
FEW, MANY = range(1), range(8)
seeds = pytest.mark.parametrize("seeds", [FEW, pytest.param(MANY, marks=pytest.mark.sweep)], ids=["few", "many"])


def games(names, plan, seeds, strength=3.0):
    """Return what is said of the games of these seeds."""
    scenario = Scenario(names=names, plan=plan, strength_sigma=strength)
    return [diagnose(load_dataset(play(scenario, seed)[0])) for seed in seeds]


def right(results, *names):
    """Return in how many of the results exactly these effects are sure."""
    return sum(set(result.effects) == set(names) and result.verdict in SURE for result in results)


@seeds
@pytest.mark.parametrize("plan", [TURN, replace(TURN, name="one turn", runs=1)], ids=lambda plan: plan.name)
def test_a_disc_off_centre_and_oval_is_named_from_a_turn(plan, seeds):
    results = games(("eccentricity",), plan, seeds)
    assert right(results, "eccentricity") == len(seeds)
    assert all(result.model.terms[0].shape.harmonics >= 2 for result in results)


@seeds
def test_what_a_gear_does_in_a_turn_is_cyclic(seeds):
    assert right(games(("cyclic",), TURN, seeds), "cyclic") >= max(1, len(seeds) - 1)


@seeds
def test_over_half_a_turn_a_disc_is_tied_with_a_smooth_error(seeds):
    half = replace(TURN, name="half a turn", span_mm=200.0)
    for result in games(("eccentricity",), half, seeds):
        assert result.verdict is Verdict.TIED
        tied = {name for one in result.candidates if one.accepted for name in (one.effect, *one.tied_with)}
        assert tied == {"eccentricity", "pitch_map"}


def test_a_turn_without_an_error_has_no_name():
    for plan in (TURN, replace(TURN, name="one way", runs=1, passes=Passes.FORWARD)):
        assert not any(result.effects for result in games((), plan, range(3)))


def test_play_in_motion_is_play():
    for result in games(("backlash",), PLANS["moving"], range(2)):
        assert result.effects == ("backlash",)


@seeds
def test_friction_that_builds_up_over_a_distance_is_coulomb_with_that_distance(seeds):
    results = games(("coulomb",), PLANS["soft_drive"], seeds)
    assert right(results, "coulomb") == len(seeds)
    for result in results:
        (term,) = result.model.terms
        assert term.shape.carried
        assert term.shape.distance == pytest.approx(0.5, rel=0.25)


@seeds
def test_friction_that_falls_with_speed_builds_up_over_the_same_distance(seeds):
    results = games(("coulomb", "stribeck"), PLANS["soft_drive"], seeds)
    assert right(results, "coulomb", "stribeck") == len(seeds)
    for result in results:
        for term in result.model.terms:
            assert term.shape.carried
            assert term.shape.distance == pytest.approx(0.5, rel=0.25)


def test_at_one_speed_friction_that_builds_up_asks_for_several_and_has_its_name_there():
    plan = replace(PLANS["soft_drive"], name="soft drive at one speed", feeds_mm_s=(10.0,))
    game = two_rounds(Scenario(names=("coulomb",), plan=plan, strength_sigma=3.0), 0, frozenset((Ask.SPEEDS,)))
    assert game.first.verdict == "UNKNOWN"
    assert game.asked
    assert game.told_apart


@seeds
def test_friction_that_is_there_at_once_has_no_distance(seeds):
    results = games(("coulomb", "viscous"), PLANS["drive"], seeds)
    assert right(results, "coulomb", "viscous") == len(seeds)
    assert all(term.shape.distance == 0.0 for r in results for term in r.model.terms if term.name == "coulomb")


@seeds
def test_the_weight_of_an_inclined_axis_is_listed_beside_the_constant_force_it_looks_like(seeds):
    results = games(("force_offset",), PLANS["drive"], seeds, 5.0)
    assert right(results, "force_offset") == len(seeds)
    for result in results:
        assert result.verdict is Verdict.NAMED
        (constant,) = [one for one in result.candidates if one.accepted]
        (weight,) = [one for one in result.candidates if one.effect == "gravity"]
        assert constant.tied_with == constant.for_ever == ("gravity",)
        assert weight.tied_with == ("force_offset",)
        assert "gravity" not in dict(result.not_testable)


def test_without_a_constant_force_a_linear_axis_speaks_of_no_weight():
    (result,) = games(("viscous",), PLANS["drive"], FEW)
    assert "gravity" not in {one.effect for one in result.candidates}
