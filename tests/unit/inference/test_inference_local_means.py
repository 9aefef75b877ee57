"""Means of neighbours against numpy, group by group."""

from __future__ import annotations

import numpy as np
import pytest

from rtec.inference.colour import Colour, Whitening
from rtec.inference.local_means import Sequence, neighbour_means


def test_repeated_places_are_averaged_one_by_one():
    rng = np.random.default_rng(1)
    x = rng.permutation(np.repeat([0.0, 5.0, 10.0], 6))
    y = x + rng.normal(0, 0.5, x.size)
    found = neighbour_means(x, y)
    assert found.at == pytest.approx([0.0, 5.0, 10.0])
    assert found.mean == pytest.approx([y[x == place].mean() for place in (0.0, 5.0, 10.0)])
    errors = [y[x == place].std(ddof=1) / np.sqrt(6) for place in (0.0, 5.0, 10.0)]
    assert found.error == pytest.approx(errors)


def test_many_places_are_averaged_in_groups_of_neighbours():
    x = np.linspace(0.0, 1.0, 10_000)
    found = neighbour_means(x, 3.0 * x)
    assert 5 <= found.at.size <= 40
    assert found.mean == pytest.approx(3.0 * found.at)
    assert neighbour_means(x, 3.0 * x, each_place=True).at.size == 10_000


@pytest.mark.one_in(5)
@pytest.mark.parametrize("each_place", [True, False])
@pytest.mark.parametrize("colour", [Colour(), Colour(0.8, 0.3), Colour(0.98, 0.1)])
def test_errors_are_those_of_a_monte_carlo_whose_noise_is_correlated(colour, each_place):
    # three runs there and back over 40 places, stopped for a while before the last
    x = np.tile(np.concatenate([np.arange(40.0), np.arange(40.0)[::-1]]), 3)
    gap = np.ones(x.size)
    gap[0], gap[160] = np.inf, 500.0
    at = np.cumsum(np.where(np.isinf(gap), 0.0, gap))
    covariance = (1.0 - colour.white) * colour.rho ** np.abs(at[:, None] - at) + colour.white * np.eye(x.size)
    whitened = Whitening(gap, colour).of(np.linalg.cholesky(covariance).T)
    assert whitened.T @ whitened == pytest.approx(np.eye(x.size), abs=1e-6)  # the same noise as in a fit
    noise = np.linalg.cholesky(covariance) @ np.random.default_rng(3).normal(size=(x.size, 1500))
    sequence = Sequence(at=at, colour=colour)
    found = [neighbour_means(x, y, each_place=each_place, sequence=sequence) for y in noise.T]
    spread = np.std([one.mean for one in found], axis=0)
    expected = np.sqrt(np.mean([one.error**2 for one in found], axis=0))
    assert expected == pytest.approx(spread, rel=0.12)
    if colour.rho > 0.9:  # as if they were independent, the errors are too small by a fifth at least
        alone = [neighbour_means(x, y, each_place=each_place).error ** 2 for y in noise.T]
        assert (np.sqrt(np.mean(alone, axis=0)) < 0.8 * spread).all()
