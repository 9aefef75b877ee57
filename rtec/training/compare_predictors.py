"""Every method on the same parts of a measurement, side by side, within a time."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from rtec.dataset.dataset import Dataset
from rtec.errors import ArgumentError
from rtec.inference.noise import within_cells
from rtec.jobs import cores
from rtec.predictors import Predictor
from rtec.predictors.fitting.samples import Samples
from rtec.predictors.fitting.training import Effort, Limit
from rtec.training.methods import Fitted, Method, Task, all_methods, turn_warning
from rtec.training.parts import Parts, parts_of
from rtec.training.results import Kind, PredictorComparison, Row

COVERED = 0.9
"""Share of readings at other places that an interval is to hold."""
_LEAST_S = 0.5
"""That a network gets however short the budget is."""
_TIMED = 20_000
"""Evaluations that are timed."""
_LOOK_S = 0.2
"""Between two looks for Ctrl-C: one that comes just before a wait begins does not end it."""
Progress = Callable[[str, float], None]


def compare_predictors(
    dataset: Dataset,
    heldout: Dataset | None = None,
    *,
    effort: Effort | None = None,
    budget_s: float | None = 60.0,
    methods: Sequence[Method] | None = None,
    seed: int = 0,
    progress: Progress = lambda what, share: None,
) -> PredictorComparison:
    """Fit every kind of predictor to one measurement, and judge all of them by the same readings.

    Parameters
    ----------
    dataset
        The measurement.
    heldout
        Another one that judges; best one at other targets. Else a fifth of the places of the first.
    effort
        What a network is worth.
    budget_s
        Time for all networks together; they share it. None: each trains until its effort is spent.
    methods
        Which; None: all.
    seed
        Draws parts and first weights.
    progress
        Called with what is at work, with its loss, and the share done; from any thread, one at a time.

    Returns
    -------
    PredictorComparison
        A row for each method. Ctrl-C ends the trainings; each row then holds the best so far.

    Raises
    ------
    ArgumentError
        A measurement of which no predictor of positions can be made.
    """
    parts = parts_of(dataset, heldout, seed=seed)
    axes = len(parts.train.others_mm)
    pitch_mm = dataset.conditions.screw_pitch
    chosen = tuple(all_methods(several_axes=axes > 0) if methods is None else methods)
    task = Task(dataset=dataset, parts=parts, pitch_mm=pitch_mm, effort=replace(effort or Effort(), seed=seed))
    run = _Run(task, budget_s, chosen, progress)
    rows = run.rows()
    warning = turn_warning(parts, pitch_mm)
    return PredictorComparison(
        source=dataset.source,
        parts=parts,
        rows=rows,
        pitch_mm=pitch_mm,
        noise_mm=repeatability_mm(parts.train),
        notes=(*_stood_still(dataset, parts), *(() if warning is None else (warning,))),
        interrupted=run.stopped,
        axis=dataset.axis,
    )


def _stood_still(dataset: Dataset, parts: Parts) -> list[str]:
    """Return what has to be said of other axes that did not move."""
    still = [axis for axis in dataset.other_axes_mm if axis not in parts.train.others_mm]
    return [f"axis {axis} stood still: its influence cannot be learnt" for axis in still]


def repeatability_mm(samples: Samples) -> float | None:
    """Return the standard deviation of a reading about the mean of its place and direction; None without repeats."""
    cell = 2 * samples.place() + (samples.direction < 0.0)
    return within_cells(samples.error_mm, cell)[0] if np.bincount(cell).max() > 1 else None


class _Run:
    """The methods at work: what each may take, what all are told."""

    def __init__(self, task: Task, budget_s: float | None, methods: tuple[Method, ...], progress: Progress) -> None:
        self._task, self._budget_s, self._methods, self._progress = task, budget_s, methods, progress
        self._networks = sum(method.kind is Kind.NETWORK for method in methods)
        self._ended, self._handed_out = threading.Event(), threading.Event()
        self._lock = threading.Lock()
        self._begun = time.perf_counter()
        self._done = 0
        self._found: dict[str, Row] = {}

    @property
    def stopped(self) -> bool:
        """Whether Ctrl-C ended it."""
        return self._ended.is_set()

    def rows(self) -> tuple[Row, ...]:
        """Carry all methods out, and return their rows in the same order."""
        try:
            for method in self._methods:
                if method.kind is not Kind.NETWORK:
                    self._keep(method)
        except KeyboardInterrupt:
            self._ended.set()
        self._begun = time.perf_counter()
        left = [method for method in self._methods if method.name not in self._found]
        # trainings run side by side: a matrix product that takes all cores for itself would be in their way
        with threadpool_limits(1), ThreadPoolExecutor(cores(), thread_name_prefix="rtec-train") as pool:
            try:
                futures = [pool.submit(self._in_turn, method) for method in left]
                self._handed_out.set()
                while wait(futures, timeout=_LOOK_S).not_done:
                    pass
                for future in futures:
                    future.result()
            except KeyboardInterrupt:
                self._ended.set()
                self._handed_out.set()
        return tuple(self._found.get(method.name) or self._row(method) for method in self._methods)

    def _in_turn(self, method: Method) -> None:
        """Begin when all are handed out: for a thread that Ctrl-C finds starting, the pool would not wait."""
        self._handed_out.wait()
        self._keep(method)

    def _keep(self, method: Method) -> None:
        self._found[method.name] = self._row(method)

    def _row(self, method: Method) -> Row:
        limit = Limit(until_s=self._until(method), stopped=self._ended.is_set)
        begun = time.perf_counter()

        def tell(loss_mm: float) -> None:
            self._tell(f"{method.name}: {1e3 * loss_mm:.3g} µm")

        self._tell(method.name)
        row = Row(name=method.name, kind=method.kind)
        try:
            if self._ended.is_set():
                return replace(row, reason="ended before its turn")
            fitted = method.fit(replace(self._task, limit=limit, tell=tell))
        except ArgumentError as error:
            return replace(row, reason=str(error))
        finally:
            with self._lock:
                self._done += 1
        return judged(row, fitted, self._task.parts, time.perf_counter() - begun)

    def _until(self, method: Method) -> float:
        """Return when a method has to come to its end: networks share what is left of the budget."""
        if method.kind is not Kind.NETWORK or self._budget_s is None:
            return math.inf
        now = time.perf_counter()
        with self._lock:
            left, self._networks = self._networks, self._networks - 1
        share = min(cores(), left) / left
        return now + max(_LEAST_S, (self._begun + self._budget_s - now) * share)

    def _tell(self, what: str) -> None:
        with self._lock:
            share = self._done / len(self._methods)
            if self._budget_s is not None:
                passed = (time.perf_counter() - self._begun) / self._budget_s
                share = max(share, min(passed, 0.99))
            self._progress(what, min(share, 1.0))


def judged(row: Row, fitted: Fitted, parts: Parts, train_s: float) -> Row:
    """Return the row of what a method gave: its errors, how sure it is, and what it costs."""
    off_train, off_heldout = (part.left_by(fitted.predictor) for part in (parts.train, parts.heldout))
    unsure = fitted.predictor if fitted.unsure is None else fitted.unsure
    off_sure = parts.sure.left_by(unsure)
    interval = conformal_mm(off_sure)
    return replace(
        row,
        rms_sure_mm=_rms(off_sure) if off_sure.size else None,
        predictor=fitted.predictor,
        rms_train_mm=_rms(off_train),
        rms_heldout_mm=_rms(off_heldout),
        worst_heldout_mm=float(np.abs(off_heldout).max()),
        train_s=train_s,
        eval_ns=evaluation_ns(fitted.predictor, parts.train.span_mm),
        parameters=fitted.parameters,
        interval_mm=interval,
        coverage=float(np.mean(np.abs(off_heldout) <= interval)),
        notes=fitted.notes,
        courses=fitted.courses,
        tried=fitted.tried,
        model=fitted.model,
    )


def conformal_mm(off_mm: np.ndarray) -> float:
    """Return the half width of the interval that holds 90 % of new readings on average (split-conformal).

    Parameters
    ----------
    off_mm
        What readings that took no part in the fit are off, in mm, shape (n,); new ones are drawn as these were.

    Returns
    -------
    float
        The ``ceil(0.9 (n + 1))``-th of the absolute values; infinite where there are fewer than that.

    References
    ----------
    Vovk, Gammerman and Shafer, Algorithmic Learning in a Random World, 2005.

    Examples
    --------
    >>> conformal_mm(np.arange(-9.0, 10.0)), conformal_mm(np.array([1.0, 2.0]))
    (9.0, inf)
    """
    rank = math.ceil((off_mm.size + 1) * COVERED - 1e-9)
    return math.inf if rank > off_mm.size else float(np.sort(np.abs(off_mm))[rank - 1])


def evaluation_ns(predictor: Predictor, span_mm: tuple[float, float]) -> float:
    """Return what the error at one place takes in machine code, in ns of processor time."""
    x = np.random.default_rng(0).uniform(*span_mm, _TIMED)
    way = np.where(np.arange(_TIMED) % 2, 1, -1)
    rng = np.random.default_rng(1)
    others = [rng.uniform(*predictor.ranges[name], _TIMED) for name in predictor.inputs[2:]]
    predictor.error_mm(x[:2], way[:2], *(other[:2] for other in others))  # compiled now
    begun = time.thread_time()
    predictor.error_mm(x, way, *others)
    return (time.thread_time() - begun) / _TIMED * 1e9


def _rms(values: np.ndarray) -> float:
    return math.sqrt(float(np.mean(values**2)))
