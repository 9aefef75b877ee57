"""Is anything left? What a model leaves against repeats: in their means, and in the differences between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Effect, Floats, Shape
from rtec.inference import tails
from rtec.inference.noise import NoiseFit, columns_in_time, repeats_exactly
from rtec.inference.repeat_space import RepeatSpace, changes_between_repeats, repeat_space, run_starts
from rtec.inference.score import orthonormal
from rtec.inference.whitening import Correlation
from rtec.inference.workspace import Choice, Workspace, scan_cost

SIGNIFICANT = 0.005
"""Of each of two tests for what is left, of the means and of the changes: 0.01 in all."""
DRAWS = 99
FEWEST_DIFFERENCES = 6
LONGEST = 0.97
"""Correlation from reading to reading, 33 of them long: what is longer is a change."""
MOST_SHAPES = 100
MOST_SIMULATED = 3000
"""With more differences than these the noise is known so well that nothing has to be simulated."""


def lack_of_fit_of_means(workspace: Workspace, choices: Sequence[Choice]) -> float | None:
    """Return the probability that what a model leaves of the repeatable part is noise.

    Where all runs are equal, the mean run is compared with the noise from differences between runs; else the mean of
    each cell. None without repeats; a workspace of the mean run alone is compared as it is.

    Notes
    -----
    An F-test: means and differences between repeats are independent, so the residual's energy in the means, over
    their degrees of freedom, is set against the variance from the differences. Where the correlation is not known
    well, the probability is the mean over what it may be.
    """
    if not workspace.noise.from_repeats:
        return None
    space = repeat_space(workspace.dataset)
    found = [(share, _p_of_means(work, choices, space)) for share, work in workspace.likely]
    return None if any(p is None for _, p in found) else sum(share * p for share, p in found if p is not None)


def _p_of_means(workspace: Workspace, choices: Sequence[Choice], space: RepeatSpace | None) -> float | None:
    back = workspace.background(choices)
    residual, basis = back.residual, back.basis
    if space is not None:
        basis = orthonormal(_means(basis.T, space))
        residual = _means(residual[None, :], space)[0]
        residual = residual - basis @ (basis.T @ residual)
    freedom = residual.size - basis.shape[1]
    if freedom < 1:
        return None
    ratio = residual @ residual / freedom / workspace.noise.sigma**2
    return tails.f_ratio(ratio, freedom, workspace.noise.freedom)


def _means(rows: Floats, space: RepeatSpace) -> Floats:
    """Return each row's means over repeats, with the variance of a reading: of equal runs, or of cells."""
    if space.slots is not None:
        slots = rows.shape[1] // space.runs
        means: Floats = rows.reshape(rows.shape[0], space.runs, slots).sum(axis=1) / np.sqrt(space.runs)
        return means
    cell = space.dataset.cell
    member = cell >= 0
    count = np.maximum(np.bincount(cell[member]), 1)
    found = [np.bincount(cell[member], weights=row[member]) / np.sqrt(count) for row in rows]
    return np.array(found).reshape(-1, count.size)


class BetweenRepeats:
    """Generic changes between repeats, and how much likelier each kind makes the differences."""

    def __init__(self, dataset: Dataset, space: RepeatSpace, choices: Sequence[Choice]) -> None:
        own = columns_in_time(dataset, choices)
        own = space.of(own) if own.size else np.empty((0, space.observed.size))
        kinds = {name: space.of(table) for name, table in changes_between_repeats(dataset, space).items()}
        slow = kinds.pop("time")
        self._fits = {
            "none": NoiseFit(own, space.starts, space.freedom),
            "time": NoiseFit(np.vstack([own, slow]), space.starts, space.freedom),
        }
        self.added = {"time": slow.shape[0]}
        for name, table in kinds.items():
            self._fits[name] = NoiseFit(np.vstack([own, slow, table]), space.starts, space.freedom)
            self.added[name] = table.shape[0]

    def likely_without_changes(self, observed: Floats) -> tuple[list[Correlation], Floats]:
        """Return the correlations that the noise may have where nothing changes but what the model says, with shares.

        Slow changes stay in: were they taken out, correlated noise would look smaller and shorter than it is. Noise
        that is correlated over a good part of the measurement is not counted as noise: it is a change in time.
        """
        return self._fits["none"].likely(observed, longest=LONGEST)

    def ratios(self, observed: Floats) -> dict[str, Floats]:
        """Return twice the gain in log-likelihood by each kind of change, for data of shape (data, differences)."""
        found = {name: fit.largest_likelihoods(observed, longest=LONGEST) for name, fit in self._fits.items()}
        return {name: 2.0 * (found[name] - found["none" if name == "time" else "time"]) for name in self.added}


def changes_left(
    dataset: Dataset, choices: Sequence[Choice], rng: np.random.Generator, draws: int = DRAWS
) -> dict[str, float]:
    """Return the probability of what a model leaves between repeats, by what it depends on (Bonferroni).

    Notes
    -----
    The likelihood ratio of "noise, and generic changes" against "noise" is compared with its distribution for noise
    of the correlations that the data allow, drawn and judged in the same way (a gamma distribution with the mean and
    variance of the draws): with few repeats, slow changes and correlated noise are hard to tell apart, and chi-square
    would promise too much.
    """
    space = repeat_space(dataset)
    if space is None or space.freedom < FEWEST_DIFFERENCES or repeats_exactly(space):
        return {}
    between = BetweenRepeats(dataset, space, choices)
    seen = {name: float(ratio[0]) for name, ratio in between.ratios(space.observed[None, :]).items()}
    kinds = {name: count for name, count in between.added.items() if count}
    found = {name: len(kinds) * float(tails.chi_squared(seen[name], count)) for name, count in kinds.items()}
    if min(found.values(), default=1.0) < SIGNIFICANT and space.freedom <= MOST_SIMULATED:
        drawn = space.of(noises_drawn(dataset, *between.likely_without_changes(space.observed), rng, draws))
        for name, ratio in between.ratios(drawn).items():
            if name in found and found[name] < SIGNIFICANT:
                mean, variance = float(ratio.mean()), float(ratio.var(ddof=1)) + 1e-12
                found[name] = len(kinds) * tails.gamma(seen[name], mean, variance)
    return {name: min(1.0, p) for name, p in found.items()}


