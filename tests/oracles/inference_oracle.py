"""What the search computes, written out with dense matrices and numpy.linalg; and plans of readings."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Observable, Units

SIGMA = 0.002
"""Noise of the plans, mm."""


def covariance(rho: float, white: float, starts: np.ndarray) -> np.ndarray:
    """Correlation matrix: Toeplitz rho^|i-j| within a segment, a white share on the diagonal, 0 between segments."""
    n = starts.size
    segment = np.cumsum(starts)
    lag = np.abs(np.arange(n)[:, None] - np.arange(n)[None, :])
    same = segment[:, None] == segment[None, :]
    return np.where(same, (1.0 - white) * rho**lag, 0.0) + white * np.eye(n)


def whitened(columns: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Rows of columns through the inverse of the Cholesky factor, which has exactly the innovations."""
    return np.linalg.solve(np.linalg.cholesky(matrix), columns.T).T


def restricted_likelihood(observed: np.ndarray, nuisance: np.ndarray, matrix: np.ndarray) -> tuple[float, float]:
    """REML with the variance profiled out (Patterson and Thompson), up to a constant; and that variance.

    ``nuisance`` has shape (columns, rows); its columns are scaled to length 1, which fixes the constant.
    """
    inverse = np.linalg.inv(matrix)
    x = (nuisance / np.linalg.norm(nuisance, axis=1)[:, None]).T
    n, p = observed.size, x.shape[1]
    information = x.T @ inverse @ x
    fitted = np.linalg.solve(information, x.T @ inverse @ observed) if p else np.empty(0)
    left = observed - x @ fitted
    rss = float(left @ inverse @ left)
    _, det = np.linalg.slogdet(matrix)
    _, det_x = np.linalg.slogdet(information) if p else (1.0, 0.0)
    return -0.5 * ((n - p) * np.log(rss / (n - p)) + det + det_x), rss / (n - p)


def rss(columns: np.ndarray, observed: np.ndarray) -> float:
    """Residual sum of squares of a full least-squares fit; columns of shape (columns, rows)."""
    if not columns.size:
        return float(observed @ observed)
    numbers, *_ = np.linalg.lstsq(columns.T, observed, rcond=None)
    left = observed - numbers @ columns
    return float(left @ left)


def fall(model: np.ndarray, more: np.ndarray, observed: np.ndarray) -> float:
    """By how much ``more`` columns lower the residual sum of squares: two full fits."""
    return rss(model, observed) - rss(np.vstack([model, more]), observed)


def left_out_residual(table: np.ndarray, observed: np.ndarray, fold: np.ndarray) -> np.ndarray:
    """Residual of each reading by a literal refit to all other folds; table of shape (rows, columns)."""
    left = observed.copy()
    for number in set(fold.tolist()):
        test = fold == number
        numbers, *_ = np.linalg.lstsq(table[~test], observed[~test], rcond=None)
        left[test] -= table[test] @ numbers
    return left


def pure_error_test(columns: np.ndarray, observed: np.ndarray, cell: np.ndarray) -> tuple[float, int, float, int]:
    """Classical lack of fit of white data (Draper and Smith): squares and freedom of misfit, then of noise."""
    numbers = sorted(set(cell.tolist()))
    pure = sum(float(((observed[cell == k] - observed[cell == k].mean()) ** 2).sum()) for k in numbers)
    lack = rss(columns, observed) - pure
    return lack, len(numbers) - np.linalg.matrix_rank(columns), pure, observed.size - len(numbers)


def coloured(rng: np.random.Generator, matrix: np.ndarray) -> np.ndarray:
    """One draw of noise with a covariance."""
    return np.linalg.cholesky(matrix) @ rng.standard_normal(matrix.shape[0])


def places(targets: int, length: float = 300.0, seed: int = 0) -> np.ndarray:
    """Targets that are not commensurate with any period, mm."""
    step = length / targets
    return np.linspace(0.0, length, targets) + np.random.default_rng(seed).uniform(-0.3, 0.3, targets) * step


def travelled(x: np.ndarray, way: np.ndarray, run: np.ndarray) -> np.ndarray:
    """Distance since the last reversal, reading by reading."""
    gone, begin = np.zeros(x.size), 0
    for i in range(x.size):
        if i == 0 or way[i] != way[i - 1] or run[i] != run[i - 1]:
            begin = i
        gone[i] = abs(x[i] - x[begin])
    return gone


Error = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def nothing(x: np.ndarray, way: np.ndarray, t: np.ndarray, run: np.ndarray) -> np.ndarray:
    """No error at all."""
    return np.zeros(x.size)


def measured(
    error: Error = nothing,
    *,
    runs: int = 5,
    targets: int = 21,
    length: float = 300.0,
    at: np.ndarray | None = None,
    bidirectional: bool = True,
    seed: int = 0,
    sigma: float = SIGMA,
    rho: float = 0.0,
    white: float = 0.0,
    timed: bool = True,
    unit: str = "mm",
    **conditions: object,
) -> Dataset:
    """Equal runs over targets, forth and back: ``error(x, way, t, run)`` in mm and noise, a reading every 10 s."""
    up = places(targets, length, seed) if at is None else at
    once = np.concatenate([up, up[::-1]]) if bidirectional else up
    x = np.tile(once, runs)
    way = np.tile(np.repeat([1.0, -1.0], up.size) if bidirectional else np.ones(up.size), runs)
    run = np.repeat(np.arange(1, runs + 1), once.size)
    t = 10.0 * np.arange(x.size)
    starts = np.arange(x.size) % once.size == 0
    rng = np.random.default_rng(1000 + seed)
    noise = rng.standard_normal(x.size)
    if rho:
        noise = coloured(rng, covariance(rho, white, starts))
    parts = np.array_split(np.arange(x.size), 5)
    block = run - 1 if runs > 1 else np.repeat(np.arange(5), [part.size for part in parts])
    return Dataset(
        source="plan.csv",
        observe="deviation",
        observable=Observable.DEVIATION,
        units=Units(unit, unit, "s" if timed else "reading"),
        observed=error(x, way, t, run) + sigma * noise,
        conditions=Conditions(
            position=x,
            position_unit=unit,
            run=run,
            direction=way,
            time_s=t if timed else None,
            since_reversal=travelled(x, way, run),
            **conditions,
        ),
        cell=np.tile(np.arange(once.size), runs) if runs > 1 else np.full(x.size, -1),
        block=block,
        held_out_by="run" if runs > 1 else "stretch",
    )
