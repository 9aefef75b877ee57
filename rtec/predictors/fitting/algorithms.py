"""The four training algorithms of the thesis: each lowers the sum of squares of a network, epoch by epoch.

An algorithm is a function ``(problem, weights, watch)``. After every epoch it shows its weights to ``watch``, which
says whether it goes on; so early stopping, budget and Ctrl-C are one and the same for all.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

import numpy as np
from scipy.linalg import lapack
from scipy.optimize import OptimizeResult, minimize

from rtec.predictors._columns import Floats
from rtec.predictors.fitting.layers import Layers

Watch = Callable[[Floats, float], bool]
"""Shown weights and their sum of squares after an epoch; False ends the training."""

_DAMPING, _LESS, _MORE, _MOST_DAMPING = 1e-3, 0.1, 10.0, 1e10
_STEP, _SHORTER, _LONGER, _LONGEST = 0.07, 0.5, 1.2, 50.0
_LAMBDA = 5e-7


class Problem:
    """A network and what it should answer.

    Parameters
    ----------
    net
        Over the scaled inputs of all rows.
    target
        Scaled answers, shape (n,).
    """

    def __init__(self, net: Layers, target: Floats) -> None:
        """Keep both."""
        self.net, self.target = net, target
        self._left = np.empty(0)

    def residual(self, weights: Floats) -> Floats:
        """Return output less target, shape (n,)."""
        return self.net.output(weights) - self.target

    def curvature(self, weights: Floats, along: Floats) -> float:
        """Return the second derivative of the sum of squares along a direction, after ``descent`` there."""
        return 2.0 * self.net.curvature(weights, along, self._left)

    def descent(self, weights: Floats) -> tuple[float, Floats]:
        """Return the sum of squares and its gradient, shape (weights,)."""
        self._left = residual = self.residual(weights)
        return float(residual @ residual), 2.0 * self.net.gradient(weights, residual)


def levenberg_marquardt(problem: Problem, weights: Floats, watch: Watch) -> None:
    """Train by Levenberg-Marquardt with the exact Jacobian (Hagan and Menhaj 1994).

    The damping falls tenfold where a step helps and rises tenfold until one does, from 0.001 on.
    """
    damping = _DAMPING
    residual = problem.residual(weights)
    squares = float(residual @ residual)
    while watch(weights, squares):
        normal, slope = problem.net.normal(weights, residual)
        while True:
            step = _solved(normal, damping, slope)
            tried = weights - step
            there = problem.residual(tried)
            found = float(there @ there)
            if found < squares:
                weights, residual, squares = tried, there, found
                damping = max(damping * _LESS, 1e-20)
                break
            damping *= _MORE
            if damping > _MOST_DAMPING:
                return


def _solved(normal: Floats, damping: float, slope: Floats) -> Floats:
    """Return the solution of the damped normal equations; no number where they are not positive definite."""
    damped = normal.copy()
    damped[np.diag_indices_from(damped)] += damping
    _, found, trouble = lapack.dposv(damped, slope, overwrite_a=True)
    return found if trouble == 0 else np.full(slope.size, np.nan)


def resilient_backpropagation(problem: Problem, weights: Floats, watch: Watch) -> None:
    """Train by resilient backpropagation: each weight has a step of its own, which the sign of its slope rules.

    Where the sign changes, the step is halved and the slope forgotten (iRprop-, Igel and Huesken 2000).
    """
    step = np.full(weights.size, _STEP)
    before = np.zeros(weights.size)
    squares, slope = problem.descent(weights)
    while watch(weights, squares):
        same = np.sign(slope * before)
        step *= np.where(same > 0.0, _LONGER, np.where(same < 0.0, _SHORTER, 1.0))
        np.minimum(step, _LONGEST, out=step)
        before = np.where(same < 0.0, 0.0, slope)
        weights = weights - step * np.sign(before)
        squares, slope = problem.descent(weights)


def scaled_conjugate_gradient(problem: Problem, weights: Floats, watch: Watch) -> None:
    """Train by scaled conjugate gradient (Moller 1993): each step comes from the curvature along it.

    The curvature is the exact one (Pearlmutter 1994); Moller takes a difference of two gradients.
    """
    squares, slope = problem.descent(weights)
    along, residual = -slope, -slope
    scale, raised, success, since = _LAMBDA, 0.0, True, 0
    curvature = length2 = 0.0
    while watch(weights, squares):
        if success:
            length2 = float(along @ along)
            if length2 == 0.0:
                return
            curvature = problem.curvature(weights, along)
        curvature += (scale - raised) * length2
        if curvature <= 0.0:  # make the Hessian positive definite along this direction
            raised = 2.0 * (scale - curvature / length2)
            curvature, scale = scale * length2 - curvature, raised
        promise = float(along @ residual)
        if promise**2 == 0.0:  # nothing is left to descend
            return
        stride = promise / curvature
        tried = weights + stride * along
        found, there = problem.descent(tried)
        quality = 2.0 * curvature * (squares - found) / promise**2
        success = quality >= 0.0
        raised = 0.0
        if success:
            weights, squares, slope, last = tried, found, there, residual
            residual = -slope
            since += 1
            restart = since % weights.size == 0
            along = residual if restart else residual + (float(residual @ (residual - last)) / promise) * along
            if quality >= 0.75:
                scale *= 0.25
        else:
            raised = scale
        if quality < 0.25:
            scale += curvature * (1.0 - quality) / length2
        if not scale < 1e100:
            return


def quasi_newton(problem: Problem, weights: Floats, watch: Watch) -> None:
    """Train by the quasi-Newton method of Broyden, Fletcher, Goldfarb and Shanno, as scipy has it."""
    if not watch(weights, problem.descent(weights)[0]):
        return

    def after(intermediate_result: OptimizeResult) -> None:
        if not watch(intermediate_result.x, float(intermediate_result.fun)):
            raise StopIteration

    minimize(
        problem.descent,
        weights,
        jac=True,
        method="BFGS",
        callback=after,
        options={"gtol": 1e-14, "maxiter": 1_000_000},
    )


class Algorithm(Enum):
    """How a network is trained (thesis 4.3.1)."""

    LM = "lm"
    """Levenberg-Marquardt."""
    RPROP = "rprop"
    """Resilient backpropagation."""
    SCG = "scg"
    """Scaled conjugate gradient."""
    BFGS = "bfgs"
    """Quasi-Newton, Broyden-Fletcher-Goldfarb-Shanno."""

    @property
    def title(self) -> str:
        """What people call it."""
        return _KNOWN[self][0]

    def train(self, problem: Problem, weights: Floats, watch: Watch) -> None:
        """Train from these weights on until ``watch`` ends it, or nothing helps any more."""
        _KNOWN[self][1](problem, weights, watch)


_KNOWN: dict[Algorithm, tuple[str, Callable[[Problem, Floats, Watch], None]]] = {
    Algorithm.LM: ("Levenberg-Marquardt", levenberg_marquardt),
    Algorithm.RPROP: ("resilient backpropagation", resilient_backpropagation),
    Algorithm.SCG: ("scaled conjugate gradient", scaled_conjugate_gradient),
    Algorithm.BFGS: ("BFGS", quasi_newton),
}
