"""The whitened data set: scans, folding, the mean run, evidence - against dense matrices and full fits."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import covariance, fall, measured, rss, whitened
from scipy import stats

from rtec.effects import LIBRARY, Observable, Shape, effect_named
from rtec.inference.noise import Noise, noise_from_repeats
from rtec.inference.repeat_space import run_starts
from rtec.inference.whitening import Correlation
from rtec.inference.workspace import NODES_WITHOUT_REPEATS, Workspace, is_map, scan_cost

CYCLIC, SCALE, BACKLASH = effect_named("cyclic"), effect_named("scale"), effect_named("backlash")
MAP, OFFSET, DRIFT = effect_named("pitch_map"), effect_named("offset"), effect_named("drift")
WAVY = lambda x, way, t, run: 0.004 * np.sin(2 * np.pi * x / 47.0) + 0.003 * way + 2e-6 * t


def noise(rho=0.0, white=0.0, sigma=0.002, *, from_repeats=True, freedom=100.0):
    return Noise(
        sigma=sigma, correlation=Correlation(rho=rho, white=white), freedom=freedom, from_repeats=from_repeats
    )


def dense(data, rho, white):
    return covariance(rho, white, run_starts(data.conditions.run))


@pytest.mark.parametrize(("rho", "white"), [(0.0, 0.0), (0.9, 0.0), (0.95, 0.3)])
def test_columns_are_whitened_as_by_the_dense_covariance(rho, white):
    data = measured(WAVY, runs=3, targets=9)
    work = Workspace(data, noise(rho, white))
    matrix = dense(data, rho, white)
    assert work.observed == pytest.approx(whitened(data.observed[None, :], matrix)[0])
    assert work.constant == pytest.approx(whitened(np.ones((1, data.rows)), matrix))
    shape = CYCLIC.shape_type(47.0, 2)
    assert work.columns(CYCLIC, shape) == pytest.approx(whitened(data.columns(CYCLIC, shape).T, matrix))
    assert work.strict is work


@pytest.mark.parametrize(("rho", "white"), [(0.0, 0.0), (0.95, 0.3)])
@pytest.mark.parametrize("name", ["cyclic", "backlash", "windup", "drift", "warm_up", "lost_counts", "pitch_map"])
def test_the_best_of_a_scan_gains_what_two_full_fits_say(name, rho, white):
    data = measured(WAVY, runs=3, at=np.sort(np.random.default_rng(0).uniform(0, 300, 11)) - 5.0)
    work, effect = Workspace(data, noise(rho, white)), effect_named(name)
    others = [(SCALE, Shape()), (DRIFT, Shape())]
    others = [choice for choice in others if choice[0] is not effect]
    matrix = dense(data, rho, white)
    model = [np.ones(data.rows), *(data.columns(e, s)[:, 0] for e, s in others)]
    model, y = whitened(np.array(model), matrix), whitened(data.observed[None, :], matrix)[0]
    falls = {}
    for shape in work.maps(effect) if is_map(effect) else effect.shapes(data.conditions):
        falls[shape] = fall(model, whitened(data.columns(effect, shape).T, matrix), y)
    back = work.background(others)
    assert back.rss == pytest.approx(rss(model, y))
    found = work.best_of_scan(effect, back)
    assert found.gain == pytest.approx(falls[found.shape], rel=1e-5)
    if not is_map(effect):
        assert found.gain == pytest.approx(max(falls.values()), rel=1e-5)
    judged = work.judge(effect, found.shape, back)
    assert judged.gain == pytest.approx(found.gain, rel=1e-6)
    assert judged.before == pytest.approx(back.rss)


def test_folded_scans_find_what_unfolded_ones_find():
    data = measured(WAVY, runs=4, targets=9)
    whole = replace(data, cell=np.where(data.cell == 0, -1, data.cell))  # equal runs no more
    for given in (noise(), noise(0.9, 0.2)):
        folded, unfolded = Workspace(data, given), Workspace(whole, given)
        for effect in folded.library:
            if not is_map(effect):
                copies = {copies for *_, copies in folded.scan(effect)}
                assert copies == ({1} if effect.in_time else {4}), effect.name
                assert {copies for *_, copies in unfolded.scan(effect)} == {1}
            first = folded.best_of_scan(effect, folded.background([(SCALE, Shape())]))
            second = unfolded.best_of_scan(effect, unfolded.background([(SCALE, Shape())]))
            assert (first.shape, first.amplitudes) == (second.shape, second.amplitudes)
            assert first.gain == pytest.approx(second.gain, rel=1e-6, abs=1e-12)


def test_runs_at_other_places_are_not_folded():
    data = measured(WAVY, runs=2, targets=9)
    moved = data.conditions.position + np.where(data.conditions.run == 2, 1e-5, 0.0)
    moved = replace(data, conditions=replace(data.conditions, position=moved))
    assert {copies for *_, copies in Workspace(moved, noise()).scan(BACKLASH)} == {1}
    assert Workspace(moved, noise()).mean_run is None


def test_the_mean_run_holds_all_that_repeatable_effects_explain():
    data = measured(WAVY, runs=4, targets=12)
    for given in (noise(), noise(0.9, 0.2)):
        work = Workspace(data, given)
        mean = work.mean_run
        assert mean.dataset.rows == 24
        assert mean.noise.sigma == pytest.approx(work.noise.sigma / 2)
        assert not any(effect.in_time for effect in mean.library)
        assert {e.name for e in work.library} - {e.name for e in mean.library} == {
            e.name for e in work.library if e.in_time
        }
        for effect in mean.library:
            own = work.best_of_scan(effect, work.background([(SCALE, Shape())]))
            alike = mean.best_of_scan(effect, mean.background([(SCALE, Shape())]))
            assert own.shape == alike.shape
            assert alike.evidence == pytest.approx(own.evidence, abs=1e-6)


def test_a_wave_that_is_nearly_constant_at_the_places_explains_nothing():
    at = 10.0 * np.arange(12) + 1e-4 * np.random.default_rng(0).normal(size=12)
    work = Workspace(measured(WAVY, at=at), noise())
    back = work.background(())
    assert work.judge(CYCLIC, CYCLIC.shape_type(10.0), back).gain == 0.0
    assert work.judge(CYCLIC, CYCLIC.shape_type(47.0), back).gain > 0.0


def test_friction_below_zero_explains_nothing():
    friction = effect_named("viscous")
    data = measured(bidirectional=True)
    speed = 5.0 * data.conditions.direction
    drive = replace(
        data, observable=Observable.DRIVE, conditions=replace(data.conditions, velocity=speed, moving=True)
    )
    for sign in (1.0, -1.0):
        work = Workspace(replace(drive, observed=sign * speed), noise())
        assert not work.has_datum
        gain = work.judge(friction, Shape(), work.background(())).gain
        assert gain == pytest.approx(float(speed @ speed) if sign > 0 else 0.0)


def test_the_constant_is_no_background_of_a_constant():
    data = measured(lambda x, way, t, run: 0.01 + 0 * x, sigma=1e-4)
    work = Workspace(data, noise())
    assert work.judge(OFFSET, Shape(), work.background(())).gain == 0.0
    assert work.judge(OFFSET, Shape(), work.beside((), OFFSET)).gain == pytest.approx(210 * 1e-4, rel=1e-2)
    assert work.beside((), SCALE).basis.shape[1] == 1


def test_evidence_is_the_fall_less_what_the_parameters_cost():
    data = measured(WAVY)
    work = Workspace(data, noise())
    found = work.judge(CYCLIC, CYCLIC.shape_type(47.0, 2), work.background(()))
    # four amplitudes and a period, each for the logarithm of the readings (Schwarz)
    assert found.evidence == pytest.approx(found.gain / 0.002**2 - 5 * np.log(210))
    assert work.p_value(found) == pytest.approx(stats.f.sf(found.gain / 4 / 0.002**2, 4, 100))
    assert work.p_value(replace(found, amplitudes=0)) == 1.0


def test_the_total_is_that_of_the_whole_model():
    data = measured(WAVY)
    work = Workspace(data, noise(0.5))
    choices = [(CYCLIC, CYCLIC.shape_type(47.0)), (BACKLASH, Shape())]
    matrix = dense(data, 0.5, 0.0)
    columns = np.vstack([np.ones(data.rows), *(data.columns(e, s).T for e, s in choices)])
    y = whitened(data.observed[None, :], matrix)[0]
    gain = rss(whitened(np.ones((1, 210)), matrix), y) - rss(whitened(columns, matrix), y)
    # constant, two waves, a reversal error, and the period
    assert work.total(choices) == pytest.approx(gain / 0.002**2 - 5 * np.log(210))


def test_without_repeats_nothing_is_whitened_until_the_test():
    data = measured(WAVY, runs=1)
    work = Workspace(data, noise(0.9, from_repeats=False))
    assert work.ordinary
    assert (work.observed == data.observed).all()
    assert not work.strict.ordinary
    starts = np.arange(data.rows) == 0
    assert work.strict.observed == pytest.approx(whitened(data.observed[None, :], covariance(0.9, 0.0, starts))[0])
    back = work.background(())
    found = work.judge(CYCLIC, CYCLIC.shape_type(47.0), back)
    # twice the log-likelihood of the variance profiled out
    assert found.evidence == pytest.approx(42 * np.log(back.rss / (back.rss - found.gain)) - 3 * np.log(42))
    assert work.worth(0.0, 0.0) == 0.0


def test_without_repeats_a_trifle_has_no_evidence_and_maps_are_coarse():
    data = measured(runs=1, targets=2000)
    work = Workspace(
        replace(data, observed=data.observed + 0.0003 * data.conditions.direction), noise(from_repeats=False)
    )
    found = work.judge(BACKLASH, Shape(), work.background(()))
    assert found.gain < 0.03 * found.before
    assert found.evidence <= (-1.0 if found.gain < 0.02 * found.before else np.inf)
    assert max(len(shape.nodes) for shape in work.maps(MAP)) <= NODES_WITHOUT_REPEATS
    assert max(len(shape.nodes) for shape in Workspace(measured(), noise()).maps(MAP)) > NODES_WITHOUT_REPEATS


def test_the_library_is_what_the_data_can_show():
    work = Workspace(measured(), noise())
    names = {effect.name for effect in work.library}
    assert {"scale", "backlash", "cyclic", "drift", "lost_counts"} <= names
    assert not names & {"thermal_growth", "servo_lag", "cosine", "inertia", "quantisation"}
    assert work.reasons["thermal_growth"] == "no temperature column"
    assert set(work.reasons) == {e.name for e in LIBRARY if e.observable is Observable.DEVIATION}


def test_the_cost_of_choosing_a_shape():
    assert scan_cost(CYCLIC, CYCLIC.shape_type(5.0, 3)) == 1
    assert scan_cost(MAP, MAP.shape_type((0.0, 1.0, 2.0))) == 0
    step = effect_named("lost_counts")
    assert scan_cost(step, step.shape_type(5.0)) == 2
    assert [e.name for e in LIBRARY if is_map(e)] == ["pitch_map", "backlash_map"]


def test_scans_too_large_to_keep_are_made_again(monkeypatch):
    data = measured(WAVY)
    kept = Workspace(data, noise())
    monkeypatch.setattr("rtec.inference.workspace._KEEP_BYTES", 0)
    monkeypatch.setattr("rtec.inference.workspace._AT_ONCE_BYTES", 8 * 42 * 2 * 7)  # seven shapes at a time
    again = Workspace(data, noise())
    assert len(list(again.scan(CYCLIC))) == -(-len(CYCLIC.shapes(data.conditions)) // 7)
    for effect in (CYCLIC, effect_named("lost_counts")):
        first = kept.best_of_scan(effect, kept.background(()))
        second = again.best_of_scan(effect, again.background(()))
        assert (first.shape, first.gain) == (second.shape, pytest.approx(second.gain))


def test_columns_are_kept_by_effect_and_shape(monkeypatch):
    monkeypatch.setattr("rtec.inference.workspace._KEPT_SHAPES", 2)
    data = measured(WAVY)
    work = Workspace(data, noise_from_repeats(data))
    for period in (10.0, 20.0, 30.0, 10.0):
        shape = CYCLIC.shape_type(period)
        assert work.columns(CYCLIC, shape) == pytest.approx(work.whitened(data.columns(CYCLIC, shape).T))
    assert work.columns(SCALE, Shape())[0] != pytest.approx(work.columns(BACKLASH, Shape())[0])
