"""Learning an axis from a calibration, scored against errors that are written out here or printed in the thesis."""

import types
from dataclasses import replace

import numpy as np
import pytest

from rtec.effects import Conditions
from rtec.errors import ArgumentError
from rtec.injector import Design
from rtec.machine import Laser
from rtec.metrology import MeasuringPlan
from rtec.predictors import BidirectionalTable, LatheNetwork
from rtec.study import builtin_study, run_study
from rtec.study.learning import learn, second_plan
from rtec.study.run import machine_of

INCH = 25.4


def at(places):
    """Return the conditions of readings at some places, forward."""
    return Conditions(position=places, position_unit="mm", run=np.ones(places.size, dtype=np.int64))


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


# the lathe


@pytest.fixture(scope="module")
def lathe():
    """Return the built-in study with the readings of its calibration and what is learned from them."""
    study = builtin_study()
    return study, learn(study, machine_of(study), lambda what, seconds: lambda share: None)


def off_truth(learned, predictor):
    """Return what a predictor is off the printed network all along the travel, between the targets, too."""
    grid = np.linspace(25.4, 1016.0, 30_001)
    return np.concatenate([predictor.error_mm(grid, way) - LatheNetwork().error_mm(grid, way) for way in (1, -1)])


def test_the_calibration_is_the_thesiss_and_has_its_own_noise(lathe):
    study, learned_model = lathe
    readings = learned_model.rounds[0].readings
    assert readings.size == 12_488
    assert np.unique(readings.target_mm) == pytest.approx(np.linspace(1, 40, 1561) * INCH, abs=1e-4 * INCH)
    truth = np.where(
        readings.direction > 0,
        LatheNetwork().error_mm(readings.target_mm, 1),
        LatheNetwork().error_mm(readings.target_mm, -1),
    )
    noise = readings.deviation_mm - truth
    # one micrometre of noise, and rest up to half a count beside the target
    assert 0.0009 < np.std(noise) < 0.0012
    rows = np.random.default_rng(study.seed).normal(0.0, 0.001, 760)
    assert abs(np.corrcoef(noise[:760], rows)[0, 1]) < 0.15


def test_the_second_round_meets_what_the_first_hides_at_a_quarter_of_its_machine_time(lathe):
    first, second = lathe[1].rounds
    assert first.diagnosis.unseen_periods == ("0.635 mm / k", "1.27 mm")
    assert np.unique(np.round(np.mod(first.readings.target_mm, 6.35), 3) % 6.35).size == 10
    assert np.unique(np.round(np.mod(second.readings.target_mm, 6.35), 3) % 6.35).size > 1000
    assert second.readings.size < first.readings.size / 4
    assert second.machine_s < first.machine_s / 4
    # the second readings took no part in the first search, and show what it could not know
    assert np.sqrt(np.mean(second.missed_mm**2)) > 0.0014
    assert np.sqrt(np.mean(second.left_mm**2)) < 0.00115
    assert lathe[1].readings.size == first.readings.size + second.readings.size


def test_the_second_round_brings_the_model_nearer_to_the_axis_all_along(lathe):
    first, second = lathe[1].rounds
    whole = off_truth(lathe[1], lathe[1].predictor)
    assert rms(whole) == pytest.approx(second.score.rms_mm, rel=0.02)
    assert rms(whole) < 0.0007
    assert first.score.rms_mm > 0.001


def test_a_distance_that_the_program_cannot_write_is_no_second_round():
    plan = replace(short().calibration, end_mm=33.02, increment_mm=0.0254)
    hidden = types.SimpleNamespace(dataset=types.SimpleNamespace(coordinates=at(plan.targets_mm)))
    assert second_plan(plan, hidden) is None
    wide = replace(plan, end_mm=101.6, increment_mm=0.254)
    hidden = types.SimpleNamespace(dataset=types.SimpleNamespace(coordinates=at(wide.targets_mm)))
    assert second_plan(wide, hidden).increment_mm == 0.0104 * 25.4


def test_the_model_is_below_1_7_um_of_the_noise_free_curve(lathe):
    learned_model = lathe[1]
    grid = np.linspace(1, 40, 1561) * INCH
    curve = {way: LatheNetwork().error_mm(grid, way) for way in (1, -1)}
    before = rms(np.concatenate([curve[1], curve[-1]]))
    after = rms(np.concatenate([learned_model.predictor.error_mm(grid, way) - curve[way] for way in (1, -1)]))
    assert before == pytest.approx(0.0854, abs=0.0001)
    assert after < 0.0017
    scores = learned_model.scores
    assert scores[0].rms_mm == pytest.approx(before, rel=1e-6)
    assert scores[-1].rms_mm == pytest.approx(after, rel=0.02)  # the table's straight lines
    assert [score.rms_mm for score in scores] == sorted((score.rms_mm for score in scores), reverse=True)
    assert len(scores) == 1 + len(learned_model.diagnosis.steps)


