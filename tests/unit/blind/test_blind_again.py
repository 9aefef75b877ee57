"""The hidden axis under another plan: it keeps its numbers, and acts by them on the new readings."""

from dataclasses import fields, replace

import numpy as np
import pytest

from rtec.blind.game import again, play
from rtec.blind.plan import PLANS
from rtec.blind.scenario import INSIDE, OF_DRIVE, OUTSIDE, Scenario, unfit
from rtec.errors import ArgumentError
from rtec.metrology import ExperimentPlan, Heating, Passes, Reading, Strokes, Weather, Zero

RESOLUTION_MM = 2.1e-5
SEED = 5
DRAWN_ANEW = {"spread", "before_reading"}
"""Numbers that are set or met anew in each measurement."""
EXPERIMENT = ExperimentPlan(
    runs=6,
    targets=31,
    start_mm=25.0,
    span_mm=280.0,
    feeds_mm_s=(40.0, 20.0),
    heating=Heating.COLD_AND_HOT,
    weather=Weather.DAYS,
    columns=("direction", "time", "feed", "temperature", "pressure", "humidity"),
)


def as_experiment(plan, **changes):
    return replace(ExperimentPlan(**{f.name: getattr(plan, f.name) for f in fields(ExperimentPlan)}), **changes)


def first_plan(name):
    plans = (*PLANS.values(), replace(PLANS["base"], targets=41))
    return next(plan for plan in plans if unfit(name, plan) is None)


def read(measurement, *names):
    return [measurement.columns[name].values for name in names]


def added(name, plan, experiment, observed=None):
    """Return what an effect adds to the second measurement, that measurement, and the effect's numbers."""
    game, bare = Scenario(names=(name,), plan=plan), Scenario(plan=plan)
    with_it, secret = again(game, SEED, experiment)
    without, _ = again(bare, SEED, experiment)
    what = observed or "actual"
    numbers = {p.name: p.value for p in secret.effects[0].parameters}
    return with_it.columns[what].values - without.columns[what].values, with_it, numbers


@pytest.mark.one_in(7)
@pytest.mark.parametrize("name", [*INSIDE, *OUTSIDE, *OF_DRIVE])
def test_what_is_hidden_keeps_its_numbers(name):
    plan = first_plan(name)
    game = Scenario(names=(name,), plan=plan)
    experiment = as_experiment(plan, runs=1 if plan.passes is Passes.FORWARD and plan.in_motion else plan.runs + 1)
    (before,), (after,) = (secret.effects for secret in (play(game, SEED)[1], again(game, SEED, experiment)[1]))
    assert after.description == before.description
    numbers = [{p.name: p.value for p in one.parameters if p.name not in DRAWN_ANEW} for one in (before, after)]
    assert numbers[0] == numbers[1]
    assert 0.2 < after.rms_sigma / before.rms_sigma < 5.0


def test_heat_and_air_are_those_of_the_new_measurement():
    what, measurement, numbers = added("thermal_shift", PLANS["one_heating"], EXPERIMENT)
    heat, target, pressure, humidity = read(measurement, "temperature", "target", "pressure", "humidity")
    assert np.ptp(heat) > 3.0
    assert what == pytest.approx(numbers["shift"] * 1e-3 * (heat - 20.0), abs=abs(numbers["shift"]) * 1e-4)
    what, _, numbers = added("refraction", PLANS["one_day"], EXPERIMENT)
    ppm = (pressure - 1013.25) / 3.73 - 0.0084 * (humidity - 50.0)
    assert what == pytest.approx(numbers["share"] * 1e-6 * ppm * target, abs=0.06 * np.abs(what).max())


def test_counts_are_lost_again_at_the_same_share_of_the_record():
    what, _, numbers = added("lost_counts", PLANS["two_runs"], EXPERIMENT)
    first = int(numbers["before_reading"]) - 1
    assert first == what.size // 2
    assert what[:first] == pytest.approx(0.0, abs=RESOLUTION_MM)
    assert what[first:] == pytest.approx(numbers["counts"] * 1e-3, abs=2 * RESOLUTION_MM)


