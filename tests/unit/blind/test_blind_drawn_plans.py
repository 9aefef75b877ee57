"""Drawn plans: what they span, and that a seed draws the same one again."""

from collections import Counter

import numpy as np
import pytest

from rtec.blind.drawn_plans import drawn_log, drawn_plan
from rtec.blind.game import play
from rtec.blind.plan import draw_course
from rtec.blind.scenario import Scenario
from rtec.metrology import Heating, Passes, Reading, Spacing

PLANS = [drawn_plan(np.random.default_rng(seed)) for seed in range(400)]


def test_they_span_what_the_games_ask_for():
    targets = [plan.targets for plan in PLANS]
    assert min(targets) == 11
    assert max(targets) >= 155
    assert set(Counter(plan.runs for plan in PLANS)) == {1, 2, 3, 4, 5}
    assert {plan.passes for plan in PLANS} == set(Passes)
    assert {plan.spacing for plan in PLANS} == set(Spacing)
    assert {plan.heating for plan in PLANS} == {Heating.NONE, Heating.COLD_AND_HOT}
    assert {plan.repeated for plan in PLANS} == {True, False}


def test_the_same_seed_draws_the_same_plan():
    assert [drawn_plan(np.random.default_rng(seed)) for seed in range(50)] == PLANS[:50]


def test_waves_have_five_cycles_and_are_resolved():
    for plan in PLANS:
        low, high = plan.wave_shares
        assert low <= high <= 0.2
        if plan.targets >= 41:
            assert low * plan.targets >= 2.49


def test_bounds_are_kept():
    for seed in range(60):
        plan = drawn_plan(np.random.default_rng(seed), targets=(21, 40), runs=(2, 3), both=True)
        assert 21 <= plan.targets <= 40
        assert 2 <= plan.runs <= 3
        assert plan.passes is Passes.BOTH


@pytest.mark.parametrize("seed", range(4))
def test_a_drawn_plan_can_be_measured(seed):
    plan = drawn_plan(np.random.default_rng(seed), targets=(11, 40))
    measurement, secret = play(Scenario(plan=plan), seed)
    assert measurement.rows == plan.readings
    assert secret.plan == plan.name
    course = draw_course(plan, np.random.default_rng(seed))
    one_way = course.target_mm[(course.direction > 0) & (course.run == 1)]
    assert (np.diff(one_way) > 0).all()


@pytest.mark.parametrize("reading", [Reading.DRIVE, Reading.MOVING])
def test_a_drawn_log_moves_at_several_speeds(reading):
    logs = [drawn_log(np.random.default_rng(seed), reading) for seed in range(30)]
    assert {plan.reading for plan in logs} == {reading}
    assert {plan.runs for plan in logs} == {1, 2, 3}
    assert all(3 <= len(set(plan.feeds_mm_s)) <= 5 for plan in logs)
    assert all(plan.in_motion for plan in logs)
