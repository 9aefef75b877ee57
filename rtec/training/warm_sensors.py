"""Which thermometers to buy: the best set of each size, how sure that choice is, and what a probe would add."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtec.predictors._columns import Floats
from rtec.predictors.fitting.warm.linear import fit_ridge
from rtec.predictors.fitting.warm.rows import rms
from rtec.predictors.warm.features import SPINDLE_SPEED, Feature
from rtec.training.warm_features import few_columns, scaled_columns, weights_of
from rtec.training.warm_parts import WarmParts
from rtec.training.warm_results import SensorRow
from rtec.training.warm_scout import SHARES, BlockSums

MOST_SENSORS = 6
"""Of a set that is looked for."""
_FEW_SHARES = SHARES[::3]


def sensor_rows(parts: WarmParts) -> tuple[SensorRow, ...]:
    """Return the best set of one thermometer, of two, ... of six, and all of them; empty without a thermometer.

    Every set is judged by a ridge regression on its thermometers and on the heat of the spindle behind by two time
    constants (without a speed: on the thermometers behind by them), by blocks that are left out. A set grows by the
    thermometer that helps most; then each is exchanged for another one where that helps. All is repeated without each
    block of the training part.
    """
    names = [name for name in parts.log.inputs if name != SPINDLE_SPEED]
    if not names:
        return ()
    search = _Search.of(parts, names)
    sizes = range(1, min(MOST_SENSORS, len(names)) + 1)
    sets = search.grown(search.sums, sizes[-1])
    blocks = range(search.sums.rows.size if search.sums.rows.size > 2 else 0)  # of two, none could be left out again
    repeats = [search.grown(search.sums.without(block), sizes[-1]) for block in blocks]
    rows = [search.row(parts, sets[size - 1], [each[size - 1] for each in repeats]) for size in sizes]
    if len(names) > sizes[-1]:
        rows.append(search.row(parts, tuple(names), [tuple(names)] * len(repeats)))
    return tuple(rows)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Search:
    """Features of all thermometers, and sums over blocks of their columns."""

    names: Sequence[str]
    features: tuple[Feature, ...]
    sums: BlockSums

    @classmethod
    def of(cls, parts: WarmParts, names: Sequence[str]) -> _Search:
        features = few_columns(tuple(parts.log.inputs))
        outputs = np.stack([parts.outputs[name] for name in parts.log.outputs], axis=1)
        sums = BlockSums.of(scaled_columns(features, parts.columns(features)), outputs, parts.block)
        return cls(names=names, features=features, sums=sums)

    def error(
        self, sums: BlockSums, sensors: Sequence[str], shares: Sequence[float] = _FEW_SHARES
    ) -> tuple[float, float]:
        """Return the error by blocks of a set, and its ridge parameter."""
        chosen = [k for k, one in enumerate(self.features) if one.of in sensors or one.of == SPINDLE_SPEED]
        return sums.best_share(chosen, shares)

    def grown(self, sums: BlockSums, most: int) -> list[tuple[str, ...]]:
        """Return the best set of each size that the sums show."""
        found: list[tuple[str, ...]] = []
        chosen: tuple[str, ...] = ()
        for _ in range(most):
            chosen = self._best(sums, [(*chosen, name) for name in self.names if name not in chosen])
            for place in range(len(chosen) - 1):
                rest = chosen[:place] + chosen[place + 1 :]
                chosen = self._best(sums, [chosen, *((*rest, name) for name in self.names if name not in chosen)])
            found.append(chosen)
        return found

    def _best(self, sums: BlockSums, sets: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
        return min(sets, key=lambda one: self.error(sums, one)[0])

    def row(self, parts: WarmParts, sensors: tuple[str, ...], repeats: Sequence[tuple[str, ...]]) -> SensorRow:
        """Return the row of a set, judged on the held-out part."""
        error, share = self.error(self.sums, sensors, SHARES)
        features = tuple(one for one in self.features if one.of in sensors or one.of == SPINDLE_SPEED)
        columns = parts.columns(features)
        off = []
        for name, judged in parts.judged.items():
            weights = weights_of(features, columns)
            fit = fit_ridge(columns, parts.outputs[name], parts.block, shares=(share,), weights=weights)
            off.append(judged - fit.regressor.predict(parts.judging_columns(features))[0])
        hours = parts.hours
        times = max(len(repeats), 1)
        return SensorRow(
            sensors=sensors,
            rms_blocks_um=error,
            rms_heldout_um=rms(np.array(off)),
            rms_hourly_um=rms(np.array([updated_hourly(one, hours) for one in off])),
            share={name: sum(name in each for each in repeats) / times for name in sensors},
            same=sum(set(each) == set(sensors) for each in repeats) / times,
            is_all=len(sensors) == len(self.names),
        )


def updated_hourly(error: Floats, hours: Floats) -> Floats:
    """Return errors where a probe reads at the first row and every hour after it, and what it finds is added.

    Parameters
    ----------
    error
        Measured less predicted, shape (rows,).
    hours
        Time in hours, ascending, shape (rows,).

    Examples
    --------
    >>> updated_hourly(np.array([5.0, 6.0, 7.0, 9.0]), np.array([0.0, 0.5, 1.0, 1.5])).tolist()
    [5.0, 1.0, 2.0, 2.0]
    """
    hour = np.floor(hours - hours[0] + 1e-9)
    reads = np.flatnonzero(np.diff(hour, prepend=-1.0) > 0.0)
    added = error[reads[np.searchsorted(reads, np.arange(error.size), side="left") - 1]]
    added[0] = 0.0
    return np.asarray(error - added)
