"""How likely the readings are under a model, its amplitudes averaged over what they may be."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rtec.effects import Floats

SCALES = 10.0 ** (np.arange(-2, 11) / 2.0)
"""Standard deviations of an effect's contribution before the data have spoken, in units of the noise."""
_UNKNOWN = np.full(SCALES.size, np.nan)


@dataclass(frozen=True, slots=True, eq=False)
class Sums:
    """Sums of products over the whitened readings, the constant taken out.

    They are those of the columns and, last, the readings with each other, shape (columns + 1, columns + 1), beside
    the number of readings less the constant.
    """

    products: Floats
    readings: int
    turned: slice = field(default_factory=lambda: slice(0))
    """Columns that are the principal ones of a part, none of which has a product with another of them."""
    turn: Floats | None = None
    """Those of the part in terms of them, shape (columns, turned)."""


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
    turned = sums.turn is not None
    first, order, rest = _layout(block.tobytes(), int(block[sums.turned.start]) if turned else -1)
    room = np.empty((2, places.size), np.int64), np.empty_like(sums.products), order, first, rest, turned
    reduced = np.empty((SCALES.size, rest.size + 1, rest.size + 1))
    run = shift if together else climb
    return places, run(sums.products, sums.readings, block, SCALES, places, *room, reduced, _UNKNOWN.copy())


@lru_cache(maxsize=1024)
def _layout(block: bytes, first: int) -> tuple[int, NDArray[np.int64], NDArray[np.int64]]:
    """Return the first block, the columns in the order of `climb`, and the blocks of the rest.

    The largest block, unless one is given: it is averaged over once for each of its places.
    """
    blocks = np.frombuffer(block, np.int64)
    first = int(np.argmax(np.bincount(blocks))) if first < 0 else first
    rest = np.flatnonzero(blocks != first)
    return first, np.concatenate([np.flatnonzero(blocks == first), rest, [blocks.size]]), blocks[rest]


def posterior(sums: Sums, deviations: Floats) -> tuple[Floats, float]:
    """Return the posterior mean of the amplitudes, shape (columns,), and the variance of the noise."""
    gram, along, total = sums.products[:-1, :-1], sums.products[:-1, -1], float(sums.products[-1, -1])
    inner, wanted = deviations[:, None] * gram * deviations, deviations * along
    inner.flat[:: deviations.size + 1] += 1.0
    if sums.turn is None:
        mean = deviations * np.linalg.solve(inner, wanted)
    else:
        own, rest = sums.turned, np.delete(np.arange(deviations.size), sums.turned)
        mixed, pivots = inner[own, rest], np.diag(inner)[own]
        less = (mixed / pivots[:, None]).T
        mean = wanted
        mean[rest] = np.linalg.solve(inner[np.ix_(rest, rest)] - less @ mixed, wanted[rest] - less @ wanted[own])
        mean[own] = (wanted[own] - mixed @ mean[rest]) / pivots
        mean = deviations * mean
    left = max(total - float(mean @ along), 1e-12 * total + 1e-300)
    if sums.turn is not None:
        mean[sums.turned] = sums.turn @ mean[sums.turned]
    return mean, left / max(sums.readings, 1)
