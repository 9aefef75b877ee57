"""Figures of NARX networks: an epoch beside scipy, the papers' trainings, and free runs over public measurements."""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from children import measure
from figures import Bar, Figure, Setting, Spread, skipped
from open_path_job import WrongResultError
from scipy.optimize import least_squares
from system_identification import DATA, SPLITS, Split, rms

from rtec.predictors import NarxShape
from rtec.predictors.fitting.bayesian import Evidence, bayesian_regularisation
from rtec.predictors.fitting.free_run import FreeRunSquares, first_weights
from rtec.predictors.fitting.narx import NarxFit, fit_narx

Floats = npt.NDArray[np.float64]
THIS = "python benchmarks/measure.py --only narx"
BALL_SCREW = NarxShape(channels=1, neurons=12, input_delays=range(4), feedback_delays=range(1, 5), linear=False)
LINEAR_MOTOR = NarxShape(channels=1, neurons=6, input_delays=range(5), feedback_delays=range(1, 5), linear=False)
"""The networks of Erwinski et al. 2016 and 2019: 121 and 67 weights."""
ORDERS, SIZES = (2, 3, 4, 5), (4, 8)
"""Lengths of the memory and sizes of the hidden layer, one of which the validation part chooses."""
GOALS: dict[str, dict[str, tuple[float, str]]] = {
    "Silverbox": {
        "multisine": (0.25, "GRU 1.49, SysIdentPy 7.73"),
        "arrow": (1.0, "GRU 2.80, SysIdentPy 4.15"),
        "arrow without extrapolation": (0.25, "GRU 0.947, SysIdentPy 2.23"),
    },
    "Cascaded Tanks": {"validation record": (0.40, "GRU 0.396, polynomial NARX 0.413")},
    "EMPS": {"second half": (4.5, "ARX 7.0")},
}
"""What the free runs are to reach, and what others reached."""
SEEDS = {"Silverbox": (5, 1), "Cascaded Tanks": (10, 2), "EMPS": (5, 1)}
"""Seeds in full and in quick runs."""
STARTS = {"Silverbox": 1, "Cascaded Tanks": 5, "EMPS": 2}
"""Of each size and length."""


def narx(setting: Setting) -> Iterator[Figure]:
    """Measure epochs, the papers' trainings, what is compiled, and the free runs."""
    yield from _beside_scipy(setting)
    yield _training_of_the_paper(setting)
    yield _first_compile()
    for name in SPLITS:
        yield from _free_runs(name, setting)


def _problem(shape: NarxShape, samples: int, *, closed: bool) -> tuple[FreeRunSquares, Floats]:
    """Return the training of a network on a second-order lag with an input that saturates and some noise."""
    draw = np.random.default_rng(0)
    u = np.clip(np.cumsum(0.03 * draw.normal(size=samples)) % 4.0 - 2.0, -1.0, 1.0)
    y = np.zeros(samples)
    drive = 0.05 * np.tanh(3.0 * u) + 0.01 * draw.normal(size=samples)
    for t in range(2, samples):
        y[t] = 1.6 * y[t - 1] - 0.65 * y[t - 2] + drive[t - 1]
    y /= np.abs(y).max()
    spans = np.array([[shape.lags, samples]])
    squares = FreeRunSquares(shape, np.ascontiguousarray(u[:, None]), y, spans, closed=closed)
    return squares, first_weights(shape, np.random.default_rng(1))


def _epoch_s(squares: FreeRunSquares, first: Floats, epochs: int) -> tuple[float, float]:
    """Return the processor time of an epoch, and the sum of squares after the last one."""
    seen: list[float] = []
    begun = time.process_time()
    bayesian_regularisation(squares, first, _counted(seen, epochs))
    return (time.process_time() - begun) / len(seen), seen[-1]


def _counted(seen: list[float], epochs: int) -> Callable[[Floats, Evidence], bool]:
    """Return what ends a training after some epochs, and keeps the sum of squares after each."""

    def watch(_: Floats, evidence: Evidence) -> bool:
        seen.append(evidence.squares)
        return len(seen) < epochs

    return watch


def _beside_scipy(setting: Setting) -> Iterator[Figure]:
    samples = 85_000
    begin, drawn = _problem(BALL_SCREW, samples, closed=False)
    opened, _ = bayesian_regularisation(begin, drawn, _counted([], 20))
    for closed, first in ((False, drawn), (True, opened)):
        squares, _ = _problem(BALL_SCREW, samples, closed=closed)
        _epoch_s(squares, first, 2)
        ours, theirs = [], []
        for _ in range(setting.of(3, 1)):
            seconds, found = _epoch_s(squares, first, setting.of(20, 10))
            ours.append(seconds)
            seconds, other = _least_squares_s(squares, first, setting.of(20, 10))
            theirs.append(seconds)
            if not max(found, other) < squares.squares(first):
                raise WrongResultError(f"sums of squares of {found:g} and, by scipy, {other:g}")
        own, peer = Spread(tuple(ours)), Spread(tuple(theirs))
        kind = "parallel" if closed else "series-parallel"
        what = f"An epoch of {kind} training, {samples} samples, {first.size} weights"
        yield Figure(
            what=what,
            measured=own.text(_in_s),
            value=own.best,
            bar=Bar(value=0.1, unit="s", at_most=True),
            command=THIS,
        )
        yield Figure(
            what=f"{what}, beside an iteration of `least_squares`, method lm, with the same Jacobian",
            measured=f"{own.text(_in_s)}, {peer.text(_in_s)}: {peer.best / own.best:.1f} x",
            value=peer.best / own.best,
            bar=Bar(value=10.0, unit="x scipy"),
            command=THIS,
        )


