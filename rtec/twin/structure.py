"""Is anything left? Tests of what a model leaves against repeats: in the means, and in the differences between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import stats

from rtec.effects import Floats
from rtec.twin.dataset import Dataset
from rtec.twin.noise import Noise, NoiseFit, columns_in_time
from rtec.twin.repeat_space import RepeatSpace, changes_between_repeats, repeat_space, run_starts
from rtec.twin.score import orthonormal
from rtec.twin.workspace import Choice, Workspace

SIGNIFICANT = 0.01
DRAWS = 199
MOST_SIMULATED = 3000
"""With more differences than these the noise is known so well that nothing has to be simulated."""


def lack_of_fit_of_means(workspace: Workspace, choices: Sequence[Choice]) -> float | None:
    """Return the probability that what a model leaves of the repeatable part is noise.

    Where all runs are equal, the mean run is compared with the noise from differences between runs; else the mean of
    each cell. None without repeats.

    Notes
    -----
    An F-test: means and differences between repeats are independent, so the residual's energy in the means, over their
    degrees of freedom, is set against the variance from the differences.
    """
    space = repeat_space(workspace.dataset)
    if space is None or not workspace.noise.from_repeats:
        return None
    back = workspace.background(choices)
    residual = _means(back.residual[None, :], space)[0]
    basis = orthonormal(_means(back.basis.T, space))
    residual = residual - basis @ (basis.T @ residual)
    freedom = residual.size - basis.shape[1]
    if freedom < 1:
        return None
    return float(stats.f.sf(residual @ residual / freedom / workspace.noise.sigma**2, freedom, workspace.noise.freedom))


def _means(rows: Floats, space: RepeatSpace) -> Floats:
    """Return each row's means over repeats, with the variance of a reading: of equal runs, or of cells."""
    if space.slots is not None:
        means: Floats = rows.reshape(rows.shape[0], space.runs, -1).sum(axis=1) / np.sqrt(space.runs)
        return means
    cell = space.dataset.cell
    member = cell >= 0
    count = np.maximum(np.bincount(cell[member]), 1)
    found = [np.bincount(cell[member], weights=row[member]) / np.sqrt(count) for row in rows]
    return np.array(found).reshape(-1, count.size)


class BetweenRepeats:
    """Generic changes between repeats, and how well each kind is needed beside a model."""

    def __init__(self, dataset: Dataset, space: RepeatSpace, choices: Sequence[Choice]) -> None:
        self._space = space
        self._groups = {name: space.of(table) for name, table in changes_between_repeats(dataset, space).items()}
        own = columns_in_time(dataset, choices)
        self._own = space.of(own) if own.size else np.empty((0, space.observed.size))
        nuisance = np.vstack([*self._groups.values(), self._own])
        self._fit = NoiseFit(nuisance, space.starts, space.freedom)
        self._bases: dict[object, dict[str, Floats]] = {}

    def p_values(self, observed: Floats) -> dict[str, float]:
        """Return the probability of each kind of change by noise alone, times the number of kinds.

        The noise is estimated with all of them taken out, so that none of them hides behind itself.
        """
        sigma, correlation, freedom = self._fit.fit(observed, refine=False)
        if sigma == 0.0:
            return dict.fromkeys(self._groups, 1.0)
        if correlation not in self._bases:
            own = orthonormal(correlation.whitened(self._own, self._space.starts))
            self._bases[correlation] = {
                name: orthonormal(correlation.whitened(table, self._space.starts), own)
                for name, table in self._groups.items()
            } | {"": own}
        bases = self._bases[correlation]
        y = correlation.whitened(observed, self._space.starts)[0]
        y = y - bases[""] @ (bases[""].T @ y)
        share = self._space.freedom / observed.size
        found = {}
        for name, basis in bases.items():
            if name and basis.shape[1]:
                ratio = float(((basis.T @ y) ** 2).sum()) * share / basis.shape[1] / sigma**2
                found[name] = min(1.0, len(self._groups) * float(stats.f.sf(ratio, basis.shape[1], freedom)))
        return found


def changes_left(
    dataset: Dataset, noise: Noise, choices: Sequence[Choice], rng: np.random.Generator, draws: int = DRAWS
) -> dict[str, float]:
    """Return the probability of what a model leaves between repeats, by what it depends on.

    Where one looks improbable, that is confirmed by simulation: noise of the plain covariance, in which nothing of the
    kind was taken out, is drawn and judged in the same way, for with few repeats correlated noise and slow changes
    are hard to tell apart.
    """
    space = repeat_space(dataset)
    if space is None or space.freedom < 6:
        return {}
    between = BetweenRepeats(dataset, space, choices)
    found = between.p_values(space.observed)
    least = min(found.values(), default=1.0)
    if least >= SIGNIFICANT or space.freedom > MOST_SIMULATED:
        return found
    for draw in range(1, draws + 1):
        simulated = space.of(noise_drawn(dataset, noise, rng)[None, :])[0]
        if min(between.p_values(simulated).values(), default=1.0) <= least:
            return {name: max(p, 2.0 / (draw + 1.0)) for name, p in found.items()}
    return {name: max(p, 1.0 / (draws + 1.0)) for name, p in found.items()}


def noise_drawn(dataset: Dataset, noise: Noise, rng: np.random.Generator) -> Floats:
    """Return noise of each reading with the given covariance, shape (rows,)."""
    from scipy.signal import lfilter  # noqa: PLC0415 - 0.2 s, for simulations only

    starts = run_starts(dataset.coordinates.run)
    rho, white = noise.correlation.rho, noise.correlation.white
    drawn = rng.standard_normal(dataset.rows)
    if not noise.correlation.is_white:
        first = np.flatnonzero(starts)
        for begin, end in zip(first, np.append(first[1:], dataset.rows), strict=True):
            step = np.sqrt(1.0 - rho**2) * drawn[begin:end]
            step[0] = drawn[begin]
            drawn[begin:end] = lfilter([1.0], [1.0, -rho], step)
        drawn = np.sqrt(1.0 - white) * drawn + np.sqrt(white) * rng.standard_normal(dataset.rows)
    return noise.sigma * drawn

