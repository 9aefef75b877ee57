"""The plan of the next experiment: what was measured, changed by what the experiment asks."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import measured

from rtec.blind.game import play
from rtec.blind.plan import PLANS
from rtec.blind.scenario import Scenario
from rtec.dataset.load import load_dataset
from rtec.effects import LIBRARY, Observable, experiments
from rtec.effects.experiments import ASKS, Ask
from rtec.inference.diagnose import diagnose
from rtec.inference.results import Experiment
from rtec.inference.suggested_plan import THREE_HOURS_S, changed, measured_plan, suggested_plan
from rtec.metrology import ExperimentPlan, Heating, Passes, Reading, Spacing, Strokes, Weather, Zero

POOR = ExperimentPlan(runs=1, passes=Passes.FORWARD)
LOG = replace(POOR, reading=Reading.DRIVE, columns=("time", "velocity", "force"), feeds_mm_s=(20.0,))
DATA = measured()


def after(plan, *asks, data=DATA):
    return changed(plan, frozenset(asks), data)


def game(plan, names=(), **scenario):
    return load_dataset(play(Scenario(names=names, plan=PLANS[plan], **scenario), 3)[0])


def test_every_experiment_says_what_it_asks():
    sentences = {value for name, value in vars(experiments).items() if name.isupper() and isinstance(value, str)}
    assert sentences == set(ASKS)
    for effect in LIBRARY:
        for rival in effect.rivals:
            assert rival.experiment in ASKS
            assert bool(ASKS[rival.experiment]) or rival.experiment in (
                experiments.SECOND_INSTRUMENT,
                experiments.FINE_STEPS,
                experiments.SEVERAL_TURNS,
            )


@pytest.mark.parametrize("name", ["base", "temperature", "weather", "one_feed", "single_pass", "one_day", "dwell"])
def test_a_plan_at_rest_is_known_from_its_readings(name):
    plan, found = PLANS[name], measured_plan(game(name))
    for field in ("reading", "runs", "targets", "passes", "heating", "weather", "rotary", "feeds_mm_s"):
        assert getattr(found, field) == getattr(plan, field), field
    assert set(found.columns) == set(plan.columns)
    assert found.start_mm == pytest.approx(plan.start_mm, abs=3.6)  # offsets of the targets, and a whole mm
    assert found.end_mm == pytest.approx(plan.end_mm, abs=3.6)
    assert found.dwell_s == pytest.approx(plan.dwell_s, abs=1.5)


@pytest.mark.parametrize("name", ["moving", "drive", "joint", "one_speed"])
def test_a_plan_in_motion_is_known_from_its_log(name):
    plan, found = PLANS[name], measured_plan(game(name))
    for field in ("reading", "runs", "passes", "rotary", "columns"):
        assert getattr(found, field) == getattr(plan, field), field
    assert found.strokes is (Strokes.FULL if plan.passes is Passes.FORWARD else Strokes.SHORT)
    assert max(found.feeds_mm_s) == max(plan.feeds_mm_s)
    assert found.span_mm <= plan.span_mm


def test_speeds_of_a_log_are_those_it_holds():
    log = game("moving")
    c = log.conditions
    noisy = replace(log, conditions=replace(c, velocity=c.velocity * (1.0 + 0.05 * np.sin(np.arange(c.rows)))))
    assert len(measured_plan(noisy).feeds_mm_s) == 3
    held = game("drive")
    assert measured_plan(held) is not None
    assert measured_plan(replace(held, conditions=replace(held.conditions, moving=False))) is None


def test_both_directions_and_five_runs():
    plan = after(POOR, Ask.BOTH_DIRECTIONS, Ask.FIVE_RUNS)
    assert (plan.passes, plan.runs) == (Passes.BOTH, 5)
    assert after(replace(POOR, runs=9), Ask.FIVE_RUNS).runs == 9
    assert after(replace(POOR, columns=("time",)), Ask.BOTH_DIRECTIONS).columns == ("time", "direction")
    assert after(replace(POOR, runs=4), Ask.MORE_RUNS).runs == 16


def test_feeds_come_down_to_creep_and_twice():
    plan = after(POOR, Ask.SPEEDS)
    assert plan.feeds_mm_s == (40.0, 20.0, 2.0)
    assert (plan.runs, "feed" in plan.columns) == (6, True)
    log = after(LOG, Ask.SPEEDS, Ask.BOTH_DIRECTIONS)
    assert log.feeds_mm_s == (20.0, 10.0, 4.0)
    assert (log.passes, log.strokes, log.runs) == (Passes.BOTH, Strokes.FULL, 2)
    assert after(LOG, Ask.SPEEDS, Ask.CREEP).feeds_mm_s[-1] == 0.2
    many = replace(LOG, feeds_mm_s=(40.0, 9.0, 5.0, 1.0))
    assert after(many, Ask.SPEEDS).feeds_mm_s == many.feeds_mm_s


def test_readings_come_dense_after_reversals():
    plan = after(POOR, Ask.AFTER_REVERSALS, Ask.BOTH_DIRECTIONS)
    assert (plan.spacing, plan.targets, plan.passes) == (Spacing.DENSE_AT_ENDS, 41, Passes.BOTH)


def test_the_surroundings_change_from_run_to_run_and_are_recorded():
    heated = after(POOR, Ask.COLD_AND_HOT)
    assert (heated.heating, heated.runs % 2) == (Heating.COLD_AND_HOT, 0)
    assert {"time", "temperature"} <= set(heated.columns)
    aired = after(POOR, Ask.OTHER_DAYS)
    assert (aired.weather, aired.runs) == (Weather.DAYS, 8)
    assert {"pressure", "humidity"} <= set(aired.columns)
    loaded = after(replace(LOG, passes=Passes.BOTH), Ask.LOADS)
    assert (len(loaded.loads_kg), loaded.runs, loaded.columns[-1]) == (3, 3, "load")
    kept = after(POOR, Ask.ZERO_KEPT, Ask.FIVE_RUNS)
    assert (kept.zero, kept.runs) == (Zero.KEPT, 6)


def test_a_joint_turns_once_and_a_slide_does_not():
    joint = after(replace(LOG, rotary=True, span_mm=10.0), Ask.WHOLE_TURN, Ask.BOTH_DIRECTIONS)
    assert (joint.span_mm, joint.strokes, joint.passes) == (360.0, Strokes.FULL, Passes.BOTH)
    assert after(LOG, Ask.WHOLE_TURN).span_mm == LOG.span_mm


def test_it_lasts_three_hours_where_that_is_asked():
    plan = after(POOR, Ask.THREE_HOURS, Ask.FIVE_RUNS)
    assert plan.duration_s >= THREE_HOURS_S
    assert plan.dwell_s <= 100.0
    assert after(replace(POOR, columns=()), Ask.THREE_HOURS, Ask.TEMPERATURES).columns == ("time", "temperature")
    assert after(LOG, Ask.THREE_HOURS) == LOG


def test_targets_are_shifted_by_what_hides():
    grid = measured(at=np.arange(0.0, 101.0, 5.0))
    plan = after(measured_plan(grid), Ask.SHIFTED_TARGETS, data=grid)
    assert plan.shifts_mm == (0.0, 1.5, 3.0)
    assert (plan.end_mm, plan.targets, plan.runs) == (95.0, 20, 6), "as far apart as they were"
    assert after(POOR, Ask.MORE_TARGETS).targets == 42


def test_fine_steps_are_a_twentieth_of_the_shortest_period():
    data = replace(DATA, conditions=replace(DATA.conditions, screw_pitch=5.0, signal_period=2.0))
    plan = after(POOR, Ask.FINE_STEPS, data=data)
    assert (plan.span_mm, plan.targets) == (10.0, 101)


def test_no_plan_says_why():
    diagnosis = diagnose(measured(lambda x, way, t, run: 0.005 * way))
    none = replace(diagnosis, experiment=Experiment(text="use a second instrument"))
    found = suggested_plan(none)
    assert found.plan is None
    assert "use a second instrument" in found.reason
    clock = replace(diagnosis, dataset=measured(unit="s", bidirectional=False))
    asked = replace(clock, experiment=Experiment(text="more", asks=frozenset((Ask.FIVE_RUNS,))))
    assert "no targets" in suggested_plan(asked).reason
    large = measured(at=np.linspace(0.0, 300.0, 1500), runs=2)
    asked = replace(asked, dataset=large, experiment=Experiment(text="more", asks=frozenset((Ask.MORE_TARGETS,))))
    found = suggested_plan(asked)
    assert found.plan is None
    assert "targets: 3000" in found.reason


def test_a_weight_is_asked_for_where_a_joint_hardly_turned():
    diagnosis = diagnose(game("one_pose", ("viscous",), strength_sigma=5.0))
    assert diagnosis.dataset.observable is Observable.DRIVE
    assert {Ask.WHOLE_TURN, Ask.SPEEDS} <= diagnosis.experiment.asks
    assert suggested_plan(diagnosis).plan.span_mm == 360.0
    # over a wider angle a weight could be tested, but does all that one speed's friction does
    assert Ask.WHOLE_TURN in diagnose(game("one_speed", ("viscous",), strength_sigma=5.0)).experiment.asks


def test_what_was_recorded_and_came_once_is_varied_without_repeats():
    texts = {name: diagnose(game(name)).experiment for name in ("one_heating", "one_day", "sparse", "single_pass")}
    assert Ask.COLD_AND_HOT in texts["one_heating"].asks
    assert Ask.OTHER_DAYS in texts["one_day"].asks
    assert Ask.AFTER_REVERSALS in texts["sparse"].asks
    assert texts["single_pass"].asks == {Ask.FIVE_RUNS}
