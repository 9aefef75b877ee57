"""Bayesian regularisation, beside the evidence of a linear model."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import multivariate_normal

from rtec.predictors.fitting.bayesian import bayesian_regularisation


class Linear:
    """Straight least squares."""

    def __init__(self, columns, target):
        self.columns, self.target, self.samples = columns, target, target.size

    def squares(self, weights):
        return float(np.sum((self.columns @ weights - self.target) ** 2))

    def normal(self, weights):
        error = self.columns @ weights - self.target
        return float(error @ error), self.columns.T @ self.columns, self.columns.T @ error


def test_it_finds_the_weights_that_maximise_the_evidence():
    draw = np.random.default_rng(0)
    columns = draw.normal(size=(60, 12)) * np.geomspace(1.0, 0.01, 12)
    target = columns @ draw.normal(size=12) + 0.3 * draw.normal(size=60)
    weights, found = bayesian_regularisation(Linear(columns, target), draw.normal(size=12), counted(300))

    def negative_evidence(logs):
        prior, noise = np.exp(logs)
        return -multivariate_normal.logpdf(
            target, cov=prior * columns @ columns.T + noise * np.eye(60), allow_singular=False
        )

    best = minimize(negative_evidence, [0.0, 0.0], method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-10})
    prior, noise = np.exp(best.x)
    assert (0.5 / found.alpha, 0.5 / found.beta) == pytest.approx((prior, noise), rel=1e-3)
    ridge = np.linalg.solve(columns.T @ columns + noise / prior * np.eye(12), columns.T @ target)
    assert weights == pytest.approx(ridge, abs=1e-3)
    values = np.linalg.eigvalsh(columns.T @ columns)
    assert found.gamma == pytest.approx(np.sum(values / (values + noise / prior)), rel=1e-3)


def counted(epochs):
    seen = []

    def watch(weights, evidence):
        seen.append(evidence.squares)
        return len(seen) < epochs

    return watch


def test_what_cannot_be_computed_is_left_as_it_was():
    class Nowhere(Linear):
        def normal(self, weights):
            return np.inf, np.eye(2), np.zeros(2)

    begin = np.array([1.0, 2.0])
    weights, found = bayesian_regularisation(Nowhere(np.eye(2), begin), begin, counted(5))
    assert weights is begin
    assert found.squares == np.inf


def test_watch_ends_it():
    draw = np.random.default_rng(0)
    seen = []
    bayesian_regularisation(
        Linear(draw.normal(size=(9, 3)), draw.normal(size=9)),
        np.ones(3),
        lambda w, e: seen.append(1) or len(seen) < 3,
    )
    assert len(seen) == 3
