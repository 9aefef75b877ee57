"""The marginal likelihood against scipy's multivariate normal and dense algebra."""

import itertools

import numpy as np
import pytest
from inference_oracle import log_marginal

from rtec.inference.evidence import ABSENT, RARE, SCALES, Sums, best_scales, log_likelihoods, posterior


def sums_of(table, y):
    both = np.vstack([table, y])
    return Sums(products=both @ both.T, readings=y.size)


def drawn(seed, rows=30, columns=3, noise=1.0, size=2.0):
    rng = np.random.default_rng(seed)
    table = rng.normal(size=(columns, rows))
    return table, rng.normal(0, size, columns) @ table + noise * rng.normal(size=rows)


@pytest.mark.parametrize("seed", range(3))
def test_the_marginal_likelihood_is_that_of_a_multivariate_normal(seed):
    table, y = drawn(seed)
    deviations = np.array([[0.1, 1.0, 3.0], [0.0, 0.0, 0.0], [0.0, 10.0, 0.0], [100.0, 100.0, 0.01]])
    expected = [log_marginal(y, table, d, np.eye(y.size), datum=False) for d in deviations]
    assert log_likelihoods(sums_of(table, y), deviations) == pytest.approx(expected, abs=1e-6)


def test_nothing_but_noise_has_a_likelihood_too():
    _, y = drawn(0, noise=5.0)
    nothing = sums_of(np.empty((0, y.size)), y)
    expected = log_marginal(y, np.empty((0, y.size)), np.empty(0), np.eye(y.size), datum=False)
    assert log_likelihoods(nothing, np.empty((2, 0))) == pytest.approx([expected, expected], abs=1e-6)


def test_readings_that_are_explained_to_the_last_digit_are_finite():
    table, _ = drawn(1)
    exact = np.array([1.0, -2.0, 0.5]) @ table
    found = log_likelihoods(sums_of(table, exact), np.array([[1e5, 1e5, 1e5]]))
    assert np.isfinite(found).all()
    assert found[0] > log_likelihoods(sums_of(table, exact), np.array([[0.0, 0.0, 0.0]]))[0] + 50.0
    silent = Sums(np.diag([1.0, 1.0, 0.0]), 10)
    assert np.isfinite(log_likelihoods(silent, np.ones((1, 2)))).all()


@pytest.mark.parametrize("seed", range(12))
def test_the_best_scales_are_those_of_all_scales(seed):
    """Two blocks, one of them optional: all 13 x 14 pairs."""
    rng = np.random.default_rng(100 + seed)
    table, _ = drawn(seed, columns=4)
    y = rng.choice([0.0, 0.1, 1.0, 10.0]) * table[0] + rng.choice([0.0, 0.3, 3.0]) * table[3] + rng.normal(size=30)
    sums, block = sums_of(table, y), np.array([0, 0, 0, 1])
    ladder = np.append(SCALES, 0.0)
    pairs = list(itertools.product(range(SCALES.size), range(ABSENT, SCALES.size)))
    values = log_likelihoods(sums, np.array([ladder[np.array(pair)][block] for pair in pairs]))
    values -= RARE * (np.array(pairs)[:, 1] != ABSENT)  # what may be absent costs a nat where it is not
    for start in ((4, ABSENT), (0, 0), (6, 6), (4, 4)):  # each round moves by one place
        places, value = best_scales(sums, block, np.array(start), np.array([False, True]))
        own = float(log_likelihoods(sums, ladder[places][block][None])[0]) - RARE * (places[1] != ABSENT)
        assert value == pytest.approx(own)
        assert value >= values.max() - 0.02, start
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
