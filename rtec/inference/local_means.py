"""Means of readings that stand near each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.effects import SAME, Floats

_DISTINCT = 60
_FEWEST_IN_GROUP = 4
_GROUPS = (5, 40)
_IN_GROUP = 10
_EVEN = 0.3
"""Share of the mean gap that the gaps between distinct values have at least, to be groups of their own."""
_Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Means:
    """Means of groups in the order of their places, with standard errors as if readings were independent.

    Each of shape (groups,); the error comes from the scatter within the group.
    """

    at: Floats
    mean: Floats
    error: Floats


def neighbour_means(x: Floats, y: Floats, *, each_place: bool = False) -> Means:
    """Return the mean of ``y`` at each distinct ``x``, or over groups of equal numbers of neighbours.

    Parameters
    ----------
    x, y
        Places and readings, shape (readings,).
    each_place
        Whether every distinct place is a group, however many there are; else they are where they are few, evenly
        spread and repeated.

    Examples
    --------
    >>> found = neighbour_means(np.array([1.0, 2.0] * 4), np.array([1.0, 5.0, 3.0, 5.0, 1.0, 5.0, 3.0, 5.0]))
    >>> found.at.tolist(), found.mean.tolist()
    ([1.0, 2.0], [2.0, 5.0])
    >>> found.error.round(2).tolist()
    [0.58, 0.0]
    """
    order = np.argsort(x, kind="stable")
    x, y = x[order], y[order]
    starts = np.flatnonzero(np.append(True, np.diff(x) > SAME * float(x[-1] - x[0])))
    if not each_place and not _are_groups(x, starts):
        groups = min(max(x.size // _IN_GROUP, _GROUPS[0]), _GROUPS[1], x.size)
        starts = np.unique(np.linspace(0, x.size, groups, endpoint=False).astype(np.int64))
    count = np.diff(np.append(starts, x.size))
    mean = np.add.reduceat(y, starts) / count
    scatter = np.add.reduceat((y - np.repeat(mean, count)) ** 2, starts) / np.maximum(count - 1, 1)
    return Means(at=np.add.reduceat(x, starts) / count, mean=mean, error=np.sqrt(scatter / count))


def _are_groups(x: Floats, starts: _Ints) -> bool:
    if starts.size > _DISTINCT or x.size < _FEWEST_IN_GROUP * starts.size:
        return False
    gaps = np.diff(x[starts])
    return bool(gaps.size == 0 or gaps.min() > _EVEN * gaps.mean())
