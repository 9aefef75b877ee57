"""What the search computes, written out with dense matrices and numpy.linalg; and plans of readings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy import linalg, optimize, stats

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Observable, Units

SIGMA = 0.002
"""Noise of the plans, mm."""


def covariance(rho: float, white: float, gap: np.ndarray) -> np.ndarray:
    """Correlation matrix: rho to the distance within a chain, a white share on the diagonal, 0 between chains.

    ``gap`` is how far each reading lies behind the one before, infinite where a chain begins.
    """
    begins = np.isinf(gap)
    chain, place = np.cumsum(begins), np.cumsum(np.where(begins, 0.0, gap))
    lag = np.abs(place[:, None] - place[None, :])
    same = chain[:, None] == chain[None, :]
    return np.where(same, (1.0 - white) * rho**lag, 0.0) + white * np.eye(gap.size)


def one_chain(rows: int) -> np.ndarray:
    """Gaps of readings one after the other."""
    return np.append(np.inf, np.ones(rows - 1))


def whitened(columns: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Rows of columns through the inverse of the Cholesky factor, which has exactly the innovations."""
    return np.linalg.solve(np.linalg.cholesky(matrix), columns.T).T


def log_marginal(
    observed: np.ndarray, columns: np.ndarray, deviations: np.ndarray, matrix: np.ndarray, *, datum: bool
) -> float:
    """Log density of the readings under the best variance, by scipy's multivariate normal.

    Amplitudes are normal with ``deviations`` in units of the noise; columns of shape (columns, rows). With ``datum``
    the readings are known up to a constant: what is judged are their contrasts. Constants of the number of readings
    are taken off, as are those of the contrasts, so that it compares with a flat prior of the constant.
    """
    total = matrix + (columns * deviations[:, None] ** 2).T @ columns
    y = observed
    if datum:
        contrasts = linalg.null_space(np.ones((1, observed.size))).T
        y, total = contrasts @ observed, contrasts @ total @ contrasts.T

    def minus(log_variance: float) -> float:
        return -float(stats.multivariate_normal.logpdf(y, cov=np.exp(log_variance) * total))

    centre = float(np.log(y @ np.linalg.solve(total, y) / y.size))
    found = optimize.minimize_scalar(minus, bracket=(centre - 0.5, centre + 0.7), tol=1e-10)
    n = y.size
    constant = -0.5 * n * (np.log(2.0 * np.pi) + 1.0 - np.log(n))
    return -float(found.fun) - constant - (0.5 * np.log(observed.size) if datum else 0.0)


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


def left_out_residual(
    table: np.ndarray,
    raw: np.ndarray,
    observed: np.ndarray,
    seen: np.ndarray,
    fold: np.ndarray,
    precision: np.ndarray,
) -> np.ndarray:
    """Residual of each reading by a literal refit to the rows of all other folds, held towards zero by ``precision``.

    ``table`` and ``observed`` are whitened, ``raw`` and ``seen`` are not; tables of shape (rows, columns).
    """
    left = seen.copy()
    held = np.diag(np.sqrt(precision))
    for number in set(fold.tolist()):
        test = fold == number
        rows, wanted = np.vstack([table[~test], held]), np.append(observed[~test], np.zeros(precision.size))
        left[test] -= raw[test] @ np.linalg.lstsq(rows, wanted, rcond=None)[0]
    return left


def pure_error_test(columns: np.ndarray, observed: np.ndarray, cell: np.ndarray) -> tuple[float, int, float, int]:
    """Classical lack of fit of white data (Draper and Smith): squares and degrees of freedom, of misfit and noise."""
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
    rng = np.random.default_rng(1000 + seed)
    noise = rng.standard_normal(x.size)
    if rho:
        noise = coloured(rng, covariance(rho, white, one_chain(x.size)))
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
    )


def pushed(sign: float = 1.0, seconds: float = 10.0) -> Dataset:
    """The force of a drive with viscous and Coulomb friction, at 100 Hz; ``sign`` is that of its sensor."""
    rng, t = np.random.default_rng(0), np.arange(0.0, seconds, 0.01)
    x = 50.0 * np.sin(2 * np.pi * t / 2.0) + 20.0 * np.sin(2 * np.pi * t / 1.37)
    v = np.gradient(x, t)
    base = measured(runs=1, targets=t.size // 2)
    conditions = replace(
        base.conditions, position=x, velocity=v, acceleration=np.gradient(v, t), direction=np.sign(v), time_s=t,
        run=np.ones(t.size, dtype=np.int64), since_reversal=None, moving=True,
    )  # fmt: skip
    force = sign * (0.02 * v + 3.0 * np.sign(v)) + 0.3 * rng.normal(size=t.size)
    return replace(base, observable=Observable.DRIVE, observe="force", observed=force, conditions=conditions)
