"""What holds for every measurement: invariances of noise, score, held-out error and of the whole search."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from inference_oracle import covariance, fall, left_out_residual, measured, whitened

from rtec.effects import Shape, effect_named
from rtec.inference.diagnose import diagnose
from rtec.inference.heldout import folds, held_out_residual
from rtec.inference.noise import Noise, noise_from_repeats
from rtec.inference.score import background, gain_of_block, gains, orthonormal
from rtec.inference.whitening import Correlation
from rtec.inference.workspace import Workspace

SEEDS = st.integers(0, 2**32 - 1)
SCALE, BACKLASH = effect_named("scale"), effect_named("backlash")


@given(seed=SEEDS, rows=st.integers(1, 30), rho=st.floats(0.01, 0.999), white=st.floats(0.0, 0.99))
def test_whitening_is_the_cholesky_factor_for_any_segments(seed, rows, rho, white):
    rng = np.random.default_rng(seed)
    starts = rng.random(rows) < 0.2
    starts[0] = True
    table, c = rng.normal(size=(2, rows)), Correlation(rho=rho, white=white)
    matrix = covariance(rho, white, starts)
    assert c.whitened(table, starts) == pytest.approx(whitened(table, matrix), rel=1e-6, abs=1e-6)
    assert c.log_determinant(starts) == pytest.approx(np.linalg.slogdet(matrix)[1], rel=1e-6, abs=1e-6)


@given(seed=SEEDS, rows=st.integers(8, 30), held=st.integers(0, 4), q=st.integers(1, 2), runs=st.integers(1, 4))
def test_gains_are_falls_of_full_fits_folded_or_not(seed, rows, held, q, runs):
    rng = np.random.default_rng(seed)
    model, y = rng.normal(size=(held, rows * runs)), rng.normal(size=rows * runs)
    candidates = rng.normal(size=(3, q, rows))
    back = background(model, y)
    expected = [fall(model, np.tile(own, runs), y) for own in candidates]
    assert gains(candidates, back.folded(runs), copies=runs) == pytest.approx(expected, rel=1e-6, abs=1e-9)
    assert gain_of_block(np.tile(candidates[0], runs), back)[0] == pytest.approx(expected[0], rel=1e-6, abs=1e-9)


@given(seed=SEEDS, count=st.integers(0, 6), scale=st.floats(-9, 9))
def test_a_basis_does_not_depend_on_the_size_of_the_columns(seed, count, scale):
    columns = np.random.default_rng(seed).normal(size=(count, 12))
    basis, scaled = orthonormal(columns), orthonormal(columns * 10.0**scale)
    assert basis.T @ basis == pytest.approx(np.eye(basis.shape[1]), abs=1e-9)
    assert basis @ basis.T == pytest.approx(scaled @ scaled.T, abs=1e-6)


@settings(max_examples=25)
@given(seed=SEEDS, runs=st.integers(1, 5), targets=st.integers(3, 12), rho=st.sampled_from([0.0, 0.8]))
def test_held_out_residuals_are_those_of_refits(seed, runs, targets, rho):
    data = measured(lambda x, way, t, run: 1e-4 * x, runs=runs, targets=targets, seed=seed % 1000)
    work = Workspace(data, Noise(sigma=1.0, correlation=Correlation(rho=rho), freedom=9.0, from_repeats=True))
    columns = [work.constant, *(work.columns(e, Shape()) for e in (SCALE, BACKLASH))]
    expected = left_out_residual(np.vstack(columns).T, work.observed, folds(data))
    found = held_out_residual(work, [(SCALE, Shape()), (BACKLASH, Shape())], datum=True)
    assert found == pytest.approx(expected, abs=1e-7)


@settings(max_examples=20, deadline=None)
@given(seed=SEEDS, factor=st.floats(-12, 6), shift=st.floats(-10, 10))
def test_noise_scales_with_the_readings_and_does_not_see_what_repeats(seed, factor, shift):
    data = measured(seed=seed % 1000, targets=12, rho=0.8)
    found = noise_from_repeats(data)
    moved = replace(data, observed=10.0**factor * (data.observed + shift * 1e-4 * data.conditions.direction))
    again = noise_from_repeats(moved)
    assert again.sigma == pytest.approx(10.0**factor * found.sigma, rel=1e-4)
    assert again.correlation.to_next == pytest.approx(found.correlation.to_next, abs=1e-4)


def summary(result):
    return result.verdict, result.effects, [round(step.p_adjusted, 6) for step in result.steps]


@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 1000), power=st.integers(-9, 6), sign=st.sampled_from([-1.0, 1.0]))
def test_a_search_does_not_depend_on_unit_and_sign(seed, power, sign):
    data = measured(lambda x, way, t, run: 5e-5 * x + 0.004 * way, seed=seed, targets=9, runs=4, timed=False)
    turned = replace(data, observed=sign * 10.0**power * data.observed)
    first, second = diagnose(data), diagnose(turned)
    assert summary(first) == summary(second)
    assert second.rms_after == pytest.approx(10.0**power * first.rms_after, rel=1e-4)
    assert [c.effect for c in first.candidates if c.accepted] == [c.effect for c in second.candidates if c.accepted]


@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 1000), runs=st.integers(1, 3), targets=st.integers(1, 5), size=st.floats(-12, 3))
def test_small_measurements_are_judged_without_a_complaint(seed, runs, targets, size):
    data = measured(lambda x, way, t, run: 10.0**size * way, runs=runs, targets=targets, seed=seed)
    if data.rows >= 3:
        result = diagnose(data)
        assert np.isfinite([result.rms_before, result.rms_after, result.rms_heldout]).all()
        assert all(0.0 <= step.p_adjusted <= 1.0 for step in result.steps)