def _in_s(seconds: float) -> str:
    return f"{seconds:.3f} s"


def _least_squares_s(squares: FreeRunSquares, first: Floats, iterations: int) -> tuple[float, float]:
    """Return scipy's processor time for an iteration, and its sum of squares at the end."""

    def errors(weights: Floats) -> Floats:
        return np.concatenate([error.copy() for _, error in squares.blocks(weights)])

    def jacobian(weights: Floats) -> Floats:
        whole, at = np.empty((squares.samples, weights.size)), 0
        for rows, _ in squares.blocks(weights):
            whole[at : at + len(rows)] = rows
            at += len(rows)
        return whole

    begun = time.process_time()
    found: Any = least_squares(
        errors, first, jacobian, method="lm", max_nfev=iterations, ftol=1e-15, xtol=1e-15, gtol=1e-15
    )
    return (time.process_time() - begun) / max(found.njev, 1), 2.0 * found.cost


def _training_of_the_paper(setting: Setting) -> Figure:
    samples, minutes = 227_780, 0.0
    for closed, epochs in ((False, 2000), (True, 4000)):
        squares, first = _problem(LINEAR_MOTOR, samples, closed=closed)
        _epoch_s(squares, first, 1)
        minutes += epochs * _epoch_s(squares, first, setting.of(20, 4))[0] / 60.0
    return Figure(
        what=f"2000 series-parallel and 4000 parallel epochs, {samples} samples, {first.size} weights, by a few",
        measured=f"{minutes:.1f} min",
        value=minutes,
        bar=Bar(value=15.0, unit="min", at_most=True),
        command=THIS,
    )


_COMPILE = """
import time, numpy as np
from figures_narx import BALL_SCREW, _problem, _epoch_s
begun = time.process_time()
squares, first = _problem(BALL_SCREW, 2000, closed=True)
_epoch_s(squares, first, 1)
print(time.process_time() - begun)
"""


def _first_compile() -> Figure:
    words = [sys.executable, "-c", _COMPILE]
    with tempfile.TemporaryDirectory() as cache, tempfile.TemporaryDirectory() as folder:
        environment = {"NUMBA_CACHE_DIR": cache, "PYTHONPATH": str(Path(__file__).resolve().parent)}
        cold, warm = (float(measure(words, Path(folder), **environment).out) for _ in range(2))
    return Figure(
        what="What the first training compiles, processor time",
        measured=f"{cold - warm:.1f} s ({cold:.1f} s less {warm:.1f} s warm)",
        value=cold - warm,
        bar=Bar(value=5.0, unit="s", at_most=True),
        command=THIS,
    )


def trained(name: str, split: Split, seed: int) -> NarxFit:
    """Train on a benchmark; all is chosen by the validation part of its training data."""
    return fit_narx(split.train, neurons=SIZES, orders=ORDERS, starts=STARTS[name], seed=seed)


def _free_runs(name: str, setting: Setting) -> Iterator[Figure]:
    if not DATA.is_dir():
        for test, (goal, _) in GOALS[name].items():
            yield skipped(f"{name}, {test}", "no ../shared/data", THIS, Bar(value=goal, unit="", at_most=True))
        return
    split = SPLITS[name]()
    unit = split.train.unit.replace("um", "µm")
    found: dict[str, list[float]] = {test: [] for test in split.tests}
    seconds = []
    for seed in range(setting.of(*SEEDS[name])):
        begun = time.process_time()
        fit = trained(name, split, seed)
        seconds.append((time.process_time() - begun) / len(fit.starts))
        for test, data in split.tests.items():
            found[test].append(rms(fit.narx, data))
    for test, values in found.items():
        goal, others = GOALS[name][test]
        yield Figure(
            what=f"{name}, {test}: free run of a NARX network, median of {len(values)} seeds ({others})",
            measured=f"{np.median(values):.3g} {unit} ({min(values):.3g} to {max(values):.3g})",
            value=float(np.median(values)),
            bar=Bar(value=goal, unit=unit, at_most=True),
            command=THIS,
        )
    yield Figure(
        what=f"{name}: a start, {len(split.train)} samples, mean over {len(SIZES)} sizes and {len(ORDERS)} lengths",
        measured=f"{np.mean(seconds):.2g} s",
        value=float(np.mean(seconds)),
        bar=Bar(value=60.0, unit="s", at_most=True),
        command=THIS,
    )
