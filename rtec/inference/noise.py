"""Noise of a reading and its correlation: from repeats - or from what a model leaves, where there are none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.effects import LIBRARY, Effect, Floats, Shape
from rtec.inference.repeat_space import RepeatSpace, changes_between_repeats, repeat_space
from rtec.inference.results import NoiseFloor
from rtec.inference.score import background, gains
from rtec.inference.whitening import Correlation

_RHO = (0.3, 0.5, 0.7, 0.8, 0.87, 0.92, 0.95, 0.97, 0.985, 0.994, 0.998)
_WHITE = (0.1, 0.25, 0.5, 0.75)
_MIXED_FROM = 0.7
"""An autoregressive part with a white part beside it is tried from this correlation on: below, the two look alike."""
GRID = (
    Correlation(),
    *(Correlation(rho=rho) for rho in _RHO),
    *(Correlation(rho=rho, white=white) for rho in _RHO if rho >= _MIXED_FROM for white in _WHITE),
)
WORTH = 3.0
"""Log-likelihood that a further parameter of the correlation has to bring (BIC asks for 2.6 at 200 readings)."""
FEWEST = 9
"""With fewer differences no correlation is estimated."""
_RANK = 1e-10
_TRIFLE = 2e-3
_ROUNDING = 1e-3
"""Of the smallest noise believed: differences below are rounding."""
_DECIDED = 0.97
"""Share of the best correlation from which on no other one is considered."""
_NEGLIGIBLE = 0.03
"""Share of a correlation, compared with the best, below which it is left out."""
_MOMENTS = 250
"""At which a step is tried when the noise is estimated; of an effect in time, so many shapes."""
_FEWEST_MOMENTS, _MOST_NUMBERS = 20, 5_000_000
_SLOW_PARAMETERS, _STEP_PARAMETERS = 2.4, 4.0
"""In whose place a slow effect, or a step, has to stand to be believed beside correlated noise."""
_LEAST = 2.5
"""Log-likelihood that a parameter has to bring, however few differences there are: that of BIC at 150."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """Noise of a reading.

    Parameters
    ----------
    sigma
        Standard deviation, in the observed unit inside.
    correlation
        From reading to reading.
    freedom
        Degrees of freedom of ``sigma``.
    from_repeats
        Whether it comes from repeats; else from a model's residual, which holds everything that the model lacks.
    likely
        What it may be instead, where few repeats leave its correlation open: noises with the share of each (sum 1).
    """

    sigma: float
    correlation: Correlation
    freedom: float
    from_repeats: bool
    likely: tuple[tuple[float, Noise], ...] = ()


class NoiseFit:
    """Restricted maximum likelihood of the noise in differences from which some columns are taken out.

    Parameters
    ----------
    nuisance
        Shape (columns, rows): what is taken out.
    starts
        Shape (rows,): where segments of consecutive readings begin.
    freedom
        Independent differences among the rows.

    Notes
    -----
    The correlation is looked for on a grid, so that the same grid, prepared once, serves any number of simulated
    data. A parameter more has to be worth its log-likelihood: white, then autoregressive, then both.

    References
    ----------
    H. D. Patterson, R. Thompson, Recovery of inter-block information when block sizes are unequal, Biometrika 58
    (1971) 545: the likelihood of what is left when fixed columns are taken out.
    """

    def __init__(self, nuisance: Floats, starts: NDArray[np.bool_], freedom: float) -> None:
        self._starts = starts
        self._freedom = freedom
        norm = np.sqrt((nuisance**2).sum(axis=1))
        self._nuisance = nuisance[norm > 0.0] / norm[norm > 0.0][:, None]
        self._prepared: dict[Correlation, tuple[Floats, float, int]] = {}

    def fit(self, observed: Floats, *, refine: bool = True) -> tuple[float, Correlation, float]:
        """Return standard deviation, correlation and degrees of freedom that suit ``observed`` best."""
        flat = Correlation()
        best, value = flat, self._likelihood(observed, flat)[0]
        if observed.size >= FEWEST and np.isfinite(value):
            values = [(self._likelihood(observed, c)[0], k) for k, c in enumerate(GRID)]
            chain, mixed = values[1 : len(_RHO) + 1], values[len(_RHO) + 1 :]
            for found, k in (max(chain), max(mixed)):
                if found > value + WORTH:
                    value, best = found, GRID[k]
            if refine and not best.is_white:
                best = self._refined(observed, best)
        sigma, freedom = self.deviation(observed, best)
        return sigma, best, freedom

    def largest_likelihoods(self, observed: Floats, *, longest: float = 1.0) -> Floats:
        """Return the largest plain log-likelihood over the grid for each of several data, shape (data, rows).

        Unlike the restricted one it may be compared between fits from which different columns are taken out.
        """
        return self.likelihood_ratios(observed, np.empty((0, observed.shape[1])), longest=longest)[0]

    def likelihood_ratios(self, observed: Floats, columns: Floats, *, longest: float = 1.0) -> tuple[Floats, Floats]:
        """Return the largest plain log-likelihoods, and by how much they rise with the best of further columns.

        Parameters
        ----------
        observed
            Shape (data, rows).
        columns
            Shape (columns, rows), each of which is added alone.
        longest
            Largest correlation from reading to reading that counts.

        Returns
        -------
        tuple
            Of shape (data,) each.
        """
        alone = np.full(observed.shape[0], -np.inf)
        added = alone.copy()
        share = self._freedom / observed.shape[1]
        for c in (c for c in GRID if c.rho <= longest):
            if c not in self._prepared:
                self._prepared[c] = self._prepare(c)
            basis = self._prepared[c][0]
            y = c.whitened(observed, self._starts)
            y = y - (y @ basis) @ basis.T
            rss = (y**2).sum(axis=1)
            log_det = c.log_determinant(self._starts) * share
            alone = np.maximum(alone, self._plain(rss * share, log_det))
            if columns.size:
                more = c.whitened(columns, self._starts)
                more = more - (more @ basis) @ basis.T
                length = (more**2).sum(axis=1)
                more = more[length > _RANK] / np.sqrt(length[length > _RANK])[:, None]
                fall = ((y @ more.T) ** 2).max(axis=1, initial=0.0)
                added = np.maximum(added, self._plain((rss - fall) * share, log_det))
        return alone, np.maximum(added - alone, 0.0)

    def likely(self, observed: Floats, *, longest: float = 1.0) -> tuple[list[Correlation], Floats]:
        """Return the correlations of the grid that are of the kind of the best, and how likely each is (sum 1).

        What a few repeats leave open about the correlation, all values of the grid up to ``longest`` being as likely
        beforehand.
        """
        best = self.fit(observed, refine=False)[1]
        alike = [c for c in GRID if (c.is_white, c.white > 0.0) == (best.is_white, best.white > 0.0)]
        kind = [c for c in alike if c.rho <= longest]
        values = np.array([self._likelihood(observed, c)[0] for c in kind])
        if not np.isfinite(values.max()):
            return [best], np.ones(1)
        shares: Floats = np.exp(values - values.max())
        return kind, shares / shares.sum()

    def deviation(self, observed: Floats, c: Correlation) -> tuple[float, float]:
        """Return the standard deviation that suits a correlation, and its degrees of freedom."""
        _, variance, freedom = self._likelihood(observed, c)
        return float(np.sqrt(variance)), freedom

    def _plain(self, rss: Floats, log_det: float) -> Floats:
        value: Floats = -0.5 * (self._freedom * np.log(np.maximum(rss, 1e-300) / self._freedom) + log_det)
        return value

    def _refined(self, observed: Floats, best: Correlation) -> Correlation:
        """Climb from a grid point to the top between its neighbours."""
        from scipy.optimize import minimize  # noqa: PLC0415 - 0.2 s, for fits only

        mixed = best.white > 0.0

        def at(v: NDArray[np.float64]) -> Correlation:
            rho = min(float(np.tanh(abs(v[0]))), 0.9995)
            return Correlation(rho=rho, white=float(1.0 / (1.0 + np.exp(-v[1]))) if mixed else 0.0)

        begin = [np.arctanh(best.rho)] + ([np.log(best.white / (1.0 - best.white))] if mixed else [])
        options = {"maxiter": 60, "xatol": 0.01, "fatol": 0.01}
        found = minimize(
            lambda v: -self._likelihood(observed, at(v), keep=False)[0], begin, method="Nelder-Mead", options=options
        )
        return at(found.x)

    def _likelihood(self, observed: Floats, c: Correlation, *, keep: bool = True) -> tuple[float, float, float]:
        """Return log-likelihood with the variance profiled out, that variance, and its degrees of freedom."""
        if c in self._prepared:
            basis, log_det, rank = self._prepared[c]
        else:
            basis, log_det, rank = self._prepare(c)
            if keep:
                self._prepared[c] = basis, log_det, rank
        y = c.whitened(observed, self._starts)[0]
        y = y - (y @ basis) @ basis.T
        share = self._freedom / observed.size
        left = self._freedom - rank
        rss = float(y @ y) * share
        if left < 1.0 or rss <= 0.0:
            return -np.inf, max(rss, 0.0) / max(left, 1.0), max(left, 1.0)
        return -0.5 * (left * np.log(rss / left) + log_det), rss / left, left

    def _prepare(self, c: Correlation) -> tuple[Floats, float, int]:
        """Return an orthonormal basis of the whitened nuisance, the log-determinants, and the rank."""
        log_det = c.log_determinant(self._starts) * self._freedom / self._starts.size
        if not self._nuisance.size:
            return np.empty((self._starts.size, 0)), log_det, 0
        white = c.whitened(self._nuisance, self._starts)
        values, vectors = np.linalg.eigh(white @ white.T)
        good = values > _RANK * values[-1]
        basis = white.T @ (vectors[:, good] / np.sqrt(values[good]))
        return basis, log_det + float(np.log(values[good]).sum()), int(good.sum())


def columns_in_time(dataset: Dataset, terms: Sequence[tuple[Effect, Shape]]) -> Floats:
    """Return the columns of those effects that change from repeat to repeat, shape (columns, rows)."""
    found = [dataset.columns(effect, shape).T for effect, shape in terms if effect.in_time]
    return np.vstack(found) if found else np.empty((0, dataset.rows))


def noise_from_repeats(dataset: Dataset, terms: Sequence[tuple[Effect, Shape]] = ()) -> Noise | None:
    """Return the noise that repeats show, or None where nothing was repeated.

    Parameters
    ----------
    dataset
        With or without repeats.
    terms
        The model so far; of it, what changes in time is taken out.

    Notes
    -----
    A drift that is not in the model yet is no noise, but feigns a correlated one. So where the differences look
    correlated, and one effect in time, a step, or slow changes of any course are much likelier than that correlation,
    these are taken out. They are left in otherwise: taken out of noise that is correlated, they take its slow part
    with them, and what is left looks smaller and shorter than the noise is.
    """
    space = repeat_space(dataset)
    if space is None or space.freedom < 1:
        return None
    if repeats_exactly(space):
        sigma, freedom = _smallest(dataset), float(space.freedom)
        return Noise(sigma=sigma, correlation=Correlation(), freedom=freedom, from_repeats=True)
    own = space.of(columns_in_time(dataset, terms))
    fit = NoiseFit(own, space.starts, space.freedom)
    sigma, correlation, freedom = fit.fit(space.observed)
    if not correlation.is_white:
        changes = _likely_changes(space, fit, own, correlation)
        if changes.size:
            fit = NoiseFit(np.vstack([own, changes]), space.starts, space.freedom)
            sigma, correlation, freedom = fit.fit(space.observed)
    found = Noise(sigma=max(sigma, _smallest(dataset)), correlation=correlation, freedom=freedom, from_repeats=True)
    return found if correlation.is_white else replace(found, likely=_likely(space, fit, found))


def _likely(space: RepeatSpace, fit: NoiseFit, noise: Noise) -> tuple[tuple[float, Noise], ...]:
    """Return what else the noise may be, with shares; nothing where the data leave little open."""
    kinds, shares = fit.likely(space.observed)
    if shares.max() > _DECIDED:
        return ()
    smallest = _smallest(space.dataset)
    found = []
    for c, share in zip(kinds, shares, strict=True):
        if share > _NEGLIGIBLE * shares.max():
            sigma, freedom = fit.deviation(space.observed, c)
            found.append((float(share), replace(noise, sigma=max(sigma, smallest), correlation=c, freedom=freedom)))
    whole = sum(share for share, _ in found)
    return tuple((share / whole, other) for share, other in found)


def _likely_changes(space: RepeatSpace, fit: NoiseFit, own: Floats, correlation: Correlation) -> Floats:
    """Return the changes in time that are much likelier than the correlation they feign, shape (columns, rows).

    Slow ones as generic courses, which leave open which effect it is; and one step.
    """
    observed, freedom = space.observed, space.freedom
    slow = space.of(changes_between_repeats(space.dataset, space)["time"])
    plain = float(fit.largest_likelihoods(observed[None, :])[0])
    with_slow = NoiseFit(np.vstack([own, slow]), space.starts, freedom)
    beside_slow = float(with_slow.largest_likelihoods(observed[None, :])[0])
    grid = list(dict.fromkeys((Correlation(), correlation, with_slow.fit(observed, refine=False)[1])))
    parameter = max(0.5 * float(np.log(freedom)), _LEAST)  # what one has to bring (BIC)
    taken = []
    if (
        beside_slow - plain > (slow.shape[0] + _SLOW_PARAMETERS) * parameter
        or _best_of(_effects_in_time(space), fit, own, space, grid)[0] - plain > _SLOW_PARAMETERS * parameter
    ):
        taken.append(slow)
    if space.dataset.conditions.time_s is not None:
        begun = np.vstack([own, *taken])
        before = beside_slow if taken else plain
        likelihood, step = _best_of(_steps(space), with_slow if taken else fit, begun, space, grid)
        if likelihood - before > _STEP_PARAMETERS * parameter:
            taken.append(step[None, :])
    return np.vstack(taken) if taken else np.empty((0, observed.size))


def _effects_in_time(space: RepeatSpace) -> Floats:
    """Return the columns of all effects in time but steps, over their scan grids, shape (columns, rows)."""
    dataset = space.dataset
    found = [np.empty((0, dataset.rows))]
    for effect in LIBRARY:
        smooth = effect.in_time and effect.observable is dataset.observable and effect.name != "lost_counts"
        if smooth and effect.untestable(dataset.conditions) is None:
            shapes = effect.shapes(dataset.conditions)
            every = -(-len(shapes) // _tried(dataset))
            found += [dataset.columns(effect, shape).T for shape in shapes[::every]]
    return space.of(np.vstack(found))


def _tried(dataset: Dataset) -> int:
    """Return how many moments or shapes are tried: of many readings fewer, so that their columns find room."""
    return max(_FEWEST_MOMENTS, min(_MOMENTS, _MOST_NUMBERS // dataset.rows))


def _steps(space: RepeatSpace) -> Floats:
    rows = space.dataset.rows
    moments = np.unique(np.linspace(1, rows - 1, _tried(space.dataset)).astype(np.int64))
    return space.of((np.arange(rows)[None, :] >= moments[:, None]).astype(np.float64))


def _best_of(
    columns: Floats, fit: NoiseFit, own: Floats, space: RepeatSpace, grid: Sequence[Correlation]
) -> tuple[float, Floats]:
    """Return the largest likelihood with one column more, and that column."""
    best = -np.inf, np.zeros(space.observed.size)
    for c in grid if columns.size else ():
        back = background(c.whitened(own, space.starts), c.whitened(space.observed, space.starts)[0])
        fall = gains(c.whitened(columns, space.starts)[:, None, :], back)
        column = columns[int(np.argmax(fall))]
        alone, rise = fit.likelihood_ratios(space.observed[None, :], column[None, :])
        value = float(alone[0] + rise[0])
        best = max(best, (value, column), key=lambda found: found[0])
    return best


def noise_from_residual(dataset: Dataset, residual: Floats, parameters: int) -> Noise:
    """Return the noise that a model's residual, shape (rows,), would be if the model lacked nothing."""
    starts = np.zeros(dataset.rows, dtype=np.bool_)
    starts[0] = True
    fit = NoiseFit(np.empty((0, dataset.rows)), starts, dataset.rows)
    sigma, correlation, freedom = fit.fit(residual)
    left = max(freedom - parameters, 1.0)
    return Noise(
        sigma=max(sigma * float(np.sqrt(freedom / left)), _smallest(dataset)),
        correlation=correlation,
        freedom=left,
        from_repeats=False,
    )