def zeros_of(experiment):
    what, measurement, _ = added("run_offset", PLANS["two_runs"], experiment)
    (run,) = read(measurement, "run")
    return np.array([what[run == k].mean() for k in np.unique(run)])


def test_the_zero_of_each_run_is_set_anew_unless_the_plan_keeps_it():
    anew = zeros_of(EXPERIMENT)
    assert anew.size == 6
    assert np.abs(np.diff(np.sort(anew))).min() > 1e-4
    kept = zeros_of(replace(EXPERIMENT, zero=Zero.KEPT))
    assert kept[-1] == pytest.approx(kept[-2], abs=RESOLUTION_MM)
    assert np.abs(np.diff(kept[:-1])).min() > 1e-4


def test_targets_are_shifted_run_by_run_in_turn():
    measurement, _ = again(Scenario(), SEED, replace(EXPERIMENT, shifts_mm=(0.0, 1.5)))
    run, target = read(measurement, "run", "target")
    first, second, third = (np.unique(target[run == k]) for k in (1, 2, 3))
    assert second == pytest.approx(first + 1.5, abs=1e-9)
    assert third.tolist() == first.tolist()


def test_friction_is_that_of_the_new_speeds_and_angles():
    turn = ExperimentPlan(
        reading=Reading.DRIVE,
        rotary=True,
        runs=2,
        start_mm=20.0,
        span_mm=360.0,
        strokes=Strokes.FULL,
        feeds_mm_s=(40.0, 20.0),
        columns=("time", "velocity", "torque"),
    )
    what, measurement, numbers = added("viscous", PLANS["one_speed"], turn, "torque")
    angle, velocity = read(measurement, "actual", "velocity")
    assert what == pytest.approx(numbers["viscous"] * velocity, abs=0.011 + 2e-3 * numbers["viscous"])
    assert np.ptp(angle) == pytest.approx(360.0, abs=0.01)
    for feed in (-40.0, -20.0, 20.0, 40.0):
        assert (np.abs(velocity - feed) < 1e-3).mean() > 0.1
    what, _, numbers = added("gravity", PLANS["joint"], turn, "torque")
    lever = np.sin(np.radians(angle - numbers["hangs_at"]))
    assert what == pytest.approx(numbers["largest"] * lever, abs=0.011 + 1e-4 * numbers["largest"])


def test_given_loads_are_on_the_axis_in_turn():
    loads = as_experiment(PLANS["loads"], loads_kg=(10.0, 40.0))
    run, load = read(again(Scenario(plan=PLANS["loads"]), SEED, loads)[0], "run", "load")
    assert [np.unique(load[run == k]).tolist() for k in (1, 2, 3)] == [[10.0], [40.0], [10.0]]


def test_the_noise_is_another_draw_each_time():
    experiment = as_experiment(PLANS["base"])
    records = [again(Scenario(), SEED, experiment, number)[0] for number in (1, 2, 1)]
    one, two, same = (read(record, "actual")[0] for record in records)
    assert np.array_equal(one, same)
    assert not np.isclose(one, two, rtol=0.0, atol=1e-9).any()


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"start_mm": 5.0}, r"start_mm: 5 mm .* within 14 to 326 mm"),
        ({"span_mm": 400.0}, r"span_mm: an end at 425 mm; .* 14 to 326 mm"),
        ({"span_mm": 299.0, "shifts_mm": (0.0, 2.0)}, "span_mm"),
        ({"reading": Reading.MOVING}, "'position in motion' is not valid; use 'position at rest'"),
        ({"rotary": True}, "a position in mm"),
        ({"feeds_mm_s": (200.0,)}, "feeds_mm_s"),
        ({"columns": ("time", "current")}, "current"),
    ],
)
def test_what_the_axis_cannot_do_is_refused(changes, says):
    with pytest.raises(ArgumentError, match=says):
        again(Scenario(), SEED, replace(EXPERIMENT, **changes))
