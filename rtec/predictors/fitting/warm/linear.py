"""Least squares and ridge regression, judged by leaving out whole blocks without fitting again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.fitting.warm.rows import Places, Rows, rms, rows_of
from rtec.predictors.warm.linear import Linear
from rtec.predictors.warm.regressor import RegressorFit

SHARES = tuple(np.geomspace(1e-7, 1e3, 31).tolist())
"""Ridge parameters that are tried, for each row, on columns of standard deviation 1."""
COLLINEAR = 1e-9
"""Singular values below this share of the largest are rounding: the columns depend on each other."""
UNDETERMINED = 1e-10
"""Of what all rows say about a direction, the least share that the other blocks have to say, too."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LeftOut:
    """A penalised least-squares fit in an orthonormal basis, without each block in turn.

    Notes
    -----
    Of a linear smoother, ``e_B = (I - H_BB)^-1 r_B`` with ``H = Z (I + P)^-1 Z'`` (Cook and Weisberg 1982, section
    3.5, for one row). By Woodbury's identity that is ``y_B - Z_B c`` with ``(Z_R' Z_R + P) c = Z_R' y_R`` over the
    other rows R: a system of the size of the basis, however long the block.
    """

    basis: Floats
    """Z, shape (rows, size)."""
    output: Floats
    which: Places
    gram: Floats
    """Z_R' Z_R for each block, shape (blocks, size, size)."""
    right: Floats
    """Z_R' y_R for each block, shape (blocks, size)."""

    @classmethod
    def of(cls, basis: Floats, output: Floats, rows: Rows) -> LeftOut:
        """Sum over the other blocks; nothing is subtracted, so that no digits are lost."""
        gram = np.array([basis[at].T @ basis[at] for at in rows.blocks])
        right = np.array([basis[at].T @ output[at] for at in rows.blocks])
        return cls(basis=basis, output=output, which=rows.which, gram=_of_others(gram), right=_of_others(right))

    @property
    def undetermined(self) -> Places:
        """Blocks without which the others leave a direction open."""
        return np.flatnonzero(np.linalg.eigvalsh(self.gram)[:, 0] < UNDETERMINED)

    def errors(self, penalty: Floats) -> Floats:
        """Return the residuals of left-out rows, shape (rows,)."""
        found = np.linalg.solve(self.gram + np.diag(penalty), self.right[..., None])[..., 0]
        errors: Floats = self.output - np.einsum("ij,ij->i", self.basis, found[self.which])
        return errors

    def variances(self, penalty: Floats) -> Floats:
        """Return how much larger than the noise the variance of each left-out residual is, shape (rows,)."""
        inverse = np.linalg.inv(self.gram + np.diag(penalty))
        found: Floats = np.empty(self.output.size)
        for b, one in enumerate(inverse):
            rows = self.basis[self.which == b]
            found[self.which == b] = 1.0 + np.einsum("ij,jk,ik->i", rows, one, rows)
        return found


