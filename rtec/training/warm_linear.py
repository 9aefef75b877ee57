"""Plain and physical models of a warm machine: the mean, least squares, ridge regression, first-order lags."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from rtec.predictors._columns import Floats
from rtec.predictors.fitting.warm.linear import fit_least_squares, fit_ridge
from rtec.predictors.warm.linear import Linear
from rtec.predictors.warm.regressor import RegressorFit
from rtec.training.warm_features import FeatureSet, described, lag_sets, scaled_columns, weights_of
from rtec.training.warm_parts import Places
from rtec.training.warm_scout import SHARES, BlockSums
from rtec.training.warm_task import ModelFit, WarmFit, WarmTask, fitted

CLEARLY = 0.9
"""Times the error by blocks of the usual features: others have to be better than that to be taken, for the lowest of
many errors is low by chance, too."""


def fit_mean(task: WarmTask) -> WarmFit:
    """Fit the mean of the training part: what all others have to beat."""
    parts, features = task.parts, task.plain[:1]
    centre = parts.columns(features).mean(axis=0)
    found = {}
    for name in parts.log.outputs:
        output = parts.outputs[name]
        left_out = None
        if parts.blocks > 1:
            rest = [output[parts.block != number].mean() for number in parts.block]
            left_out = output - np.array(rest)
        mean = Linear(centre=centre, intercept=float(output.mean()), slopes=np.zeros(1))
        found[name] = ModelFit(
            features=features, regressor=mean, rows=parts.rows, left_out=left_out, rms_rows_um=float(output.std())
        )
    return WarmFit(channels=found)


def fit_plain(task: WarmTask) -> WarmFit:
    """Fit all inputs as they are, by least squares."""
    return fitted(task, task.plain, task.parts.rows, fit_least_squares)


def fit_plain_ridge(task: WarmTask) -> WarmFit:
    """Fit all inputs as they are, by ridge regression."""
    found, share = _best_set(task, [task.plain])
    return _fit_shared_ridge(task, found, share)


def fit_lags(task: WarmTask) -> WarmFit:
    """Fit temperatures, heat of the spindle and what lags behind them, by ridge regression."""
    features, share = _best_set(task, lag_sets(tuple(task.parts.log.inputs)))
    task.lags = features
    return _fit_shared_ridge(task, features, share)


def _fit_shared_ridge(task: WarmTask, features: FeatureSet, share: float) -> WarmFit:
    weights = weights_of(features, task.parts.columns(features))

    def fit(columns: Floats, output: Floats, block: Places) -> RegressorFit:
        return fit_ridge(columns, output, block, shares=(share,), weights=weights)

    return fitted(task, features, task.parts.rows, fit, (described(features),))


def _best_set(task: WarmTask, sets: Sequence[FeatureSet]) -> tuple[FeatureSet, float]:
    """Return features and their ridge parameter, chosen by the error by blocks over all channels together."""
    parts = task.parts
    every = tuple(dict.fromkeys(one for features in sets for one in features))
    place = {one: k for k, one in enumerate(every)}
    scaled = scaled_columns(every, parts.columns(every))
    sums = BlockSums.of(scaled, np.stack(list(parts.outputs.values()), axis=1), parts.block)
    tried: list[tuple[float, float, FeatureSet]] = []
    for features in sets:
        if tried and time.perf_counter() > task.until_s:
            break
        tried.append((*sums.best_share([place[one] for one in features], SHARES), features))
    lowest = min(tried, key=lambda one: one[0])
    _, share, features = lowest if lowest[0] < CLEARLY * tried[0][0] else tried[0]
    return features, share
