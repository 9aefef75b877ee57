"""Innovations and determinants against the Cholesky factor of the written-out covariance."""

import numpy as np
import pytest
from inference_oracle import covariance, whitened

from rtec.inference.whitening import Correlation, places

STARTS = np.isin(np.arange(23), [0, 7, 8, 20])


@pytest.mark.parametrize(
    ("rho", "white"), [(0.3, 0.0), (0.9, 0.0), (0.998, 0.0), (0.9, 0.5), (0.97, 0.1), (0.5, 1.0)]
)
def test_innovations_are_those_of_the_cholesky_factor(rho, white):
    table = np.random.default_rng(1).normal(size=(3, 23))
    before = table.copy()
    matrix = covariance(rho, white, STARTS)
    found = Correlation(rho=rho, white=white)
    assert found.whitened(table, STARTS) == pytest.approx(whitened(table, matrix), abs=1e-9)
    assert (table == before).all()  # left as they are
    assert found.log_determinant(STARTS) == pytest.approx(np.linalg.slogdet(matrix)[1], abs=1e-9)


def test_one_column_is_a_table_of_one():
    column = np.random.default_rng(2).normal(size=23)
    found = Correlation(rho=0.8).whitened(column, STARTS)
    assert found.shape == (1, 23)
    assert found == pytest.approx(whitened(column[None, :], covariance(0.8, 0.0, STARTS)))


def test_independent_readings_stay():
    table = np.random.default_rng(3).normal(size=(2, 23))
    for c in (Correlation(), Correlation(rho=0.9, white=1.0)):
        assert c.is_white
        assert (c.whitened(table, STARTS) == table).all()
        assert c.log_determinant(STARTS) == 0.0
    assert not Correlation(rho=0.3).is_white


@pytest.mark.parametrize(("rho", "white"), [(0.9, 0.0), (0.9, 0.25), (0.0, 0.0)])
def test_correlation_with_the_next_reading(rho, white):
    expected = covariance(rho, white, np.array([True, False]))[0, 1] if rho else 0.0
    assert Correlation(rho=rho, white=white).to_next == pytest.approx(expected)


def test_whitened_noise_is_white():
    rng, starts = np.random.default_rng(4), np.arange(60) % 20 == 0
    root = np.linalg.cholesky(covariance(0.92, 0.25, starts))
    draws = Correlation(rho=0.92, white=0.25).whitened((root @ rng.standard_normal((60, 4000))).T, starts)
    seen = draws.T @ draws / 4000
    # 5 standard errors of an entry: 1 / sqrt(4000) beside the diagonal, sqrt(2 / 4000) on it
    assert np.abs(seen - np.eye(60)).max() < 5 * np.sqrt(2 / 4000)


def test_places_count_from_each_start():
    assert places(STARTS).tolist() == [*range(7), 0, *range(12), *range(3)]
