"""The marginal likelihood against scipy's multivariate normal and dense algebra."""

import itertools

import numpy as np
import pytest

from rtec.inference.evidence import SCALES, Sums, best_scales, posterior


def sums_of(table, y):
    both = np.vstack([table, y])
    return Sums(products=both @ both.T, readings=y.size)


def drawn(seed, rows=30, columns=3, noise=1.0, size=2.0):
    rng = np.random.default_rng(seed)
    table = rng.normal(size=(columns, rows))
    return table, rng.normal(0, size, columns) @ table + noise * rng.normal(size=rows)


def dense(table, y, deviations):
    """Log marginal likelihood by the covariance of the readings, the variance of the noise profiled."""
    total = np.eye(y.size) + (table.T * deviations**2) @ table
    return -0.5 * y.size * np.log(y @ np.linalg.solve(total, y)) - 0.5 * np.linalg.slogdet(total)[1]


def test_readings_that_are_explained_to_the_last_digit_are_finite():
    table, _ = drawn(1)
    one, first = np.zeros(3, dtype=int), np.array([4])
    places, value = best_scales(sums_of(table, np.array([1.0, -2.0, 0.5]) @ table), one, first)
    assert np.isfinite(value)
    assert places[0] == SCALES.size - 1
    assert np.isfinite(best_scales(Sums(np.diag([1.0, 1.0, 0.0]), 10), np.zeros(2, dtype=int), first)[1])


@pytest.mark.parametrize("seed", range(4))
def test_the_best_scales_are_those_of_all_scales(seed):
    """Two blocks: all 13 x 13 pairs."""
    rng = np.random.default_rng(100 + seed)
    table, _ = drawn(seed, columns=4)
    y = rng.choice([0.0, 0.1, 1.0, 10.0]) * table[0] + rng.choice([0.0, 0.3, 3.0]) * table[3] + rng.normal(size=30)
    block = np.array([0, 0, 0, 1])
    pairs = itertools.product(range(SCALES.size), repeat=2)
    values = {pair: dense(table, y, SCALES[list(pair)][block]) for pair in pairs}
    for start in ((4, 1), (0, 0), (6, 6), (4, 4)):  # each round moves by one place
        places, value = best_scales(sums_of(table, y), block, np.array(start))
        assert value == pytest.approx(values[places[0], places[1]])
        assert value >= max(values.values()) - 0.02, start


def test_a_model_of_nothing_leaves_the_readings():
    y = np.random.default_rng(3).normal(size=200)
    again, value = best_scales(sums_of(np.empty((0, 200)), y), np.array([], int), np.array([], int))
    assert again.size == 0
    assert value == pytest.approx(-100.0 * np.log(y @ y))


@pytest.mark.parametrize("deviations", [(1.0, 3.0, 0.1), (10.0, 0.0, 1.0), (0.0, 0.0, 0.0)])
def test_the_posterior_is_that_of_conditioned_normals(deviations):
    """Readings and amplitudes are jointly normal: the conditional by Schur's complement."""
    table, y = drawn(4)
    d = np.array(deviations)
    prior, cross = np.diag(d**2), np.diag(d**2) @ table
    total = table.T @ prior @ table + np.eye(y.size)
    expected = cross @ np.linalg.solve(total, y)
    mean, variance = posterior(sums_of(table, y), d)
    assert mean == pytest.approx(expected, abs=1e-9)
    assert variance == pytest.approx(float(y @ np.linalg.solve(total, y)) / y.size)
