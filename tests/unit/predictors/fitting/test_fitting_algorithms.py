"""The four training algorithms: each comes to the least sum of squares of a problem whose answer is known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import least_squares

from rtec.predictors.fitting.algorithms import Algorithm, Problem
from rtec.predictors.fitting.layers import Layers, Shape

SHAPE = Shape(inputs=1, hidden=(3,))
INPUTS = np.linspace(-1.0, 1.0, 41)[:, None]
EPOCHS = {Algorithm.LM: 300, Algorithm.RPROP: 2000, Algorithm.SCG: 2000, Algorithm.BFGS: 500}
NEAR = {Algorithm.LM: 1e-6, Algorithm.RPROP: 1e-3, Algorithm.SCG: 1e-4, Algorithm.BFGS: 1e-4}
"""Sum of squares, from some 30 on, within these epochs; the exact answer has none."""


def problem(noise=0.0):
    """Return a problem that a network of this shape answers exactly, less noise."""
    net = Layers(SHAPE, INPUTS)
    weights = np.array([3.0, -4.0, 2.0, 0.5, 1.0, -0.8, 1.0, -0.7, 0.9, 0.2])
    target = net.output(weights) + noise * np.random.default_rng(5).normal(size=41)
    return Problem(net, target)


def run(algorithm, task, weights, epochs):
    seen = []

    def watch(there, squares):
        seen.append((there.copy(), squares))
        return len(seen) <= epochs

    algorithm.train(task, weights, watch)
    return seen


@pytest.mark.parametrize("algorithm", Algorithm)
def test_each_reaches_what_the_network_can_say_exactly(algorithm):
    task = problem()
    first = SHAPE.first_weights(np.random.default_rng(1))
    squares = [found for _, found in run(algorithm, task, first, EPOCHS[algorithm])]
    assert squares[0] > 1.0
    assert min(squares) < NEAR[algorithm]


@pytest.mark.parametrize("algorithm", Algorithm)
def test_what_is_shown_to_the_watch_is_true(algorithm):
    task = problem(0.05)
    for weights, squares in run(algorithm, task, SHAPE.first_weights(np.random.default_rng(2)), 20):
        assert squares == pytest.approx(float(np.sum(task.residual(weights) ** 2)), rel=1e-12)


@pytest.mark.parametrize("algorithm", [Algorithm.LM, Algorithm.SCG, Algorithm.BFGS])
def test_no_epoch_raises_the_sum(algorithm):
    squares = [
        found for _, found in run(algorithm, problem(0.05), SHAPE.first_weights(np.random.default_rng(3)), 100)
    ]
    assert len(squares) > 20
    assert (np.diff(squares) <= 0.0).all()


@pytest.mark.parametrize("algorithm", Algorithm)
def test_the_watch_ends_it_after_the_epoch(algorithm):
    assert len(run(algorithm, problem(0.05), SHAPE.first_weights(np.random.default_rng(4)), 7)) == 8
    assert len(run(algorithm, problem(0.05), SHAPE.first_weights(np.random.default_rng(4)), 0)) == 1


def test_levenberg_marquardt_ends_where_scipy_does():
    task = problem(0.02)
    near = np.array([2.8, -4.2, 2.1, 0.4, 1.1, -0.7, 1.1, -0.6, 0.8, 0.1])
    weights, squares = run(Algorithm.LM, task, near, 2000)[-1]

    def jacobian(values):
        task.residual(values)
        return task.net.jacobian(values).T

    peer = least_squares(task.residual, near, jacobian, method="lm", ftol=1e-15, xtol=1e-15, gtol=1e-15)
    assert squares == pytest.approx(2.0 * peer.cost, rel=1e-6)
    assert squares <= 2.0 * peer.cost * (1.0 + 1e-6)
    assert_allclose(task.residual(weights), task.residual(peer.x), rtol=0, atol=1e-3)


def test_a_levenberg_marquardt_step_solves_the_damped_normal_equations():
    task = problem(0.05)
    first = SHAPE.first_weights(np.random.default_rng(6))
    (_, before), (second, after) = run(Algorithm.LM, task, first, 1)
    residual = task.residual(first)
    jacobian = task.net.jacobian(first).T
    rows = SHAPE.weights
    dampings = [1e-3 * 10.0**power for power in range(12)]
    steps = [
        np.linalg.lstsq(
            np.vstack([jacobian, np.sqrt(damping) * np.eye(rows)]), np.concatenate([-residual, np.zeros(rows)])
        )[0]
        for damping in dampings
    ]
    helpful = next(step for step in steps if np.sum(task.residual(first + step) ** 2) < before)
    assert after < before
    assert_allclose(second - first, helpful, rtol=1e-5, atol=1e-8)


def test_resilient_backpropagation_moves_each_weight_by_its_own_step():
    """From a step of 0.07 on, 1.2 times as far while the slope keeps its sign, half as far where it changes."""
    task = problem(0.05)
    first = SHAPE.first_weights(np.random.default_rng(7))
    seen = [weights for weights, _ in run(Algorithm.RPROP, task, first, 2)]
    slopes = [task.descent(weights)[1] for weights in seen[:2]]
    assert_allclose(seen[1] - seen[0], -0.07 * np.sign(slopes[0]), rtol=0, atol=1e-15)
    same = np.sign(slopes[0] * slopes[1]) > 0
    assert 0 < same.sum() < same.size or same.all()
    expected = np.where(same, -0.07 * 1.2 * np.sign(slopes[1]), 0.0)
    assert_allclose(seen[2] - seen[1], expected, rtol=0, atol=1e-15)


@pytest.mark.parametrize("algorithm", Algorithm)
def test_a_target_of_nothing_but_zeros_ends_without_trouble(algorithm):
    task = Problem(Layers(SHAPE, INPUTS), np.zeros(41))
    squares = [found for _, found in run(algorithm, task, SHAPE.first_weights(np.random.default_rng(8)), 3000)]
    assert min(squares) < 1e-3
    assert np.isfinite(squares).all()
