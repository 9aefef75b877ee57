"""The score test: what a candidate would explain of what the model leaves, without refitting the model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtec.effects import Floats

RANK = 1e-12
INDEPENDENT = 1e-9
"""A column counts where more than this share of its squared length is left beside the others."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Background:
    """The present model in whitened space: an orthonormal basis of its columns, and what it leaves.

    Parameters
    ----------
    basis
        Shape (rows, columns).
    residual
        Shape (rows,), orthogonal to the basis.
    """

    basis: Floats
    residual: Floats

    @property
    def rss(self) -> float:
        """Residual sum of squares."""
        return float(self.residual @ self.residual)

    def folded(self, runs: int) -> Background:
        """Return sums over equal runs: enough for columns that are the same in each run."""
        slots = self.residual.size // runs
        basis = self.basis.reshape(runs, slots, self.basis.shape[1]).sum(axis=0)
        return Background(basis=basis, residual=self.residual.reshape(runs, slots).sum(axis=0))


def orthonormal(columns: Floats, beside: Floats | None = None) -> Floats:
    """Return an orthonormal basis, shape (rows, rank), of what ``columns`` have beside another basis.

    Parameters
    ----------
    columns
        Shape (columns, rows).
    beside
        Orthonormal, shape (rows, any).
    """
    norm = np.sqrt((columns**2).sum(axis=1))
    scaled = (columns[norm > 0.0] / norm[norm > 0.0][:, None]).T
    if not scaled.size:
        return np.empty((columns.shape[1], 0))
    if beside is not None and beside.size:
        for _ in range(2):  # once more takes out what rounding left in
            scaled = scaled - beside @ (beside.T @ scaled)
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    good = values > INDEPENDENT
    basis: Floats = scaled @ (vectors[:, good] / np.sqrt(values[good]))
    if basis.shape[1] > 1:  # rounding is magnified where columns are nearly alike: once more makes them orthogonal
        values, vectors = np.linalg.eigh(basis.T @ basis)
        basis = basis @ (vectors / np.sqrt(values))
    return basis


def background(columns: Floats, observed: Floats) -> Background:
    """Return the background of a model with whitened ``columns``, shape (columns, rows)."""
    basis = orthonormal(columns)
    return Background(basis=basis, residual=observed - basis @ (basis.T @ observed))


def gains(
    candidates: Floats,
    back: Background,
    *,
    copies: int = 1,
    not_negative: bool = False,
    independent: float = INDEPENDENT,
) -> Floats:
    """Return by how much each candidate would lower the residual sum of squares.

    Parameters
    ----------
    candidates
        Whitened columns, shape (candidates, amplitudes, rows), one or two amplitudes each.
    back
        The model; folded where the candidates stand for ``copies`` equal runs.
    copies
        How many runs a row stands for.
    not_negative
        Whether amplitudes below zero do not count (one amplitude only).
    independent
        Share of its squared length that a column must have beside the others to count; a pair that has less explains
        nothing.

    Returns
    -------
    ndarray
        Shape (candidates,). Rao's score statistic times the variance of the noise.

    Notes
    -----
    With P the projection off the model's columns, r its residual and C the candidate's columns, the fall is
    ``b' G^-1 b`` with ``b = C' r`` and ``G = C' P C = C'C - (C'Q)(Q'C)``.
    """
    m, q, n = candidates.shape
    flat = candidates.reshape(m * q, n)
    b = (flat @ back.residual).reshape(m, q)
    shared = (flat @ back.basis).reshape(m, q, -1)
    own = copies * np.einsum("mqn,mqn->mq", candidates, candidates)
    left = own - np.einsum("mqk,mqk->mq", shared, shared)
    tiny = left <= independent * own
    alone = np.where(tiny, 0.0, b**2 / np.where(tiny, 1.0, left))
    if q == 1:
        fall: Floats = np.where(not_negative & (b[:, 0] < 0.0), 0.0, alone[:, 0])
        return fall
    cross = copies * np.einsum("mn,mn->m", candidates[:, 0], candidates[:, 1])
    cross -= np.einsum("mk,mk->m", shared[:, 0], shared[:, 1])
    determinant = left[:, 0] * left[:, 1] - cross**2
    single = tiny.any(axis=1) | (determinant <= independent * left[:, 0] * left[:, 1])
    both = left[:, 1] * b[:, 0] ** 2 - 2.0 * cross * b[:, 0] * b[:, 1] + left[:, 0] * b[:, 1] ** 2
    rest = np.zeros(m) if independent > INDEPENDENT else alone.max(axis=1)
    found: Floats = np.where(single, rest, both / np.where(single, 1.0, determinant))
    return found


def least_squares(columns: Floats, observed: Floats) -> Floats:
    """Return the coefficients of ``columns``, shape (columns, rows), that fit best; the shortest where many do.

    By normal equations of columns of length 1, whose cost is a tenth of a decomposition of the table itself. What is
    independent by less than 1e-6 of its length is no longer told apart, which is far below any noise.
    """
    length = np.sqrt((columns**2).sum(axis=1))
    length[length == 0.0] = 1.0
    gram = (columns @ columns.T) / np.outer(length, length)
    found: Floats = np.linalg.pinv(gram, rcond=RANK, hermitian=True) @ ((columns @ observed) / length) / length
    return found


def gain_of_block(columns: Floats, back: Background) -> tuple[float, int, float]:
    """Return the fall of the residual sum of squares by several columns, their rank, and their independence.

    The independence is the smallest share of its squared length that any combination of the columns, each of length
    1, has beside the model.

    Parameters
    ----------
    columns
        Whitened, shape (columns, rows).
    back
        The model.
    """
    length = np.sqrt((columns**2).sum(axis=1))
    length[length == 0.0] = 1.0
    b = (columns @ back.residual) / length
    shared = (columns @ back.basis) / length[:, None]
    gram = (columns @ columns.T) / np.outer(length, length) - shared @ shared.T
    values, vectors = np.linalg.eigh(gram)
    good = values > INDEPENDENT
    along = vectors[:, good].T @ b
    return float((along**2 / values[good]).sum()), int(good.sum()), float(values[0])