def _smallest(dataset: Dataset) -> float:
    """Return the noise below which readings that repeat exactly are not believed, in the observed unit inside.

    A recording rounded to its last digit, or an emulator without noise, repeats to the digit; what is a
    five-hundredth of the observed spread is then of no interest.
    """
    return _TRIFLE * float(np.std(dataset.observed)) + 1e-150  # its square is a number, too


def repeats_exactly(space: RepeatSpace) -> bool:
    """Return whether repeats differ by rounding only: their differences have no correlation, and nothing changes."""
    return float(np.sqrt(np.mean(space.observed**2))) <= _ROUNDING * _smallest(space.dataset)


def adjacent_sigma(dataset: Dataset) -> float | None:
    """Return the standard deviation from differences of each reading to the next repeat of the same cell.

    Where it lies clearly below the one from all repeats, something changes slowly in time (von Neumann's ratio).
    """
    member = np.flatnonzero(dataset.cell >= 0)
    order = member[np.lexsort((dataset.conditions.order[member], dataset.cell[member]))]
    same = dataset.cell[order[1:]] == dataset.cell[order[:-1]]
    if not same.any():
        return None
    steps = np.diff(dataset.observed[order])[same]
    return float(np.sqrt(0.5 * np.mean(steps**2)))


def pooled_sigma(dataset: Dataset, space: RepeatSpace) -> float:
    """Return the standard deviation of a reading about its cell, over all repeats."""
    return float(np.sqrt((space.observed @ space.observed) / space.observed.size))


def noise_floor(dataset: Dataset, noise: Noise) -> NoiseFloor:
    """Return the noise as people read it."""
    space = repeat_space(dataset)
    return NoiseFloor(
        from_repeats=noise.from_repeats,
        sigma=noise.sigma,
        correlation=noise.correlation.to_next,
        white_share=1.0 if noise.correlation.is_white else noise.correlation.white,
        degrees_of_freedom=noise.freedom,
        sigma_adjacent=adjacent_sigma(dataset),
        sigma_pooled=None if space is None else pooled_sigma(dataset, space),
    )


def noise_of(dataset: Dataset) -> NoiseFloor:
    """Return the noise of a measurement: from its repeats, or the spread of all readings where there are none."""
    noise = noise_from_repeats(dataset)
    if noise is None:
        noise = noise_from_residual(dataset, dataset.observed - dataset.observed.mean(), 1)
    return noise_floor(dataset, noise)
