"""Rules that name the operating condition of each row: heating, steady or cooling, and the class of the speed."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rtec.predictors._columns import Floats
from rtec.predictors.fitting.warm._left_out_kernels import Places
from rtec.predictors.fitting.warm.states import Cutting, cuts_of
from rtec.predictors.warm.bayes_lssvm import NONE, signs_of
from rtec.predictors.warm.features import SPINDLE_SPEED, Feature

SPEED_CLASSES = 3
STEADY = 0.1
"""A machine is steady whose temperatures lead those that lag behind them by less than this share of the most."""
TRENDS = ("cooling", "steady", "heating")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Labels:
    """A way to divide rows into conditions.

    Parameters
    ----------
    by
        What divides them.
    names
        Of the conditions, in words.
    of_row
        Condition of each row, shape (rows,).
    """

    by: str
    names: tuple[str, ...]
    of_row: Places

    def __and__(self, other: Labels) -> Labels:
        """Divide by both; conditions without rows are left out."""
        found, of_row = np.unique(self.of_row * len(other.names) + other.of_row, return_inverse=True)
        names = [f"{self.names[both // len(other.names)]}, {other.names[both % len(other.names)]}" for both in found]
        return Labels(by=f"{self.by} and {other.by}", names=tuple(names), of_row=of_row)


def signs_among(features: Sequence[Feature]) -> dict[str, tuple[int, int]]:
    """Return what tells a condition, by name: each speed, and each sensor less what lags behind it most.

    Examples
    --------
    >>> bearing = Feature(of="temperature_bearing"), Feature(of="temperature_bearing", lag_s=60.0)
    >>> signs_among((Feature(of="spindle_speed"), *bearing))
    {'spindle_speed': (0, -1), 'temperature_bearing less behind by 60 s': (1, 2)}
    """
    found = {str(one): (k, NONE) for k, one in enumerate(features) if one.of == SPINDLE_SPEED}
    for k, one in enumerate(features):
        lags = [(other.lag_s, i) for i, other in enumerate(features) if (other.of, other.heat) == (one.of, one.heat)]
        lag_s, beside = max(lags)
        if one.lag_s == 0.0 and lag_s > 0.0:
            found[f"{one} less behind by {lag_s:.4g} s"] = (k, beside)
    return found


def divisions(features: Sequence[Feature], columns: Floats) -> Iterator[Labels]:
    """Yield ways to divide rows into two conditions or more: by trend, by speed, by both."""
    ways = [way for way in (_by_trend(features, columns), _by_speed(features, columns)) if len(way.names) > 1]
    yield from ways
    if len(ways) > 1:
        yield ways[0] & ways[1]


def _by_trend(features: Sequence[Feature], columns: Floats) -> Labels:
    pairs = [(a, b) for a, b in signs_among(features).values() if b != NONE]
    pairs = [pair for pair in pairs if features[pair[0]].of != SPINDLE_SPEED] or pairs
    lead = signs_of(columns, tuple(pairs)).mean(axis=1) if pairs else np.zeros(len(columns))
    limit = STEADY * np.abs(lead).max()
    return _occurring("trend", TRENDS, 1 + (lead > limit).astype(np.int64) - (lead < -limit))


def _by_speed(features: Sequence[Feature], columns: Floats) -> Labels:
    speeds = [k for k, one in enumerate(features) if one.of == SPINDLE_SPEED]
    if not speeds:
        return Labels(by="speed", names=("any speed",), of_row=np.zeros(len(columns), dtype=np.int64))
    nearest = min(speeds, key=lambda k: (features[k].lag_s, features[k].heat))
    cuts = cuts_of(columns[:, nearest], SPEED_CLASSES, Cutting.EQUAL_COUNTS)
    ends = [f"{cut:.4g}" for cut in cuts]
    between = [f"{low} to {high}" for low, high in itertools.pairwise(ends)]
    names = [f"below {ends[0]}", *between, f"above {ends[-1]}"] if ends else ["any"]
    found = tuple(f"{features[nearest]} {name}" for name in names)
    return _occurring("speed", found, np.searchsorted(cuts, columns[:, nearest]))


def _occurring(by: str, names: Sequence[str], of_row: Places) -> Labels:
    found, of_row = np.unique(of_row, return_inverse=True)
    return Labels(by=by, names=tuple(names[k] for k in found), of_row=of_row)
