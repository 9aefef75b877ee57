"""Each run of a positioning test held against the others: exchanged directions, another sign, another unit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.repeats import pair_numbers, place_numbers
from rtec.dataset.standstill import Ints
from rtec.effects import Floats

_FACTORS = {"mm": (1e3, 25.4, 10.0), "deg": (3600.0, 60.0, 10.0)}
"""By what units that are taken for each other differ; noise of two runs never differs by the first of them."""
_MOST_RUNS = 24  # runs of which some are chosen to judge all by
_MOST_PLACES = 200  # places at which runs are compared: what goes wrong with a run goes wrong at all of them
_FEWEST_FREE = 3  # degrees of freedom without which a run has no scatter
_SUSPECT, _SURE, _ALIKE = 6.0, 10.0, 5.0
"""Log likelihood ratio from which on two runs may differ by more than noise, from which on it is said, and up to
which two changes explain it equally well."""
_BETTER, _BETTER_OF_HALF = 1.5, 3.0
"""Times by which a run agrees better once it is changed, at least; where the others are but half of all."""
_SAME_SCATTER, _MOST = 4.0, 0.7
"""Times by which the scatter may miss the factor of the units, and share of the other runs that have to say so."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Misfit:
    """A run that agrees with the others only once it is changed."""

    run: int
    changes: tuple[float | None, ...]
    """What its deviations have to be multiplied by, None where its directions have to be exchanged: the likeliest
    change and those that explain it equally well."""
    others: tuple[int, ...]
    """Runs that it was held against."""
    outvoted: bool
    """Whether these are more than half of all, so that it is the one that is wrong."""
    before: float
    after: float
    """Scatter of its difference from the others as it is and once it is changed, in the unit of the observed."""


def misfits(data: Dataset) -> list[Misfit]:
    """Return the runs of readings at rest that agree with most others only with exchanged directions or a factor.

    Notes
    -----
    From the difference of two runs an offset and a part linear in position are taken off, then also one linear in the
    usual order of readings: a drift from run to run, or in one, is no misfit. Readings far off hardly count in that.
    The reference is the median of the largest group of runs that agree as they are, without the run that is judged. A
    run is wrong if it agrees 1.5 times better once it is changed, about as well as the others do, whom the change
    would make worse, with a log likelihood ratio of 10 (Student's, the noise known from the others); or if it
    scatters 1000 times as much or as little as they do.
    """
    runs, found = _Runs(data), dict[int, Misfit]()
    for columns in (2, 3) if runs.names.size > 1 else ():
        runs.drift = runs.columns[:, :columns]
        group = runs.alike()
        odd = list(runs.judged(group))
        rest = group[~np.isin(runs.names[group], [one.run for one in odd])]
        if rest.size < group.size:
            odd = list(runs.judged(rest)) if rest.size else odd[-1:]
        if runs.names.size > 2 or not found:
            found = {one.run: one for one in odd} | found
    return [found[run] for run in sorted(found)]


