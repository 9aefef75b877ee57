"""The intelligent methods of Yao et al. on a warm machine: LS-SVM, fuzzy networks, Bayesian networks, and both."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

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
from rtec.training.warm_features import FeatureSet, described
from rtec.training.warm_parts import Places
from rtec.training.warm_task import ModelFit, WarmFit, WarmTask, fitted

SCOUT_ROWS = 400
"""That settings are tried on: their error by blocks hardly changes with more."""
MOST_ROWS = 1000
"""That the last fit sees."""
Setting = TypeVar("Setting")


def fit_machine(task: WarmTask) -> WarmFit:
    """Fit LS-SVMs; features, width and gamma are chosen for all channels together."""
    every = list(itertools.product(WIDTHS, GAMMAS))

    def figures(columns: Floats, output: Floats, block: Places) -> list[float]:
        return [figure for _, figure in fit_ls_svm(columns, output, block).tried]

    features, best = _chosen(task, figures)
    width, gamma = every[best]
    return _with_rows(task, features, MOST_ROWS, partial(fit_ls_svm, widths=(width,), gammas=(gamma,)))


def fit_network(task: WarmTask, *, conjunction: Conjunction) -> WarmFit:
    """Fit fuzzy networks; features, components, rules and widths are chosen for all channels together."""
    every = list(itertools.product(COMPONENTS, RULES, OVERLAPS))

    def settings(place: int) -> dict[str, tuple[float, ...]]:
        components, rules, overlap = every[place]
        return {"components": (components,), "rules": (rules,), "overlaps": (overlap,)}

    def fit(place: int, columns: Floats, output: Floats, block: Places):
        return fit_fuzzy(columns, output, block, conjunctions=(conjunction,), seed=task.seed, **settings(place))

    def figures(columns: Floats, output: Floats, block: Places) -> list[float]:
        found = []
        for place in range(len(every)):
            try:
                found.append(rms(fit(place, columns, output, block).left_out))
            except ArgumentError:  # rows outside all rules, or fewer columns than components
                found.append(np.inf)
        return found

    features, best = _chosen(task, figures)
    return _with_rows(task, features, MOST_ROWS, partial(fit, best))


def fit_bayesian(task: WarmTask) -> WarmFit:
    """Fit Bayesian networks; each channel chooses its causes."""
    return _with_own_settings(task, MOST_ROWS, lambda features: partial(fit_bayes, features=features))


def fit_bayesian_mode(task: WarmTask) -> WarmFit:
    """Return the networks of `fit_bayesian` with the most probable state as their answer (equations 11 and 12)."""
    found = fit_bayesian(task)
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
    return _with_own_settings(task, SCOUT_ROWS, lambda features: partial(fit_bayes_ls_svm, features=features))
