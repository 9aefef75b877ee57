"""What holds for every measurement: invariances of noise, falls, held-out error and of the whole search."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from inference_oracle import covariance, fall, left_out_residual, log_marginal, measured, whitened

from rtec.effects import Shape, effect_named
from rtec.inference.chessboard import board_of, held_out_residual
from rtec.inference.colour import COLOURS, Colour, Whitening
from rtec.inference.diagnose import diagnose
from rtec.inference.evidence import SCALES, Sums, best_scales
from rtec.inference.proposals import Beside, falls, orthonormal
from rtec.inference.scored import Judge
from rtec.inference.space import Space, blocks_of

SEEDS = st.integers(0, 2**32 - 1)
SCALE, BACKLASH = effect_named("scale"), effect_named("backlash")


@settings(deadline=None)  # the first call loads or compiles the filter
@given(seed=SEEDS, rows=st.integers(1, 30), rho=st.just(0.0) | st.floats(0.01, 0.999), white=st.floats(0.0, 1.0))
def test_whitening_is_the_cholesky_factor_for_any_gaps(seed, rows, rho, white):
    rng = np.random.default_rng(seed)
    gap = np.where(rng.random(rows) < 0.2, np.inf, rng.integers(1, 50, rows).astype(float))
    gap[0] = np.inf
    table = rng.normal(size=(11, rows))  # more than pass the filter side by side
    filtered, matrix = Whitening(gap, Colour(rho, white)), covariance(rho, white, gap)
    assert filtered.of(table) == pytest.approx(whitened(table, matrix), rel=1e-6, abs=1e-6)
    assert filtered.log_determinant == pytest.approx(np.linalg.slogdet(matrix)[1], rel=1e-6, abs=1e-6)
    assert filtered.coloured(table) == pytest.approx(table @ matrix, rel=1e-9, abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(seed=SEEDS, rows=st.integers(4, 20), count=st.integers(1, 4), colour=st.sampled_from(COLOURS))
def test_likelihoods_are_those_of_multivariate_normals(seed, rows, count, colour):
    rng = np.random.default_rng(seed)
    table, y = rng.normal(size=(count, rows)), rng.normal(size=rows)
    gap = np.append(np.inf, rng.integers(1, 4, rows - 1).astype(float))
    start = rng.integers(0, 6, count)
    filtered = Whitening(gap, colour)
    a, b = filtered.of(table), filtered.of(y[None, :])[0]
    both = np.vstack([a, b])
    sums = Sums(products=both @ both.T, readings=rows)
    places, value = best_scales(sums, np.arange(count), start)
    found = value - 0.5 * filtered.log_determinant
    deviations = np.append(SCALES, 0.0)[places]
    matrix = covariance(colour.rho, colour.white, gap)
    assert found == pytest.approx(log_marginal(y, table, deviations, matrix, datum=False), abs=1e-5)


@given(
    seed=SEEDS,
    rows=st.integers(12, 40),
    held=st.integers(0, 4),
    q=st.integers(1, 3),
    dtype=st.sampled_from([np.float64, np.float32]),
)
def test_falls_are_those_of_full_fits(seed, rows, held, q, dtype):
    rng = np.random.default_rng(seed)
    model, y = rng.normal(size=(held, rows)), rng.normal(size=rows)
    candidates = rng.normal(size=(3, q, rows)) * 10.0 ** rng.uniform(-6, 3, (3, q, 1))  # columns of any size
    basis = orthonormal(model)
    residual = y - (basis @ y) @ basis
    expected = [fall(model, own / np.linalg.norm(own, axis=1)[:, None], y) for own in candidates]
    found = falls(candidates.astype(dtype), Beside(basis, residual, float(residual @ residual)))
    assert found == pytest.approx(expected, rel=1e-6 if dtype == np.float64 else 2e-4)


@settings(max_examples=25, deadline=None)
@given(seed=SEEDS, runs=st.integers(1, 5), targets=st.integers(3, 12), rho=st.sampled_from([0.0, 0.8]))
def test_held_out_residuals_are_those_of_refits(seed, runs, targets, rho):
    data = measured(lambda x, way, t, run: 1e-4 * x, runs=runs, targets=targets, seed=seed % 1000, rho=rho, white=0.3)
    judge, board, choices = Judge(Space(data)), board_of(data), [(SCALE, Shape()), (BACKLASH, Shape())]
    model = judge.score(choices)
    parts = judge.space.parts_of(choices)
    deviations = np.append(SCALES, 0.0)[model.places][blocks_of(parts)]
    raw = np.vstack([np.vstack([part.raw * part.unit for part in parts])[deviations > 0.0], np.ones(data.rows)])
    gap = np.append(np.inf, np.ones(data.rows - 1))
    colour = model.colour.bounded
    white = whitened(np.vstack([raw, data.observed]), covariance(colour.rho, colour.white, gap))
    precision = np.append(deviations[deviations > 0.0] ** -2.0, 1e-12)
    expected = left_out_residual(white[:-1].T, raw.T, white[-1], data.observed, board.fold, precision)
    assert held_out_residual(judge, model, board) == pytest.approx(expected, abs=1e-6)


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
@given(seed=st.integers(0, 1000), step=st.floats(-50.0, 50.0))
def test_a_search_does_not_depend_on_the_datum(seed, step):
    data = measured(lambda x, way, t, run: 5e-5 * x + 0.004 * way, seed=seed, targets=9, runs=4, timed=False)
    first = diagnose(data)
    second = diagnose(replace(data, observed=data.observed + step))
    assert set(first.effects) - {"offset"} == set(second.effects) - {"offset"}
    assert second.noise.sigma == pytest.approx(first.noise.sigma, rel=1e-6)


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 1000), runs=st.integers(1, 3), targets=st.integers(1, 5), size=st.floats(-12, 3))
def test_small_measurements_are_judged_without_a_complaint(seed, runs, targets, size):
    data = measured(lambda x, way, t, run: 10.0**size * way, runs=runs, targets=targets, seed=seed)
    if data.rows >= 3:
        result = diagnose(data)
        assert np.isfinite([result.rms_before, result.rms_after, result.rms_heldout]).all()
        assert all(0.0 <= step.p_adjusted <= 1.0 for step in result.steps)
        assert all(0.0 <= p <= 1.0 for p in result.probability.values())
