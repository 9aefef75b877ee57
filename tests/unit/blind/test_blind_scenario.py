"""Scenarios: what can be hidden where, and what the game draws."""

from collections import Counter

import pytest

from rtec.blind.noise import Noise
from rtec.blind.plan import PLANS, Plan, plan_named
from rtec.blind.scenario import (
    CONFOUNDED,
    INSIDE,
    INSIDE_OF_GAME,
    OUTSIDE,
    OUTSIDE_OF_GAME,
    Scenario,
    scenario_of,
    unfit,
)
from rtec.effects import effect_named
from rtec.errors import ArgumentError

DRAWN = [scenario_of(seed) for seed in range(600)]


def test_what_lies_inside_is_in_the_library_and_what_lies_outside_is_not():
    for name in INSIDE:
        assert effect_named(name).name == name
    for name in OUTSIDE:
        with pytest.raises(ArgumentError):
            effect_named(name)


def test_the_game_draws_nothing_one_to_three_effects_or_one_outside():
    sizes = Counter(len(s.names) for s in DRAWN if not set(s.names) & set(OUTSIDE))
    assert set(sizes) == {0, 1, 2, 3}
    assert all(count > 30 for count in sizes.values())
    outside = [s for s in DRAWN if set(s.names) & set(OUTSIDE)]
    assert len(outside) > 60
    assert all(len(s.names) == 1 for s in outside)
    assert {name for s in DRAWN for name in s.names} == set(INSIDE_OF_GAME) | set(OUTSIDE_OF_GAME)


def test_the_game_hides_no_confounded_effects_together_and_nothing_that_the_plan_cannot_show():
    for scenario in DRAWN:
        assert all(unfit(name, scenario.plan) is None for name in scenario.names)
        assert not any(pair <= set(scenario.names) for pair in CONFOUNDED)
        assert all(1.5 <= strength <= 4.0 for strength in scenario.strengths)


def test_the_same_seed_draws_the_same_scenario():
    assert [scenario_of(seed) for seed in range(50)] == DRAWN[:50]
    assert {s.noise for s in DRAWN} == {Noise.WHITE, Noise.CORRELATED}


@pytest.mark.parametrize(
    ("name", "plan", "why"),
    [
        ("acceleration_lag", "base", "in motion only"),
        ("drift", "moving", "too short"),
        ("lost_counts", "moving", "too short"),
        ("thermal_growth", "base", "does not change"),
        ("windup", "one_heating", "reversals at several places"),
        ("moving_bump", "turned_once", "several runs"),
        ("gib_dents", "base", "more targets"),
        ("room_wave", "one_heating", "both directions"),
        ("viscous", "base", "force of a drive"),
        ("eccentricity", "base", "rotary axis"),
        ("interpolation", "turn", "linear axis"),
        ("pitch_map", "turn", "a turn closes"),
    ],
)
def test_an_effect_that_a_plan_cannot_show_is_refused_with_the_reason(name, plan, why):
    with pytest.raises(ArgumentError, match=why):
        Scenario(names=(name,), plan=PLANS[plan])


def test_strengths_belong_to_names():
    assert Scenario(names=("scale", "drift"), strength_sigma=(1.0, 2.0)).wanted == {"scale": 1.0, "drift": 2.0}
    with pytest.raises(ArgumentError, match="one for each name"):
        Scenario(names=("scale",), strength_sigma=(1.0, 2.0))
    with pytest.raises(ArgumentError, match="strength_sigma"):
        Scenario(names=("scale",), strength_sigma=0.0)
    with pytest.raises(ArgumentError, match="each effect once"):
        Scenario(names=("scale", "scale"))


def test_plans_are_found_by_name_and_check_their_numbers():
    assert plan_named("base") is PLANS["base"]
    with pytest.raises(ArgumentError, match="did you mean 'moving'"):
        plan_named("movng")
    for wrong in [{"runs": 0}, {"targets": 1}, {"span_mm": 1.0}, {"dwell_s": 0.1}, {"sigma_um": 0.0}]:
        with pytest.raises(ArgumentError, match=next(iter(wrong))):
            Plan(name="wrong", **wrong)
