"""Levenberg-Marquardt with Bayesian regularisation: the weights are kept as small as the data allow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.linalg import eigh

from rtec.predictors._columns import Floats

_DAMPING, _LESS, _MORE, _LEAST_DAMPING, _MOST_DAMPING = 0.005, 0.1, 10.0, 1e-20, 1e10


class LeastSquares(Protocol):
    """A sum of squares as a function of weights, with its linearisation."""

    samples: int
    """Number of errors that are squared."""

    def squares(self, weights: Floats) -> float:
        """Return the sum of squares; infinite where it cannot be had."""

    def normal(self, weights: Floats) -> tuple[float, Floats, Floats]:
        """Return the sum of squares, J'J and J'e of the errors' exact Jacobian J."""


@dataclass(slots=True)
class Evidence:
    """What Bayesian regularisation found (MacKay 1992; Foresee and Hagan 1997).

    The cost is ``beta * squares of errors + alpha * squares of weights``.
    """

    alpha: float = 0.0
    beta: float = 1.0
    gamma: float = 0.0
    """Effective number of parameters."""
    squares: float = np.inf
    damping: float = field(default=_DAMPING, repr=False)

    @property
    def decay(self) -> float:
        """Weight of the squared weights beside the squared errors."""
        return self.alpha / self.beta


Watch = Callable[[Floats, Evidence], bool]
"""Shown the weights after each epoch; False ends the training."""


def bayesian_regularisation(problem: LeastSquares, weights: Floats, watch: Watch) -> tuple[Floats, Evidence]:
    """Lower a regularised sum of squares by Levenberg-Marquardt until nothing helps or `watch` ends it.

    After each step ``gamma = P - alpha trace((beta J'J + alpha I)^-1)``, ``alpha = gamma / (2 E_w)`` and
    ``beta = (N - gamma) / (2 E_d)``. The damping falls tenfold where a step helps and rises tenfold until one does.

    Parameters
    ----------
    problem
        What is minimised.
    weights
        To begin with, shape (P,).
    watch
        Called after each epoch.

    References
    ----------
    Foresee and Hagan 1997, Gauss-Newton approximation to Bayesian learning.
    """
    found = Evidence()
    squares, normal, slope = problem.normal(weights)
    found.squares = squares
    if not np.isfinite(squares):
        return weights, found
    _weigh(found, float(weights.size), weights, problem)
    while np.isfinite(normal).all():
        values, vectors = eigh(normal, driver="evd", check_finite=False)
        values = np.maximum(values, 0.0)
        along = vectors.T @ (slope + found.decay * weights)
        cost = squares + found.decay * float(weights @ weights)
        while True:
            step = vectors @ (along / (values + found.decay + found.damping))
            tried = weights - step
            there = problem.squares(tried)
            if there + found.decay * float(tried @ tried) < cost:
                break
            found.damping *= _MORE
            if found.damping > _MOST_DAMPING or not step.any():
                return weights, found
        found.damping = max(found.damping * _LESS, _LEAST_DAMPING)
        weights = tried
        squares, normal, slope = problem.normal(weights)
        found.squares = squares
        _weigh(found, float(np.sum(values / (values + found.decay))), weights, problem)
        if not watch(weights, found):
            break
    return weights, found


def _weigh(found: Evidence, gamma: float, weights: Floats, problem: LeastSquares) -> None:
    found.gamma = gamma
    found.alpha = gamma / (2.0 * max(float(weights @ weights), 1e-30))
    found.beta = max(problem.samples - gamma, 1.0) / (2.0 * max(found.squares, 1e-30))