def noises_drawn(
    dataset: Dataset, correlations: Sequence[Correlation], shares: Floats, rng: np.random.Generator, draws: int
) -> Floats:
    """Return noise of each reading with standard deviation 1, its correlation drawn by share, shape (draws, rows)."""
    picked = rng.choice(len(correlations), size=draws, p=shares)
    return np.array([noise_drawn(dataset, correlations[k], rng) for k in picked])


def noise_drawn(dataset: Dataset, correlation: Correlation, rng: np.random.Generator) -> Floats:
    """Return noise of each reading with standard deviation 1 and the given correlation, shape (rows,)."""
    from scipy.signal import lfilter  # noqa: PLC0415 - 0.2 s, for simulations only

    starts = run_starts(dataset.coordinates.run)
    rho, white = correlation.rho, correlation.white
    drawn: Floats = rng.standard_normal(dataset.rows)
    if correlation.is_white:
        return drawn
    first = np.flatnonzero(starts)
    for begin, end in zip(first, np.append(first[1:], dataset.rows), strict=True):
        step = np.sqrt(1.0 - rho**2) * drawn[begin:end]
        step[0] = drawn[begin]
        drawn[begin:end] = lfilter([1.0], [1.0, -rho], step)
    mixed: Floats = np.sqrt(1.0 - white) * drawn + np.sqrt(white) * rng.standard_normal(dataset.rows)
    return mixed


def reversal_changes_instead(dataset: Dataset, choices: Sequence[Choice]) -> bool:
    """Return whether a reversal error that differs from run to run explains more than the lost counts of a model.

    Steps between passes can follow such an error from run to run; it is no effect of the library, but where it has
    more evidence (BIC, the noise estimated anew for each) the counts were not lost.
    """
    space = repeat_space(dataset)
    changes = None if space is None else changes_between_repeats(dataset, space).get("direction")
    if space is None or changes is None or space.freedom < FEWEST_DIFFERENCES or repeats_exactly(space):
        return False
    steps = [choice for choice in choices if choice[0].name == "lost_counts"]
    others = columns_in_time(dataset, [choice for choice in choices if choice not in steps])
    observed, cost = space.observed[None, :], 0.5 * float(np.log(space.freedom))
    evidence = []
    for columns, parameters in (
        (columns_in_time(dataset, steps), sum(1 + scan_cost(*choice) for choice in steps)),
        (changes, changes.shape[0]),
    ):
        fit = NoiseFit(space.of(np.vstack([others, columns])), space.starts, space.freedom)
        evidence.append(float(fit.largest_likelihoods(observed)[0]) - parameters * cost)
    return evidence[1] > evidence[0]


class ChanceInTime:
    """What correlated noise feigns of effects in time: the likelihood ratio of the best of them, by simulation.

    Notes
    -----
    The likelihood ratio of "noise, and this effect" against "noise", the covariance estimated anew for each, is
    compared with the largest over all effects in time and their scan grids for noise of the correlations that the
    differences allow without the effect (a Gumbel distribution with the mean and variance of the draws). So the test
    carries the uncertainty of the correlation, which a few repeats leave large.
    """

    def __init__(self, dataset: Dataset, library: Sequence[Effect], rng: np.random.Generator) -> None:
        self._dataset, self._rng = dataset, rng
        self._space = repeat_space(dataset)
        self._effects = [effect for effect in library if effect.in_time]
        self._known: dict[tuple[Choice, ...], tuple[NoiseFit, float, float]] = {}

    def p_value(self, rest: Sequence[Choice], choice: Choice) -> float:
        """Return the probability that noise feigns what a choice explains between repeats beside the rest."""
        space = self._space
        if space is None or space.freedom < FEWEST_DIFFERENCES or space.freedom > MOST_SIMULATED:
            return 0.0
        key = tuple(other for other in rest if other[0].in_time)
        if key not in self._known:
            self._known[key] = self._largest_by_chance(space, key)
        fit, location, scale = self._known[key]
        column = space.of(self._dataset.columns(*choice).T)
        seen = float(fit.likelihood_ratios(space.observed[None, :], column)[1][0])
        return tails.gumbel(seen, location, scale)

    def _largest_by_chance(self, space: RepeatSpace, rest: Sequence[Choice]) -> tuple[NoiseFit, float, float]:
        """Return the fit beside ``rest``, with location and scale of the largest likelihood ratio."""
        dataset = self._dataset
        fit = NoiseFit(space.of(columns_in_time(dataset, rest)), space.starts, space.freedom)
        drawn = space.of(noises_drawn(dataset, *fit.likely(space.observed), self._rng, DRAWS))
        shapes = [(e, shape) for e in self._effects for shape in _thinned(e.shapes(dataset.conditions))]
        columns = np.vstack([dataset.columns(effect, shape).T for effect, shape in shapes])
        largest = fit.likelihood_ratios(drawn, space.of(columns))[1]
        scale = float(largest.std(ddof=1)) * float(np.sqrt(6.0)) / np.pi + 1e-12
        return fit, float(largest.mean()) - np.euler_gamma * scale, scale


def _thinned(shapes: Sequence[Shape]) -> Sequence[Shape]:
    every = -(-len(shapes) // MOST_SHAPES)
    return shapes[::every]
