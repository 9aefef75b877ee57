"""The marginal likelihood against scipy's multivariate normal and dense algebra."""

import itertools

import numpy as np
import pytest
from inference_oracle import log_marginal

from rtec.inference.evidence import ABSENT, RARE, SCALES, Sums, best_scales, posterior, shifted_scales


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


@pytest.mark.parametrize("seed", range(3))
def test_the_marginal_likelihood_is_that_of_a_multivariate_normal(seed):
    table, y = drawn(seed)
    blocks, start, needed = np.arange(3), np.array([0, 4, 9]), np.zeros(3, dtype=bool)
    for places, value in (find(sums_of(table, y), blocks, start, needed) for find in (best_scales, shifted_scales)):
        expected = log_marginal(y, table, SCALES[places], np.eye(y.size), datum=False)
        assert value == pytest.approx(expected, abs=1e-6)
        assert dense(table, y, SCALES[places]) == pytest.approx(expected, abs=1e-6)


def test_readings_that_are_explained_to_the_last_digit_are_finite():
    table, _ = drawn(1)
    one, first, needed = np.zeros(3, dtype=int), np.array([4]), np.array([False])
    places, value = best_scales(sums_of(table, np.array([1.0, -2.0, 0.5]) @ table), one, first, needed)
    assert np.isfinite(value)
    assert places[0] == SCALES.size - 1
    assert np.isfinite(best_scales(Sums(np.diag([1.0, 1.0, 0.0]), 10), np.zeros(2, dtype=int), first, needed)[1])


@pytest.mark.parametrize("seed", range(12))
def test_the_best_scales_are_those_of_all_scales(seed):
    """Two blocks, one of them optional: all 13 x 14 pairs."""
    rng = np.random.default_rng(100 + seed)
    table, _ = drawn(seed, columns=4)
    y = rng.choice([0.0, 0.1, 1.0, 10.0]) * table[0] + rng.choice([0.0, 0.3, 3.0]) * table[3] + rng.normal(size=30)
    block, ladder = np.array([0, 0, 0, 1]), np.append(SCALES, 0.0)
    pairs = itertools.product(range(SCALES.size), range(ABSENT, SCALES.size))
    # what may be absent costs a few nats where it is not
    values = {pair: dense(table, y, ladder[list(pair)][block]) - RARE * (pair[1] != ABSENT) for pair in pairs}
    for start in ((4, ABSENT), (0, 0), (6, 6), (4, 4)):  # each round moves by one place
        places, value = best_scales(sums_of(table, y), block, np.array(start), np.array([False, True]))
        assert value == pytest.approx(values[places[0], places[1]])
        assert value >= max(values.values()) - 0.02, start
        assert places[0] >= 0, "only what is optional may be absent"


def test_a_block_that_is_not_optional_stays_and_an_optional_one_goes():
    rng = np.random.default_rng(3)
    table, y = rng.normal(size=(2, 200)), rng.normal(size=200)
    places, _ = best_scales(sums_of(table, y), np.array([0, 1]), np.array([4, 4]), np.array([False, True]))
    assert places[1] == ABSENT
    assert places[0] >= 0
    again, value = best_scales(sums_of(table[:0], y), np.array([], int), np.array([], int), np.array([], bool))
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
    spread = prior - cross @ np.linalg.solve(total, cross.T)
    mean, covariance, variance = posterior(sums_of(table, y), d)
    assert mean == pytest.approx(expected, abs=1e-9)
    assert covariance == pytest.approx(spread, abs=1e-9)
    assert variance == pytest.approx(float(y @ np.linalg.solve(total, y)) / y.size)
