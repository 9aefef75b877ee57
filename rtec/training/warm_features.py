"""Which features a model of a warm machine sees: temperatures, heat of the spindle, and what lags behind them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtec.predictors._columns import Floats
from rtec.predictors.warm.features import SPINDLE_SPEED, Feature

LAGS_S = ((1000.0, 10_000.0), (300.0, 3000.0), (3000.0, 30_000.0))
"""Time constants that are tried: of a spindle and of a column; then those of smaller and of larger machines."""
_SPEED_UNIT = 1000.0
FeatureSet = tuple[Feature, ...]


def lag_sets(inputs: Sequence[str]) -> list[FeatureSet]:
    """Return sets of features, the usual one first.

    Temperatures as they are and behind by two time constants, and the heat of the spindle behind by both; for each
    pair of time constants. Then the same without temperatures that are behind.

    Examples
    --------
    >>> [len(features) for features in lag_sets(["temperature_a", "temperature_b", "spindle_speed"])]
    [8, 8, 8, 4, 4, 4]
    """
    heats = tuple(Feature(of=name) for name in inputs if name != SPINDLE_SPEED)
    found: dict[bool, list[FeatureSet]] = {True: [], False: []}
    for lags in LAGS_S:
        behind = tuple(Feature(of=one.of, lag_s=lag_s) for lag_s in lags for one in heats)
        heat = tuple(Feature(of=SPINDLE_SPEED, lag_s=lag_s, heat=True) for lag_s in lags)
        heat = heat if SPINDLE_SPEED in inputs else ()
        found[True].append(heats + behind + heat)
        found[False].append(heats + heat)
    return [one for one in dict.fromkeys(found[True] + found[False]) if one]


def few_columns(inputs: Sequence[str]) -> FeatureSet:
    """Return the usual features without those temperatures that are behind, where there is a speed."""
    usual = lag_sets(inputs)[0]
    as_they_are = tuple(one for one in usual if one.of == SPINDLE_SPEED or one.lag_s == 0.0)
    return as_they_are if SPINDLE_SPEED in inputs else usual


def weights_of(features: FeatureSet, columns: Floats) -> Floats:
    """Return the weights of columns in a ridge regression: the root of the standard deviation in K or 1000 rev/min.

    A sensor that hardly moves shall not count as much as one that heats by 10 K, nor a ten times hotter one ten times
    as much.

    References
    ----------
    van den Berg et al. 2006: Pareto scaling.
    """
    unit = np.array([_SPEED_UNIT if one.of == SPINDLE_SPEED and not one.heat else 1.0 for one in features])
    spread = columns.std(axis=0) / unit
    return np.asarray(np.sqrt(np.where(spread > 0.0, spread, 1.0)))


def scaled_columns(features: FeatureSet, columns: Floats) -> Floats:
    """Return columns, shape (rows, features), with the weights of features as their standard deviations."""
    spread = columns.std(axis=0)
    return np.asarray(columns * weights_of(features, columns) / np.where(spread > 0.0, spread, 1.0))


def described(features: FeatureSet) -> str:
    """Return features in words.

    Examples
    --------
    >>> described((Feature(of="temperature_a"), Feature(of="spindle_speed", heat=True, lag_s=1200.0)))
    'Features: 1 temperature as it is; heat of the spindle (speed^(5/3)) behind by 20 min.'
    """
    heats = [one for one in features if one.of != SPINDLE_SPEED]
    lists = {
        f"{len({one.of for one in heats})} temperature{'s' * (len({one.of for one in heats}) > 1)}": heats,
        "heat of the spindle (speed^(5/3))": [one for one in features if one.of == SPINDLE_SPEED and one.heat],
        "speed": [one for one in features if one.of == SPINDLE_SPEED and not one.heat],
    }
    words = []
    for what, which in lists.items():
        lags = sorted({one.lag_s for one in which})
        if lags:
            behind = " and ".join(f"{lag_s / 60.0:.4g}" for lag_s in lags if lag_s > 0.0)
            as_is = ("as it is" if len(heats) < 2 else "as they are") if 0.0 in lags else ""
            words.append(f"{what} {' and '.join(filter(None, (as_is, f'behind by {behind} min' if behind else '')))}")
    return f"Features: {'; '.join(words)}."
