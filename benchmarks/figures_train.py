"""Figures of the training: an epoch of each algorithm beside scipy and scikit-learn, and the starts of Table 4-1."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
from figures import Bar, Figure, Setting, Spread, skipped
from open_path_job import WrongResultError
from scipy.optimize import least_squares
from table_4_1 import GOAL, PITCH_MM, Data, averages, data_of, train as train_once

from rtec.predictors.fitting.algorithms import Algorithm, Problem
from rtec.predictors.fitting.layers import Layers, Shape
from rtec.predictors.fitting.samples import means_over_turns

try:
    from sklearn.neural_network import MLPRegressor
except ImportError:
    MLPRegressor = None

Floats = npt.NDArray[np.float64]
THIS = "python benchmarks/measure.py --only train"


def train(setting: Setting) -> Iterator[Figure]:
    """Measure an epoch of each algorithm on the lathe's 3122 averages, and ten starts of Table 4-1."""
    samples = averages()
    yield from _beside_scipy(setting, data_of(samples))
    yield from _beside_sklearn(setting, data_of(samples, turn=True))
    yield _ten_starts(setting, data_of(means_over_turns(samples, PITCH_MM)))


def _problem(data: Data, neurons: int) -> tuple[Problem, Floats]:
    inputs, target, _ = data.scaled()
    shape = Shape(inputs=inputs.shape[1], hidden=(neurons,))
    return Problem(Layers(shape, inputs), target), shape.first_weights(np.random.default_rng(0))


def _epoch_s(algorithm: Algorithm, problem: Problem, weights: Floats, epochs: int) -> tuple[float, float]:
    """Return the processor time of an epoch, and the sum of squares after the last one."""
    squares: list[float] = []

    def watch(_: Floats, found: float) -> bool:
        squares.append(found)
        return len(squares) <= epochs

    begun = time.process_time()
    algorithm.train(problem, weights, watch)
    return (time.process_time() - begun) / max(1, len(squares) - 1), squares[-1]


def _beside_scipy(setting: Setting, data: Data) -> Iterator[Figure]:
    problem, first = _problem(data, 30)
    epochs = setting.of(50, 20)
    rounds = setting.of(5, 2)
    methods = ("trf", "lm")
    ours: list[float] = []
    theirs: dict[str, list[float]] = {method: [] for method in methods}
    _epoch_s(Algorithm.LM, problem, first, 3)
    for _ in range(rounds):
        seconds, squares = _epoch_s(Algorithm.LM, problem, first, epochs)
        ours.append(seconds)
        for method in methods:
            seconds, found = _least_squares_s(problem, first, method, epochs)
            theirs[method].append(seconds)
            if not max(found, squares) < 0.2 * float(problem.target @ problem.target):
                raise WrongResultError(f"sums of squares of {squares:g} and, by {method}, {found:g}")
    own = Spread(tuple(ours))
    for method in methods:
        peer = Spread(tuple(theirs[method]))
        yield Figure(
            what=f"Levenberg-Marquardt, 30 neurons, 3122 readings, beside `least_squares`, method {method}",
            measured=f"{own.text(_ms)} an epoch, {peer.text(_ms)} an iteration: {peer.best / own.best:.1f} x",
            value=peer.best / own.best,
            bar=Bar(value=10.0, unit="x scipy"),
            command=THIS,
        )


def _least_squares_s(problem: Problem, first: Floats, method: str, epochs: int) -> tuple[float, float]:
    """Return scipy's processor time for an iteration with the same Jacobian, and its sum of squares at the end."""

    def jacobian(weights: Floats) -> Floats:
        problem.residual(weights)
        return problem.net.jacobian(weights).T

    begun = time.process_time()
    found: Any = least_squares(
        problem.residual, first, jacobian, method=method, max_nfev=epochs, ftol=1e-15, xtol=1e-15, gtol=1e-15
    )
    return (time.process_time() - begun) / found.njev, 2.0 * found.cost


def _beside_sklearn(setting: Setting, data: Data) -> Iterator[Figure]:
    bar = Bar(value=3.0, unit="x scikit-learn")
    problem, first = _problem(data, 40)
    epochs, rounds = setting.of(200, 50), setting.of(5, 2)
    peer = None if MLPRegressor is None else _sklearn(problem, data.scaled()[0], epochs)
    for algorithm in (Algorithm.RPROP, Algorithm.SCG):
        what = f"{algorithm.title.capitalize()}, 40 neurons, 3 inputs, 3122 readings, beside `MLPRegressor`"
        if peer is None:
            yield skipped(what, "scikit-learn is not installed: `pip install scikit-learn`", THIS, bar)
            continue
        _epoch_s(algorithm, problem, first, 3)
        ours, theirs = [], []
        for _ in range(rounds):
            ours.append(_epoch_s(algorithm, problem, first, epochs)[0])
            theirs.append(peer())
        own, other = Spread(tuple(ours)), Spread(tuple(theirs))
        yield Figure(
            what=what,
            measured=f"{own.text(_ms)} an epoch, {other.text(_ms)}: {other.best / own.best:.1f} x",
            value=other.best / own.best,
            bar=bar,
            command=THIS,
        )


def _sklearn(problem: Problem, inputs: Floats, epochs: int) -> Callable[[], float]:
    """Return what measures an epoch of scikit-learn on all readings at once, its faster solver of first order."""

    def once() -> float:
        net = MLPRegressor(
            hidden_layer_sizes=(40,),
            activation="logistic",
            solver="sgd",
            batch_size=problem.target.size,
            max_iter=epochs,
            alpha=0.0,
            tol=0.0,
            n_iter_no_change=epochs + 1,
            shuffle=False,
            random_state=0,
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that it has not converged
            begun = time.process_time()
            net.fit(inputs, problem.target)
        return (time.process_time() - begun) / float(net.n_iter_)

    once()
    return once


def _ten_starts(setting: Setting, data: Data) -> Figure:
    taken = []
    for _ in range(setting.of(5, 2)):
        found = [train_once(data, (30,), Algorithm.LM, seed) for seed in range(10)]
        if not all(one.reached(GOAL) for one in found):
            raise WrongResultError(f"sums of squares of {[one.squares for one in found]}")
        taken.append(sum(one.seconds for one in found))
    spread = Spread(tuple(taken))
    return Figure(
        what=f"Ten starts of Table 4-1 by Levenberg-Marquardt, {data.error.size} means over turns, to the goal",
        measured=spread.text(lambda s: f"{s:.2f} s"),
        value=spread.best,
        bar=Bar(value=5.0, unit="s", at_most=True),
        command=THIS,
    )


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.2f} ms"
