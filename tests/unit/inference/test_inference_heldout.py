"""Held-out error against literal leave-out refits."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import covariance, left_out_residual, measured, whitened

from rtec.effects import Shape, effect_named
from rtec.inference.heldout import (
    FOLDS,
    HeldOutGain,
    blocked_rms,
    folds,
    gain_of,
    gain_on,
    held_out_residual,
    rms_by_folds,
)
from rtec.inference.model import Model, Term
from rtec.inference.noise import Noise
from rtec.inference.whitening import Correlation
from rtec.inference.workspace import Workspace

SCALE, BACKLASH, DRIFT = effect_named("scale"), effect_named("backlash"), effect_named("drift")
BOTH = [(SCALE, Shape()), (BACKLASH, Shape())]
TILTED = lambda x, way, t, run: 5e-5 * x + 0.004 * way


def noise(rho=0.0, *, sigma=0.002, from_repeats=True):
    return Noise(sigma=sigma, correlation=Correlation(rho=rho), freedom=100.0, from_repeats=from_repeats)


@pytest.mark.parametrize("rho", [0.0, 0.9])
@pytest.mark.parametrize("datum", [False, True])
def test_held_out_residuals_are_those_of_literal_refits(rho, datum):
    data = measured(TILTED, runs=3, targets=14)
    work = Workspace(data, noise(rho))
    starts = np.arange(data.rows) % 28 == 0
    matrix = covariance(rho, 0.0, starts)
    columns = [data.columns(e, s)[:, 0] for e, s in BOTH] + [np.ones(data.rows)] * datum
    table, y = whitened(np.array(columns), matrix).T, whitened(data.observed[None, :], matrix)[0]
    expected = left_out_residual(table, y, folds(data))
    assert held_out_residual(work, BOTH, datum=datum) == pytest.approx(expected, abs=1e-9)
    if not rho:
        assert rms_by_folds(work, BOTH, datum=datum) == pytest.approx(np.sqrt(np.mean(expected**2)))


def test_the_held_out_rms_is_of_readings_as_they_are():
    """Numbers from whitened readings, but the error of the raw ones."""
    data = measured(TILTED, runs=3, targets=14)
    work = Workspace(data, noise(0.9))
    matrix = covariance(0.9, 0.0, np.arange(data.rows) % 28 == 0)
    raw = np.array([data.columns(e, s)[:, 0] for e, s in BOTH]).T
    white, y = whitened(raw.T, matrix).T, whitened(data.observed[None, :], matrix)[0]
    left, fold = data.observed.copy(), folds(data)
    for number in np.unique(fold):
        test = fold == number
        left[test] -= raw[test] @ np.linalg.lstsq(white[~test], y[~test], rcond=None)[0]
    assert rms_by_folds(work, BOTH, datum=False) == pytest.approx(np.sqrt(np.mean(left**2)))


def test_without_a_model_everything_is_left():
    work = Workspace(measured(TILTED), noise())
    assert (held_out_residual(work, [], datum=False) == work.observed).all()
    assert rms_by_folds(work, [], datum=False) == pytest.approx(np.sqrt(np.mean(work.dataset.observed**2)))


def test_a_column_that_only_one_fold_shows_predicts_nothing_there():
    data = measured(TILTED, runs=1)  # by blocks of consecutive readings
    late = effect_named("lost_counts")
    moment = float(data.conditions.time_s[data.block == 4][0]) - 5.0
    work = Workspace(data, noise())
    found = held_out_residual(work, [*BOTH, (late, late.shape_type(moment))], datum=True)
    without = held_out_residual(work, BOTH, datum=True)
    assert found[data.block == 4] == pytest.approx(without[data.block == 4])


def test_folds_of_repeats_deal_stretches_so_that_each_place_is_kept_elsewhere():
    data = measured(runs=5, targets=21)
    fold = folds(data).reshape(5, 42)
    assert set(fold.ravel().tolist()) == set(range(FOLDS))
    for slot in range(42):
        assert np.unique(fold[:, slot]).size > 1  # held out in one run, kept in another
    changes = np.count_nonzero(np.diff(fold, axis=1), axis=1)
    assert (changes + 1 == 42 // 6).all()  # stretches of six readings or more


def test_folds_without_repeats_are_the_blocks():
    data = measured(runs=1)
    assert (folds(data) == data.block).all()


def test_a_gain_with_noise_from_repeats_has_the_error_of_the_noise():
    """The fall of squares e² − (e − d)² is 2ed − d²: its error 2 sigma |d|, here by simulation."""
    data = measured(runs=2, targets=10)
    work = Workspace(data, noise(sigma=0.002))
    rng = np.random.default_rng(0)
    d = rng.normal(0, 0.003, 40)
    draws = [gain_of(work, e + d, e) for e in rng.normal(0, 0.002, (2000, 40))]
    assert np.std([found.gain for found in draws]) == pytest.approx(draws[0].error, rel=0.1)
    assert np.mean([found.gain for found in draws]) == pytest.approx(np.mean(d**2), rel=0.05)


def test_a_gain_without_repeats_has_the_error_of_the_spread_between_stretches():
    data = measured(runs=1, targets=100)
    work = Workspace(data, noise(from_repeats=False))
    rng = np.random.default_rng(0)
    before, after = rng.normal(0, 3, 200), rng.normal(0, 1, 200)
    found = gain_of(work, before, after)
    assert found.gain == pytest.approx(np.mean(before**2 - after**2), rel=1e-6)
    means = (before**2 - after**2).reshape(25, 8).mean(axis=1)
    assert found.error == pytest.approx(means.std(ddof=1) / 5)


def test_a_gain_of_few_readings_without_repeats_has_the_error_of_correlated_noise():
    data = measured(runs=1, targets=20)
    before, after = np.full(40, 3.0), np.full(40, 1.0)
    white = gain_of(Workspace(data, noise(sigma=1.0, from_repeats=False)), before, after)
    assert white.error == pytest.approx(2 * np.sqrt(40 * 4.0) / 40)
    slow = gain_of(Workspace(data, noise(0.9, sigma=1.0, from_repeats=False)), before, after)
    assert slow.error == pytest.approx(white.error * np.sqrt(19.0))
    assert slow.gain == white.gain == pytest.approx(8.0)


@pytest.mark.parametrize(("gain", "error", "passes"), [(2.1, 1.0, True), (2.0, 1.0, False), (-3.0, 1.0, False)])
def test_a_gain_passes_above_two_errors(gain, error, passes):
    assert HeldOutGain(gain=gain, error=error).passes is passes


def model(*terms):
    data = measured()
    return Model(observe="deviation", units=data.units, terms=terms)


@pytest.mark.parametrize("from_repeats", [True, False])
def test_a_gain_on_another_measurement(from_repeats):
    other = measured(TILTED, runs=4, targets=30, seed=5)
    tilt = model(Term(effect=SCALE, shape=Shape(), amplitudes=(5e-5,)))
    found = gain_on(model(), tilt, other, noise(from_repeats=from_repeats))
    left = other.observed - 5e-5 * other.conditions.position
    falls = other.observed**2 - left**2
    assert found.gain == pytest.approx(falls.mean(), rel=0.02)
    moved = float(np.linalg.norm(5e-5 * other.conditions.position))
    by_noise = 2 * 0.002 * moved / other.rows
    assert (found.error == pytest.approx(by_noise)) is from_repeats
    assert found.passes


def test_a_model_with_nothing_open_is_compared_as_it_is():
    data = measured(TILTED)
    stated = model(Term(effect=SCALE, shape=Shape(), amplitudes=(5e-5,)))
    left = data.observed - 5e-5 * data.conditions.position
    assert blocked_rms(data, stated) == pytest.approx(np.sqrt(np.mean(left**2)))


def test_what_a_model_leaves_open_is_fitted_to_the_other_folds():
    data = measured(TILTED)
    partly = model(Term(effect=SCALE, shape=Shape(), amplitudes=(5e-5,)), Term(effect=BACKLASH))
    rest = data.observed - 5e-5 * data.conditions.position
    table = data.conditions.direction[:, None] / 2
    expected = left_out_residual(table, rest, folds(data))
    assert blocked_rms(data, partly) == pytest.approx(np.sqrt(np.mean(expected**2)), rel=1e-6)
    # with nothing stated the constant is open, too
    opened = model(Term(effect=SCALE), Term(effect=BACKLASH))
    table = np.array([data.conditions.position, data.conditions.direction / 2, np.ones(data.rows)]).T
    expected = left_out_residual(table, data.observed, folds(data))
    assert blocked_rms(data, opened) == pytest.approx(np.sqrt(np.mean(expected**2)), rel=1e-6)


def test_a_model_that_fits_noise_does_worse_on_what_it_has_not_seen():
    data = measured(runs=1, targets=30, sigma=0.002)
    cyclic = effect_named("cyclic")
    waves = [(cyclic, cyclic.shape_type(period, 4)) for period in (70.0, 41.0, 29.0)]
    work = Workspace(replace(data), noise())
    assert rms_by_folds(work, waves, datum=True) > 1.1 * rms_by_folds(work, [], datum=True)
