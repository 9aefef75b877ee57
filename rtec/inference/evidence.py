"""How likely the readings are under a model, its amplitudes averaged over what they may be."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.effects import Floats

SCALES = 10.0 ** (np.arange(-2, 11) / 2.0)
"""Standard deviations of an effect's contribution before the data have spoken, in units of the noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Sums:
    """Sums of products over the whitened readings, the constant taken out.

    They are those of the columns and, last, the readings with each other, shape (columns + 1, columns + 1), beside
    the number of readings less the constant.
    """

    products: Floats
    readings: int


def best_scales(
    sums: Sums, block: NDArray[np.int64], start: NDArray[np.int64], *, together: bool = False
) -> tuple[NDArray[np.int64], float]:
    """Return the place of each block on the ladder of scales that makes the readings most likely, and how likely.

    Parameters
    ----------
    block
        Number of the block that each column belongs to, shape (columns,).
    start
        Places to begin from, shape (blocks,).
    together
        Whether all blocks keep their proportions and move by one place at most: under the next colour of the grid the
        noise has up to ten times the variance, and contributions of the same size stand one place lower.

    Notes
    -----
    For readings ``y = A b + e`` with ``b ~ N(0, s^2 D^2)`` and ``e ~ N(0, s^2)``, the variance ``s^2`` profiled:
    ``-n/2 log(y'y - z'z) - sum log diag L`` with ``L L' = 1 + D A'A D`` and ``z = L^-1 D A'y`` (O'Hagan and Forster,
    Bayesian Inference, 2004, chapter 11). The determinant of the noise's covariance comes on top.

    Examples
    --------
    >>> sums = Sums(products=np.array([[100.0, 50.0], [50.0, 125.0]]), readings=100)
    >>> places, value = best_scales(sums, np.array([0]), np.array([4]))
    >>> SCALES[places].round(2).tolist(), round(float(value + 50.0 * np.log(125.0)), 2)
    ([0.32], 8.83)
    """
    from rtec.inference._evidence_kernels import climb, shift  # noqa: PLC0415 - loads numba, for searches only

    places = start.copy()
    if not places.size:
        return places, -0.5 * sums.readings * math.log(max(float(sums.products[-1, -1]), 1e-300))
    given = sums.products, sums.readings, block, SCALES, places, np.empty((2, places.size), np.int64)
    upper = np.empty_like(sums.products)
    if together:
        return places, shift(*given, upper)
    first = int(np.argmax(np.bincount(block)))  # the largest block is averaged over once for each of its places
    others = np.flatnonzero(block != first)
    order = np.concatenate([np.flatnonzero(block == first), others, [block.size]])
    reduced = np.empty((SCALES.size, others.size + 1, others.size + 1))
    return places, climb(*given, upper, order, first, block[others], reduced, np.full(SCALES.size, np.nan))


def posterior(sums: Sums, deviations: Floats) -> tuple[Floats, float]:
    """Return the posterior mean of the amplitudes, shape (columns,), and the variance of the noise."""
    gram, along, total = sums.products[:-1, :-1], sums.products[:-1, -1], float(sums.products[-1, -1])
    used = deviations > 0.0
    mean = np.zeros(deviations.size)
    if used.any():
        d = deviations[used]
        inner = np.eye(d.size) + d[:, None] * gram[np.ix_(used, used)] * d
        mean[used] = (np.linalg.inv(inner) * np.outer(d, d)) @ along[used]
    left = max(total - float(mean @ along), 1e-12 * total + 1e-300)
    return mean, left / max(sums.readings, 1)
