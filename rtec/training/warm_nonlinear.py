"""The intelligent methods of Yao et al. on a warm machine: LS-SVM, fuzzy networks, Bayesian networks, and both."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.fitting.warm.bayes import fit_bayes
from rtec.predictors.fitting.warm.bayes_lssvm import fit_bayes_ls_svm
from rtec.predictors.fitting.warm.fuzzy import COMPONENTS, OVERLAPS, RULES, fit_fuzzy
from rtec.predictors.fitting.warm.lssvm import GAMMAS, WIDTHS, fit_ls_svm
from rtec.predictors.fitting.warm.rows import rms, thin_by_blocks
from rtec.predictors.warm.bayes import BayesRegressor
from rtec.predictors.warm.fuzzy import Conjunction
from rtec.predictors.warm.regressor import RegressorFit
from rtec.training.warm_features import FeatureSet, described, few_columns
from rtec.training.warm_parts import Places
from rtec.training.warm_task import FitRows, ModelFit, NoFigureError, WarmFit, WarmTask, fitted

SCOUT_ROWS = 400
"""That settings are tried on: their error by blocks hardly changes with more."""
MOST_ROWS = 1000
"""That the last fit sees."""
FEW_ROWS = 250
"""That machines for each operating condition see: without a block, each is trained again."""


def fit_machine(task: WarmTask) -> WarmFit:
    """Fit LS-SVMs; features, width and gamma are chosen for all channels together."""
    every = list(itertools.product(WIDTHS, GAMMAS))

    def figures(columns: Floats, output: Floats, block: Places) -> list[float]:
        return [figure for _, figure in fit_ls_svm(columns, output, block).tried]

    features, best = _chosen(task, figures)
    width, gamma = every[best]
    return _with_rows(task, features, _rows(task, MOST_ROWS), partial(fit_ls_svm, widths=(width,), gammas=(gamma,)))


def fit_network(task: WarmTask, *, conjunction: Conjunction) -> WarmFit:
    """Fit fuzzy networks; features, components, rules and widths are chosen for all channels together."""
    every = list(itertools.product(COMPONENTS, RULES, OVERLAPS))

    def fit(place: int, columns: Floats, output: Floats, block: Places) -> RegressorFit:
        components, rules, overlap = every[place]
        return fit_fuzzy(
            columns,
            output,
            block,
            components=(components,),
            rules=(rules,),
            overlaps=(overlap,),
            conjunctions=(conjunction,),
            seed=task.seed,
        )

    def figures(columns: Floats, output: Floats, block: Places) -> list[float]:
        found = []
        for place in range(len(every)):
            try:
                found.append(rms(fit(place, columns, output, block).left_out))
            except ArgumentError:  # rows outside all rules, or fewer columns than components
                found.append(np.inf)
        return found

    features, best = _chosen(task, figures)
    return _with_rows(task, features, _rows(task, MOST_ROWS), partial(fit, best))


def fit_bayesian(task: WarmTask) -> WarmFit:
    """Fit Bayesian networks; each channel chooses its causes."""
    task.bayes = _with_own_settings(task, MOST_ROWS, lambda features: partial(fit_bayes, features=features))
    return task.bayes


def fit_bayesian_mode(task: WarmTask) -> WarmFit:
    """Return the networks of `fit_bayesian` with the most probable state as their answer (equations 11 and 12)."""
    found = task.bayes or fit_bayesian(task)
    channels = {}
    for name, one in found.channels.items():
        assert isinstance(one.regressor, BayesRegressor)  # noqa: S101 - what fit_bayes gives
        channels[name] = ModelFit(
            features=one.features, regressor=Mode(machine=one.regressor), rows=one.rows, left_out=None
        )
    note = "The most probable state; its error by blocks is not looked at, and it is never chosen."
    return WarmFit(channels=channels, notes=(note,))


@dataclass(frozen=True, slots=True, kw_only=True)
class Mode:
    """The mean of the most probable state of a network's output."""

    machine: BayesRegressor

    @property
    def parameters(self) -> int:
        """As of the network."""
        return self.machine.parameters

    def predict(self, columns: Floats) -> tuple[Floats, Floats]:
        """Return the answer of each row, and zeros: the most probable state says nothing of the others."""
        state = np.argmax(self.machine.weights(columns), axis=1)
        return self.machine.means[state], np.zeros(len(columns))


def fit_both(task: WarmTask) -> WarmFit:
    """Fit a Bayesian network that tells the operating condition, and an LS-SVM for each condition."""
    return _with_own_settings(task, FEW_ROWS, lambda features: partial(fit_bayes_ls_svm, features=features))


def _rows(task: WarmTask, most: int) -> Places:
    """Return rows of the training part, evenly from each block, no more than ``most``."""
    parts = task.parts
    return parts.rows[thin_by_blocks(parts.block, most_rows=min(most, parts.rows.size))]


def _sets(task: WarmTask) -> list[FeatureSet]:
    """Return the sets of features that are tried: as they are, with lagging heat, those of the first-order lags."""
    few = few_columns(tuple(task.parts.log.inputs))
    return list(dict.fromkeys([task.plain, few, *([task.lags] if task.lags else [])]))


def _chosen(task: WarmTask, figures: Callable[[Floats, Floats, Places], list[float]]) -> tuple[FeatureSet, int]:
    """Return the features, and the place of the setting, with the lowest error by blocks over all channels."""
    parts, rows = task.parts, _rows(task, SCOUT_ROWS)
    at = np.searchsorted(parts.rows, rows)
    tried: list[tuple[float, int, FeatureSet]] = []
    for features in _sets(task):
        if tried and time.perf_counter() > task.until_s:
            break
        columns = parts.columns(features)[at]
        squares = np.sum(
            [np.square(figures(columns, output[at], parts.block[at])) for output in parts.outputs.values()], axis=0
        )
        tried.append((float(squares.min()), int(np.argmin(squares)), features))
    least, best, features = min(tried, key=lambda one: one[0])
    if not np.isfinite(least):
        raise NoFigureError("no setting of it answers in every row")
    return features, best


def _with_own_settings(task: WarmTask, most: int, fit_of: Callable[[FeatureSet], FitRows]) -> WarmFit:
    """Return the fit whose features have the lowest error by blocks over all channels; each channel sets the rest."""
    rows = _rows(task, most)
    found: list[tuple[float, WarmFit]] = []
    for features in _sets(task):
        if found and time.perf_counter() > task.until_s:
            break
        fit = _with_rows(task, features, rows, fit_of(features))
        errors = [rms(one.left_out) for one in fit.channels.values() if one.left_out is not None]
        found.append((rms(np.array(errors)), fit))
    return min(found, key=lambda one: one[0])[1]


def _with_rows(task: WarmTask, features: FeatureSet, rows: Places, fit: FitRows) -> WarmFit:
    every = task.parts.rows.size
    thinned = (f"Fitted to {rows.size} of {every} rows.",) if rows.size < every else ()
    return fitted(task, features, rows, fit, (described(features), *thinned))