class _Runs:
    """Deviations of each run at each place and direction, as they are and changed; NaN where there is none."""

    def __init__(self, data: Dataset) -> None:
        place = place_numbers(data.conditions.position)
        if (step := int(place.max()) // _MOST_PLACES + 1) > 1:
            data, place = data.alone(np.flatnonzero(place % step == 0)), place[place % step == 0]
        c = data.conditions
        way = np.zeros(data.rows, dtype=np.int64) if c.direction is None else np.sign(c.direction).astype(np.int64)
        condition = pair_numbers(place, way)
        self.names, run = np.unique(c.run, return_inverse=True)
        rows = np.unique(condition, return_index=True)[1]
        position = c.position[rows] - c.position.min()
        order = np.bincount(condition, weights=np.arange(data.rows) - np.searchsorted(np.sort(run), run))
        drift = [np.ones(rows.size), position, order / np.bincount(condition)]
        self.columns = np.stack([part / max(float(np.abs(part).max()), 1e-300) for part in drift], axis=1)
        self.drift = self.columns
        sums, count = np.zeros((2, self.names.size, rows.size))
        np.add.at(sums, (run, condition), data.observed)
        np.add.at(count, (run, condition), 1.0)
        means = np.where(count > 0, sums / np.maximum(count, 1.0), np.nan)
        number = {pair: k for k, pair in enumerate(zip(place[rows].tolist(), way[rows].tolist(), strict=True))}
        other = np.array([number.get((at, -side), -1) if side else -1 for at, side in number])
        exchanged = np.where(other < 0, np.nan, means[:, other])
        factors = [-1.0, *(each for size in _FACTORS.get(data.units.position, ()) for each in (size, 1 / size))]
        self.changes = (1.0, None, *factors)
        self.log_size = np.log(np.abs([1.0, 1.0, *factors]))
        self.values = np.stack([means, exchanged, *(factor * means for factor in factors)])
        """Shape (changes, runs, conditions)."""

    def alike(self) -> Ints:
        """Return the numbers of the largest group of runs that agree with one of them as they are."""
        runs, groups = np.arange(min(self.names.size, _MOST_RUNS)), []
        for run in runs:
            _, scatter, free = self._fit(self.values[:, runs] - self.values[0, run])
            with np.errstate(divide="ignore", invalid="ignore"):
                gain = free[0] * (np.log(scatter[0] / scatter) + self.log_size[:, None])
            gain[:, run] = 0.0
            group = runs[np.nan_to_num(gain).max(axis=0) <= _SUSPECT]
            groups.append((-group.size, float(np.nansum(scatter[0])), run, group))
        return np.asarray(min(groups, key=lambda one: one[:3])[3])

    def judged(self, group: Ints) -> Iterator[Misfit]:
        """Yield the runs that agree with those of a group only once they are changed."""
        every = np.arange(self.names.size)
        scatter, free = np.full((2, len(self.values), every.size), np.nan)
        for run in every:
            if (rest := group[group != run]).size:
                left, _, _ = self._fit(self.values[0, rest] - self.values[0, rest[0]])
                middle = self.values[0, rest[0]] + _median(left.T)
                _, scatter[:, run], free[:, run] = self._fit(self.values[:, run] - middle)
        altered, own = self._fit(self.values - self.values[0])[1], self._fit(self.values[0])[1]
        for run in every[scatter[0] > 0.0]:
            rest = group[group != run]
            if 2 * rest.size < every.size:
                continue
            before, after, freedom, several = scatter[0, run], scatter[:, run], free[:, run], rest.size > 1
            ordered = np.sort(scatter[0, rest]) if several else np.zeros(1)
            near = ordered[-2 if rest.size > 3 else -1]  # one of four or more may have gone wrong in another way
            known = min(rest.size - 1, 3) * np.median(free[0, rest]) if several else 0.0
            # a change that leaves the others as they are tells nothing
            least = np.minimum(before, _median(scatter[:, rest]) if several else altered[:, rest[0]])
            allowed = near * (1.3 + 2.0 / np.sqrt(np.maximum(freedom, 1.0))) if several else np.inf
            outvoted = 2 * rest.size > every.size
            right = (least > (_BETTER if outvoted else _BETTER_OF_HALF) * after) & (after <= allowed)
            ratio = (known * near**2 + freedom * least**2) / (known * near**2 + freedom * after**2)
            worth = np.where(right, 0.5 * (freedom + known) * np.log(np.where(right, ratio, 1.0)), 0.0)
            for change in range(3, min(5, worth.size)):
                missed = np.abs(np.log(own[rest] / max(own[run], 1e-300)) - self.log_size[change])
                if np.mean(missed < np.log(_SAME_SCATTER)) > _MOST:
                    worth[change] = np.inf
            best = np.argsort(-worth)
            best = best[(worth[best] > _SURE) & (worth[best] >= worth[best[0]] - _ALIKE)]
            if best.size:
                yield Misfit(
                    run=int(self.names[run]),
                    changes=tuple(self.changes[change] for change in best),
                    others=tuple(self.names[rest].tolist()),
                    outvoted=outvoted,
                    before=float(before),
                    after=float(after[best[0]]),
                )

    def _fit(self, away: Floats) -> tuple[Floats, Floats, Floats]:
        """Return what a drift leaves of differences, NaN where one is not known, its scatter, its freedom."""
        known = np.isfinite(away)
        x, y = np.where(known[..., None], self.drift, 0.0), np.where(known, away, 0.0)
        free = known.sum(axis=-1) - np.linalg.matrix_rank(x)
        weight, left = known.astype(np.float64), y
        for _ in range(6):
            weighted = (x * weight[..., None]).swapaxes(-1, -2)
            numbers = np.linalg.solve(weighted @ x + 1e-9 * np.eye(x.shape[-1]), weighted @ y[..., None])
            left = np.where(known, y - (x @ numbers)[..., 0], np.nan)
            size = np.abs(np.where(known, left, 0.0))
            usual = 3.0 * np.nan_to_num(_median(np.abs(left)))[..., None] + 1e-300
            weight = known * np.minimum(1.0, usual / np.maximum(size, 1e-300)) ** 2
        scatter = np.sqrt((weight * size**2).sum(axis=-1) / np.maximum(free, 1))
        return left, np.where(free >= _FEWEST_FREE, scatter, np.nan), free.astype(np.float64)


def _median(values: Floats) -> Floats:
    """Return the median of what is known along the last axis, NaN where nothing is."""
    last = np.maximum(np.isfinite(values).sum(axis=-1) - 1, 0)[..., None]
    ordered = np.sort(values, axis=-1)
    low, high = (np.take_along_axis(ordered, middle, axis=-1)[..., 0] for middle in (last // 2, (last + 1) // 2))
    return np.asarray((low + high) / 2.0)
