"""Columns chosen one after the other by how well they foretell blocks that were left out."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from rtec.dataset.standstill import Ints
from rtec.effects import Floats

LEAST_FALL = 0.05
"""Share by which a column has to lower the RMS error: a sensor for less is not worth its cable."""
RIDGE = 1e-9
"""Of the mean diagonal, on that of the normal equations: columns that are the same in all other blocks do no harm."""


def chosen_by_blocks(
    fixed: Floats,
    columns: Floats,
    observed: Floats,
    fold: Ints,
    most: int,
    allowed: Callable[[Sequence[int], int], bool] = lambda chosen, new: True,
) -> list[int]:
    """Return which columns lower the error of blocks left out, best first.

    The last of them lowers it by a twentieth, with those before it that may only help together.

    Parameters
    ----------
    fixed
        Columns of every fit, shape (fixed, rows).
    columns
        From which is chosen, shape (columns, rows).
    observed, fold
        What is explained, and with which fold each row is left out, shape (rows,).
    most
        Columns to choose at most.
    allowed
        Whether a column may stand beside those chosen.

    Notes
    -----
    Least squares by normal equations, whose sums over the rows of a fold are taken off those of all rows.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> x, fold = rng.normal(size=(5, 60)), np.repeat(np.arange(6), 10)
    >>> chosen_by_blocks(np.ones((1, 60)), x, 3.0 * x[1] - x[4] + 0.01 * rng.normal(size=60), fold, most=2)
    [1, 4]
    """
    size = np.sqrt(np.maximum((columns**2).mean(axis=1, keepdims=True), 1e-300))
    table = np.vstack([fixed, columns / size, observed])
    sums = np.array([table[:, fold == number] @ table[:, fold == number].T for number in np.unique(fold)])
    begin, best = list(range(len(fixed))), _error(sums, np.arange(len(fixed))[None])[0]
    chosen: list[int] = []
    kept = 0
    while len(chosen) < most:
        free = [k for k in range(len(columns)) if k not in chosen and allowed(chosen, k)]
        if not free:
            break
        trials = np.array([[*begin, *(len(fixed) + c for c in (*chosen, k))] for k in free])
        errors = _error(sums, trials)
        at = int(np.argmin(errors))
        chosen.append(free[at])
        if errors[at] < (1.0 - LEAST_FALL) ** 2 * best:
            best, kept = errors[at], len(chosen)
    return chosen[:kept]


def _error(sums: Floats, trials: Ints) -> Floats:
    """Return the squared error of all folds, shape (trials,), of columns by number, shape (trials, columns)."""
    inside = sums[:, trials[:, :, None], trials[:, None, :]]
    along = sums[:, trials, -1]
    others, towards = inside.sum(axis=0) - inside, along.sum(axis=0) - along
    ridge = RIDGE * np.trace(others, axis1=2, axis2=3)[:, :, None, None] * np.eye(trials.shape[1])
    numbers = np.linalg.solve(others + ridge, towards[..., None])[..., 0]
    left = sums[:, -1, -1][:, None] - 2.0 * (numbers * along).sum(axis=-1)
    found: Floats = (left + (numbers[..., None, :] @ inside @ numbers[..., None])[..., 0, 0]).sum(axis=0)
    return found
