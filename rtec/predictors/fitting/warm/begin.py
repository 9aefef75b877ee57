"""From a log to where what lags begins: what temperatures tell of it."""

from __future__ import annotations

import numpy as np

from rtec.predictors._columns import Floats
from rtec.predictors.warm.begin import Begin, lagging, seen_at_once
from rtec.predictors.warm.features import Feature

_RIDGE = 1e-3
"""For each row and each column of unit spread: neighbouring thermometers share what they tell."""


def fit_begin(features: tuple[Feature, ...], columns: Floats) -> Begin | None:
    """Return what temperatures tell of the features that lag, by ridge regression over a log.

    Parameters
    ----------
    features
        Those of a model.
    columns
        Of them, shape (rows, features); what began in balance counts, too.

    Returns
    -------
    Begin or None
        None where nothing lags, or no temperature is seen as it is: then what lags begins in balance.

    Examples
    --------
    >>> features = (Feature(of="temperature_a"), Feature(of="temperature_a", lag_s=600.0))
    >>> heat = np.linspace(20.0, 30.0, 50)
    >>> fit_begin(features, np.stack([heat, 0.5 * heat], axis=1)).numbers.round(2).tolist()
    [[10.0, 15.0, 0.01, 0.5]]
    """
    seen, behind = seen_at_once(features), lagging(features)
    if not seen or not behind:
        return None
    told, told_by = columns[:, behind], columns[:, seen]
    spread = np.where(np.ptp(told_by, axis=0) > 0.0, told_by.std(axis=0), 1.0)
    centred = (told_by - told_by.mean(axis=0)) / spread
    normal = centred.T @ centred + _RIDGE * len(columns) * np.eye(len(seen))
    slopes = np.linalg.solve(normal, centred.T @ (told - told.mean(axis=0))) / spread[:, None]
    constant = told.mean(axis=0) - told_by.mean(axis=0) @ slopes
    ends = np.stack([told.min(axis=0), told.max(axis=0), constant], axis=1)
    return Begin(features=features, numbers=np.concatenate([ends, slopes.T], axis=1))