def test_the_effects_are_those_of_the_screw(lathe):
    learned_model = lathe[1]
    names = set(learned_model.diagnosis.effects)
    assert names & {"backlash", "backlash_map"}
    assert {"cyclic", "pitch_map"} <= names
    shape = next(term.shape for term in learned_model.diagnosis.model.terms if term.name == "cyclic")
    assert shape.by_direction
    assert shape.period == pytest.approx(6.35, abs=0.001)
    assert shape.harmonics > 5, "ten targets a turn would show no more"
    # the printed network jumps where the screw has turned once, and no reading stands between the step and there
    assert 6.35 - 6.35 / 200 < shape.step_at <= 6.35
    first = next(t.shape for t in learned_model.rounds[0].diagnosis.model.terms if t.name == "cyclic")
    assert 3 <= first.harmonics <= 5 and first.step_at == 0.0
    assert learned_model.left_out == ()


# a short axis with a straight error: a lead 1e-4 too long, and 60 um of lost motion


def short(**changes):
    plan = MeasuringPlan(
        start_mm=25.4,
        end_mm=91.44,
        increment_mm=13.208,
        dwell_s=4,
        runs=2,
        feed_mm_s=50 * 25.4 / 60,
        overshoot_mm=2.54,
    )
    ends = np.array([0.0, 1000.0])
    error = BidirectionalTable(
        forward_positions_mm=ends,
        forward_errors_mm=1e-4 * ends,
        reverse_positions_mm=ends,
        reverse_errors_mm=1e-4 * ends + 0.06,
    )
    values = {
        "plan": plan, "calibration": replace(plan, increment_mm=2.54, runs=3), "axis_error": error,
        "laser": Laser(dwell_s=2.0), "feeds_mm_s": (), "hold_growth_mm": 0.01, "hold_time_constant_s": 1.0,
        "designs": (Design.B,), "period_mm": None,
    } | changes  # fmt: skip
    return replace(builtin_study(), **values)


@pytest.fixture(scope="module")
def learned():
    return run_study(short())


def test_what_was_learned_corrects_the_axis(learned):
    assert learned.learned.readings.size == 3 * 2 * 27
    assert {"backlash", "scale"} == set(learned.learned.diagnosis.effects)
    assert learned.learned.diagnosis.rms_before > 0.03
    error = {row.name: row.figures.rms for row in learned.rows}
    assert error["uncompensated"] > 0.03
    assert error["table"] < 0.002
    assert error["b"] < 0.002
    assert learned.rows[-1].run.insertions.inserted > 60
    assert learned.predictor_score.rms_mm < 0.001
    assert learned.predictor_score.worst_mm < 0.0015
    assert learned.good


def test_without_noise_it_learns_as_well():
    result = run_study(short(repeatability_mm=0.0))
    assert {"backlash", "scale"} <= set(result.learned.diagnosis.effects)
    assert result.predictor_score.rms_mm < 0.001
    assert result.rows[-1].figures.rms < 0.0012  # a count is one micrometre


def test_a_perfect_axis_is_left_alone():
    flat = BidirectionalTable(
        forward_positions_mm=[0, 1000], forward_errors_mm=[0, 0], reverse_positions_mm=[0, 1000],
        reverse_errors_mm=[0, 0],
    )  # fmt: skip
    result = run_study(short(axis_error=flat, seed=4))
    # an axis at rest stands up to half a count short of its target: a reversal error of less than one count
    assert set(result.learned.diagnosis.effects) <= {"backlash"}
    assert result.predictor_score.worst_mm < 0.001


def test_two_targets_are_learned_from_as_far_as_they_go():
    calibration = replace(short().calibration, increment_mm=66.04, runs=3)
    result = run_study(short(calibration=calibration))
    assert result.good
    assert result.learned.readings.size == 12


def test_a_calibration_that_fails_is_named():
    # a filter of 15 kHz cannot follow 50 inch/min: counts are lost, and the axis misses its targets
    slow = replace(builtin_study().receiver, filter_samples=1, clock_hz=15_000)
    calibration = replace(short().calibration, increment_mm=66.04, runs=1)
    with pytest.raises(ArgumentError, match=r"calibration: [1-4] of 4 readings missing \(FINISHED after"):
        run_study(short(receiver=slow, calibration=calibration))
