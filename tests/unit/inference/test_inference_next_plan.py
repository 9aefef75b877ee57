"""The plan for the next hour: what it promises is what comes out where the emulated axis carries it out."""

import numpy as np
import pytest

from rtec.blind.game import again, play
from rtec.blind.plan import PLANS
from rtec.blind.scenario import Scenario
from rtec.dataset.load import load_dataset
from rtec.inference.diagnose import diagnose
from rtec.inference.next_plan import next_plan
from rtec.inference.results import Verdict
from rtec.metrology.plan_program import plan_csv, plan_program

HOUR_S = 3600.0


def test_what_was_tied_is_told_apart_afterwards():
    scenario = Scenario(names=("backlash",), plan=PLANS["turned_once"], strength_sigma=4.0)
    first = diagnose(load_dataset(play(scenario, 3)[0]))
    assert first.verdict is Verdict.TIED
    planned = next_plan(first, HOUR_S)
    assert planned.plan.duration_s <= HOUR_S
    assert all(nats > 15.0 for *_, nats in planned.apart)
    second = diagnose(load_dataset(again(scenario, 3, planned.plan)[0]))
    assert (second.verdict, second.effects) == (Verdict.NAMED, ("backlash",))


@pytest.mark.parametrize("seed", [1, 2])
def test_standard_errors_are_those_that_were_promised(seed):
    scenario = Scenario(names=("backlash", "scale"), strength_sigma=4.0)
    first = diagnose(load_dataset(play(scenario, seed)[0]))
    planned = next_plan(first, HOUR_S)
    by_plan, by_repeating = (
        diagnose(load_dataset(again(scenario, seed, plan)[0])) for plan in (planned.plan, planned.repeated)
    )
    for one in planned.sharper:
        errors = []
        for result in (by_plan, by_repeating):
            term = next(term for term in result.model.terms if term.name == one.effect)
            amplitude = term.effect.amplitudes(term.shape, result.model.units)[0]
            errors.append(term.errors[0] * amplitude.factor)
        assert errors == pytest.approx([one.planned, one.repeated], rel=0.25)
        assert one.planned <= 0.7 * one.repeated


def test_a_time_too_short_for_one_run_and_a_file_without_places():
    first = diagnose(load_dataset(play(Scenario(names=("backlash",)), 1)[0]))
    assert "one run" in next_plan(first, 60.0)


def test_a_program_goes_to_each_target_and_rests_there():
    plan = next_plan(diagnose(load_dataset(play(Scenario(names=("backlash",)), 1)[0])), HOUR_S).plan
    rows = list(plan_csv(plan))
    targets = np.array([float(row.split(",")[2]) for row in rows[1:]])
    assert targets.size == plan.readings
    program = list(plan_program(plan))
    moves = [line for line in program if line.startswith("G1")]
    rests = sum(float(line[4:]) for line in program if line.startswith("G4"))
    assert len(moves) == plan.readings + 2 * plan.runs
    assert rests <= plan.duration_s
    feed = plan.feeds_mm_s[0]
    travel = np.abs(np.diff(targets)).sum() / feed
    assert rests + travel == pytest.approx(plan.duration_s, rel=0.05)


def test_a_drive_is_asked_for_other_speeds():
    scenario = Scenario(names=("viscous", "coulomb"), plan=PLANS["drive"], strength_sigma=4.0)
    first = diagnose(load_dataset(play(scenario, 3)[0]))
    planned = next_plan(first, HOUR_S)
    assert {one.effect for one in planned.sharper} == set(first.effects)
    assert all(one.planned <= one.repeated for one in planned.sharper)