def _of_others(parts: Floats) -> Floats:
    """Return for each part the sum of all others."""
    found = np.zeros_like(parts)
    found[1:] += np.cumsum(parts[:-1], axis=0)
    found[:-1] += np.cumsum(parts[:0:-1], axis=0)[::-1]
    return found


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Directions:
    """The singular value decomposition of columns with a mean of zero, without what is rounding."""

    rows: Rows
    basis: Floats
    """A constant, then the left singular vectors."""
    sizes: Floats
    """Singular values, descending."""
    turns: Floats
    """Right singular vectors, shape (directions, features)."""

    @classmethod
    def of(cls, rows: Rows) -> Directions:
        """Decompose the scaled columns."""
        left, sizes, right = np.linalg.svd(rows.scaled, full_matrices=False)
        kept = sizes > COLLINEAR * sizes[0]
        constant = np.full((rows.output.size, 1), rows.output.size**-0.5)
        return cls(rows=rows, basis=np.hstack([constant, left[:, kept]]), sizes=sizes[kept], turns=right[kept])

    def penalty(self, ridge: float) -> Floats:
        """Return what a ridge parameter adds to the equations in the basis; the constant is not penalised."""
        return np.concatenate([[0.0], ridge / self.sizes**2])

    def slopes(self, ridge: float) -> Floats:
        """Return the slopes of scaled columns."""
        at = self.basis[:, 1:].T @ (self.rows.output - self.rows.output.mean())
        found: Floats = self.turns.T @ (at * self.sizes / (self.sizes**2 + ridge))
        return found

    def spread(self, ridge: float) -> Floats:
        """Return a root of the covariance of the slopes, for a noise of 1: shape (directions, features)."""
        found: Floats = self.turns / np.sqrt(self.sizes**2 + ridge)[:, None]
        return found

    def fitted(self, ridge: float, noise: float) -> Linear:
        """Return the linear function, in the units of the columns."""
        rows = self.rows
        return Linear(
            centre=rows.centre,
            intercept=float(rows.output.mean()),
            slopes=self.slopes(ridge) * rows.per_unit,
            noise_sd=noise * float(np.sqrt(1.0 + 1.0 / rows.output.size)),
            spread=noise * self.spread(ridge) * rows.per_unit,
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """What of the columns does not count."""
        lost = int(np.count_nonzero(self.rows.per_unit)) - self.sizes.size
        collinear = (
            f"The columns depend on each other in {lost} way{'s' * (lost > 1)}: the smallest slopes are taken."
        )
        return self.rows.notes + ((collinear,) if lost else ())


def fit_least_squares(columns: Floats, output: Floats, block: npt.ArrayLike) -> RegressorFit:
    """Fit a linear function by least squares.

    Parameters
    ----------
    columns
        Shape (rows, features). Constant columns are left out; where others depend on each other, the smallest slopes
        (of scaled columns) are taken.
    output
        Shape (rows,).
    block
        The block of each row, shape (rows,).

    Raises
    ------
    ArgumentError
        Shapes that do not fit, a value that is not finite, fewer than two blocks, or constant columns only.

    Notes
    -----
    The noise is such that left-out residuals, each divided by its standard deviation, have a mean square of 1.

    Examples
    --------
    >>> x = np.arange(6.0)
    >>> fit = fit_least_squares(x[:, None], 3.0 + 2.0 * x, [0, 0, 1, 1, 2, 2])
    >>> fit.regressor.predict(np.array([[10.0]]))[0].round(9).tolist()
    [23.0]
    """
    rows = rows_of(columns, output, block)
    found = Directions.of(rows)
    out = LeftOut.of(found.basis, rows.output, rows)
    open_blocks = out.undetermined
    errors, counted = _without(found, out, open_blocks)
    noise = rms(errors[counted] / np.sqrt(out.variances(_firm(found))[counted])) if counted.any() else rms(errors)
    notes = found.notes
    if open_blocks.size:
        what = "1 block alone" if open_blocks.size == 1 else f"{open_blocks.size} blocks, each alone,"
        notes += (f"{what} determined a slope: predicted without it, the smallest slopes are taken.".capitalize(),)
    return RegressorFit(regressor=found.fitted(0.0, noise), left_out=errors, notes=notes)


def _firm(found: Directions) -> Floats:
    """Return a penalty that is rounding, but with which every system has an answer."""
    return np.concatenate([[0.0], np.full(found.sizes.size, UNDETERMINED)])


def _without(found: Directions, out: LeftOut, open_blocks: Places) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Return left-out residuals, and which rows come from blocks that left no direction open."""
    rows = found.rows
    if not open_blocks.size:
        return out.errors(found.penalty(0.0)), np.ones(rows.output.size, dtype=np.bool_)
    errors = out.errors(_firm(found))
    for b in open_blocks:
        at, others = rows.which == b, rows.which != b
        middle, mean = rows.scaled[others].mean(axis=0), rows.output[others].mean()
        slopes = np.linalg.lstsq(rows.scaled[others] - middle, rows.output[others] - mean, rcond=COLLINEAR)[0]
        errors[at] = rows.output[at] - mean - (rows.scaled[at] - middle) @ slopes
    return errors, ~np.isin(rows.which, open_blocks)


def fit_ridge(
    columns: Floats,
    output: Floats,
    block: npt.ArrayLike,
    *,
    shares: Sequence[float] = SHARES,
    weights: npt.ArrayLike = 1.0,
) -> RegressorFit:
    """Fit a linear function with small slopes; how small is chosen by leaving out blocks.

    Parameters
    ----------
    columns
        Shape (rows, features); each is scaled to a standard deviation of 1, or of its weight.
    output
        Shape (rows,).
    block
        The block of each row, shape (rows,).
    weights
        Above 0, of each column: one with twice the weight may have twice the slope for the same penalty.
    shares
        Ridge parameters for each row: the sum of squares that is minimised is ``sum(e ** 2) + share * rows *
        sum(slopes ** 2)``. The intercept is not penalised.

    Raises
    ------
    ArgumentError
        As `fit_least_squares`, or a share that is not above 0.

    References
    ----------
    Golub, Heath and Wahba 1979: ridge parameters by one singular value decomposition.

    Examples
    --------
    >>> x = np.linspace(0.0, 1.0, 8)
    >>> fit = fit_ridge(np.stack([x, x], axis=1), 2.0 * x, np.arange(8) // 2)
    >>> fit.regressor.slopes.round(3).tolist()
    [1.0, 1.0]
    """
    if not len(shares) or not all(0.0 < share < np.inf for share in shares):
        raise ArgumentError("shares", f"{tuple(shares)}"[:60], "ridge parameters above 0")
    rows = rows_of(columns, output, block, weights)
    found = Directions.of(rows)
    out = LeftOut.of(found.basis, rows.output, rows)
    penalties = [found.penalty(share * rows.output.size) for share in shares]
    figures = [rms(out.errors(penalty)) for penalty in penalties]
    best = int(np.argmin(figures))
    errors = out.errors(penalties[best])
    noise = rms(errors / np.sqrt(out.variances(penalties[best])))
    weight = float(np.sum(1.0 / (1.0 + penalties[best])))
    edge = " (an end of what was tried)" if best in (0, len(shares) - 1) and len(shares) > 1 else ""
    note = f"Ridge parameter {shares[best]:.3g} for each row{edge}: as many as {weight:.1f} free parameters."
    return RegressorFit(
        regressor=found.fitted(shares[best] * rows.output.size, noise),
        left_out=errors,
        notes=(*rows.notes, note),
        tried=tuple((f"ridge {share:.3g}", figure) for share, figure in zip(shares, figures, strict=True)),
    )
