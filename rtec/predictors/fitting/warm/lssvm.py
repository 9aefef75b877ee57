"""LS-SVM: one Cholesky factor solves it, and its inverse tells what every block would be predicted without itself."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
import numpy.typing as npt
from scipy.linalg.blas import dsyr2k, dsyrk
from scipy.linalg.lapack import dposv, dpotrf, dpotri, dpotrs, dpstrf, dtrtri
from threadpoolctl import threadpool_limits

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.fitting.warm.linear import SHARES, fit_ridge
from rtec.predictors.fitting.warm.rows import Rows, rms, rows_of
from rtec.predictors.warm.linear import Linear
from rtec.predictors.warm.lssvm import LsSvm
from rtec.predictors.warm.regressor import RegressorFit

WIDTHS = tuple(np.geomspace(0.5, 50.0, 10).tolist())
"""Widths that are tried, in units of the root of the number of columns: about the distance of two rows is 1.4."""
LINEAR = (0.0, 0.1, 1.0, 10.0)
"""Weights of a linear kernel beside the bells to try: the variance of a slope against that of a bell."""
GAMMAS = tuple(np.geomspace(1e-2, 1e5, 10).tolist())
"""Weights of the residuals that are tried."""
STRIP = 64
"""Columns of a kernel matrix that stay in the cache while they are worked on."""
LOST = 1e-6
"""What a kernel of low rank may lack on its diagonal, as a share of the smallest ``1 / gamma``; for choosing only."""
FEW = 0.5
"""Share of the rows below which the rank of a kernel counts as low."""


def train_ls_svm(columns: Floats, output: Floats, *, width: float, gamma: float, linear: float = 0.0) -> LsSvm:
    """Train with one width and one gamma; how sure the answer is stays unknown.

    Parameters
    ----------
    columns
        Shape (rows, features), scaled already: the kernel sees them as they are.
    output
        Shape (rows,).
    width, gamma, linear
        See `LsSvm`.

    Notes
    -----
    Equation 5 of Yao et al. 2013 by one Cholesky factor of ``K + I / gamma``: with its solutions s for the output
    and t for ones, ``b = sum(s) / sum(t)`` and ``alpha = s - b t``. The matrix takes ``8 rows ** 2`` bytes.

    Examples
    --------
    >>> x = np.linspace(-3.0, 3.0, 30)[:, None]
    >>> machine = train_ls_svm(x, np.sin(x[:, 0]), width=1.0, gamma=1e4)
    >>> machine.predict(np.array([[1.0]]))[0].round(3).tolist()
    [0.842]
    """
    centre = columns.mean(axis=0)  # distances lose digits far from zero
    points = columns - centre
    solved = _Solved.of(points, output, width, gamma, linear)
    return LsSvm(
        centre=centre,
        per_unit=np.ones(columns.shape[1]),
        width=width,
        gamma=gamma,
        points=points,
        alpha=solved.alpha,
        bias=solved.bias,
        slopes=linear * (solved.alpha @ points),
        linear=linear,
    )


def fit_ls_svm(
    columns: Floats,
    output: Floats,
    block: npt.ArrayLike,
    *,
    widths: Sequence[float] = WIDTHS,
    gammas: Sequence[float] = GAMMAS,
    linear: Sequence[float] = (0.0,),
) -> RegressorFit:
    """Fit an LS-SVM; its width, gamma and linear part are chosen by leaving out blocks.

    Parameters
    ----------
    columns
        Shape (rows, features); each is scaled to a standard deviation of 1. Time grows with the third power of the
        rows, memory with the second: `thin_by_blocks` before, where there are more than 2000.
    output
        Shape (rows,).
    block
        The block of each row, shape (rows,).
    widths
        That are tried, in units of the root of the number of columns that vary.
    gammas
        That are tried with each width.
    linear
        Weights of a linear kernel that are tried with each width, over the number of columns that vary; 0: none.

    Raises
    ------
    ArgumentError
        Shapes that do not fit, a value that is not finite, fewer than two blocks, constant columns only, or a width
        or gamma that is not above 0.

    Notes
    -----
    Without a block B its residuals are ``e_B = (P_BB)^-1 alpha_B``, with P the upper left part of the inverse of the
    whole system (Cawley and Talbot 2007 for one row; An, Liu and Venkatesh 2007 for blocks).

    Examples
    --------
    >>> x = np.linspace(-3.0, 3.0, 40)[:, None]
    >>> fit = fit_ls_svm(x, np.sin(x[:, 0]), np.arange(40) // 4)
    >>> bool(np.abs(fit.left_out).max() < 0.1)
    True
    """
    _check_grid(widths, gammas, linear)
    rows = rows_of(columns, output, block)
    used = np.count_nonzero(rows.per_unit)
    unit = float(np.sqrt(used))
    with threadpool_limits(1):  # of matrices as small as these; beside another program, two wait for each other
        tried = list(_tried(rows, [width * unit for width in widths], gammas, [weight / used for weight in linear]))
        width, gamma, weight, _ = min(tried, key=lambda one: one[3])
        solved = _Solved.of(rows.scaled, rows.output, width, gamma, weight)
        left_out, variances = solved.without_each(rows)
    machine = LsSvm(
        centre=rows.centre,
        per_unit=rows.per_unit,
        width=width,
        gamma=gamma,
        points=rows.scaled,
        alpha=solved.alpha,
        bias=solved.bias,
        slopes=weight * (solved.alpha @ rows.scaled),
        noise_sd=rms(left_out / np.sqrt(variances)),
        linear=weight,
    )
    edges = [
        name
        for name, value, values in (("width", width / unit, widths), ("gamma", gamma, gammas))
        if len(values) > 1 and not min(values) * 1.001 < value < max(values) / 1.001
    ]
    end = f" ({' and '.join(edges)} at an end of what was tried)" if edges else ""
    return RegressorFit(
        regressor=machine,
        left_out=left_out,
        notes=(*rows.notes, f"Width {width:.3g} of scaled columns, gamma {gamma:.3g}{_in_words(weight)}{end}."),
        tried=tuple(
            (f"width {width:.3g}, gamma {gamma:.3g}{_in_words(weight)}", figure)
            for width, gamma, weight, figure in tried
        ),
    )


def fit_ridge_and_ls_svm(
    columns: Floats,
    output: Floats,
    block: npt.ArrayLike,
    *,
    shares: Sequence[float] = SHARES,
    widths: Sequence[float] = WIDTHS,
    gammas: Sequence[float] = GAMMAS,
    linear: Sequence[float] = LINEAR,
) -> RegressorFit:
    """Fit a ridge regression and an LS-SVM, and answer with their mean.

    Parameters
    ----------
    columns, output, block, shares, widths, gammas, linear
        As `fit_ridge` and `fit_ls_svm` take them.

    Raises
    ------
    ArgumentError
        As both.

    Notes
    -----
    The two err in different directions, above all beyond the rows of the training. The standard deviation is that of
    the LS-SVM, scaled to the residuals of the mean.

    Examples
    --------
    >>> x = np.linspace(-3.0, 3.0, 40)[:, None]
    >>> fit = fit_ridge_and_ls_svm(x, 2.0 * x[:, 0], np.arange(40) // 4)
    >>> fit.regressor.predict(np.array([[2.5]]))[0].round(2).tolist()
    [5.0]
    """
    line = fit_ridge(columns, output, block, shares=shares)
    bells = fit_ls_svm(columns, output, block, widths=widths, gammas=gammas, linear=linear)
    straight, machine = cast(Linear, line.regressor), cast(LsSvm, bells.regressor)
    rows = rows_of(columns, output, block)
    left_out = (line.left_out + bells.left_out) / 2.0
    with threadpool_limits(1):
        solved = _Solved.of(rows.scaled, rows.output, machine.width, machine.gamma, machine.linear)
        _, variances = solved.without_each(rows)
    slopes = np.divide(straight.slopes, rows.per_unit, out=np.zeros(rows.centre.size), where=rows.per_unit > 0.0)
    mean = dataclasses.replace(
        machine,
        alpha=machine.alpha / 2.0,
        slopes=(machine.slopes + slopes) / 2.0,
        bias=(machine.bias + straight.intercept) / 2.0,
        noise_sd=rms(left_out / np.sqrt(variances)),
    )
    notes = dict.fromkeys((*line.notes, *bells.notes))
    return RegressorFit(regressor=mean, left_out=left_out, notes=tuple(notes), tried=(*line.tried, *bells.tried))


def _check_grid(widths: Sequence[float], gammas: Sequence[float], linear: Sequence[float]) -> None:
    for name, values in (("widths", widths), ("gammas", gammas)):
        if not len(values) or not all(0.0 < value < np.inf for value in values):
            raise ArgumentError(name, f"{tuple(values)}"[:60], "numbers above 0")
    if not len(linear) or not all(0.0 <= value < np.inf for value in linear):
        raise ArgumentError("linear", f"{tuple(linear)}"[:60], "numbers of 0 or more")


def _in_words(linear: float) -> str:
    return f", linear part {linear:.3g}" if linear else ""


def _tried(
    rows: Rows, widths: Sequence[float], gammas: Sequence[float], linear: Sequence[float]
) -> Iterator[tuple[float, float, float, float]]:
    """Yield each width, gamma and linear part with the root mean square of left-out residuals."""
    products = rows.scaled @ rows.scaled.T
    half = 0.5 * np.diagonal(products)
    exponent = np.minimum(products - half[:, None] - half, 0.0)
    for width in widths:
        bells = np.exp(exponent / width**2)
        for weight in linear:
            roots, sizes = _roots(bells + weight * products if weight else bells, LOST / max(gammas))
            for gamma in gammas:
                yield width, gamma, weight, rms(_errors(rows, roots, sizes, gamma))


def _roots(kernel: Floats, lost: float) -> tuple[Floats, Floats]:
    """Return W and d with ``kernel = W W'`` and ``W' W = diag(d)``: fewer columns than rows if the rank is low."""
    factor, pivots, rank, _ = dpstrf(kernel, lower=1, tol=lost)
    if rank < FEW * len(kernel):
        columns = np.empty((len(kernel), rank))
        columns[pivots - 1] = np.tril(factor[:, :rank])
        sizes, turns = np.linalg.eigh(columns.T @ columns)
        return columns @ turns, sizes
    sizes, turns = np.linalg.eigh(kernel)
    sizes = np.maximum(sizes, 0.0)
    return turns * np.sqrt(sizes), sizes


def _errors(rows: Rows, roots: Floats, sizes: Floats, gamma: float) -> Floats:
    """Return the residuals of left-out rows for one gamma of a kernel's roots."""
    weights = 1.0 / (sizes + 1.0 / gamma)
    shares = roots * np.sqrt(weights)

    def inverse(values: Floats) -> Floats:
        found: Floats = gamma * (values - shares @ (shares.T @ values))
        return found

    ones = inverse(np.ones(rows.output.size))
    alpha = inverse(rows.output - rows.output.mean())
    total = ones.sum()
    alpha -= ones * (alpha.sum() / total)
    found = np.empty(rows.output.size)
    for at in rows.blocks:
        part = shares[at]
        inner = -gamma * (part @ part.T) - np.outer(ones[at], ones[at] / total)
        inner[np.diag_indices(at.size)] += gamma
        found[at] = dposv(inner, alpha[at], lower=1, overwrite_a=1)[1]
    return found


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Solved:
    """The system of equation 5, solved."""

    factor: Floats
    """Lower Cholesky factor of ``K + I / gamma``; what stands above the diagonal means nothing."""
    ones: Floats
    """The solution for ones."""
    alpha: Floats
    bias: float

    @classmethod
    def of(cls, points: Floats, output: Floats, width: float, gamma: float, linear: float) -> _Solved:
        system = _lower_kernel(points, width)
        np.fill_diagonal(system, 1.0 + 1.0 / gamma)
        if linear:
            system = dsyrk(linear, points, beta=1.0, c=system, lower=1, overwrite_c=1)
        factor, failed = dpotrf(system, lower=1, clean=0, overwrite_a=1)
        if failed:
            hint = "rows are so alike that the system has no answer in double precision"
            raise ArgumentError("gamma", gamma, "a smaller one", hint, problem="is too large")
        level = float(output.mean())
        both, _ = dpotrs(factor, np.stack([output - level, np.ones(output.size)], axis=1), lower=1)
        shift = float(both[:, 0].sum() / both[:, 1].sum())
        return cls(factor=factor, ones=both[:, 1], alpha=both[:, 0] - shift * both[:, 1], bias=level + shift)

    def without_each(self, rows: Rows) -> tuple[Floats, Floats]:
        """Return left-out residuals and, in units of the prior variance, their variances, shape (rows,) each."""
        inverse = np.tril(dtrtri(self.factor, lower=1)[0])
        total = self.ones.sum()
        errors, variances = np.empty(rows.output.size), np.empty(rows.output.size)
        for at in rows.blocks:
            part = inverse[at[0] :, at]  # a lower triangle: nothing stands above the first row of the block
            inner = part.T @ part - np.outer(self.ones[at], self.ones[at] / total)
            factor, _ = dpotrf(inner, lower=1)
            errors[at] = dpotrs(factor, self.alpha[at], lower=1)[0]
            variances[at] = np.diagonal(dpotri(factor, lower=1)[0])
        return errors, variances


def _lower_kernel(points: Floats, width: float) -> Floats:
    """Return the kernel matrix of rows with themselves; only its lower triangle is filled."""
    scaled = points / width
    half = -0.5 * np.einsum("ij,ij->i", scaled, scaled)
    left = np.column_stack([0.5 * scaled, half])
    right = np.column_stack([scaled, np.ones(len(points))])
    found: Floats = dsyr2k(1.0, left, right, lower=1)
    for first in range(0, len(points), STRIP):
        strip = found[first:, first : first + STRIP]
        np.exp(strip, out=strip)
    return found
