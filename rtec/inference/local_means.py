"""Means of readings that stand near each other."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.effects import SAME, Floats
from rtec.inference.colour import Colour, gaps_of
from rtec.inference.results import NoiseFloor

_DISTINCT = 60
_FEWEST_IN_GROUP = 4
_GROUPS = (5, 40)
_IN_GROUP = 10
_EVEN = 0.3
"""Share of the mean gap that the gaps between distinct values have at least, to be groups of their own."""
_ANEW = 1e6
"""Readings between two chains of noise: nothing of the one is left in the other."""
_Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sequence:
    """The place of each reading in the order in which they were taken, and the colour of their noise along it."""

    at: Floats
    colour: Colour

    def take(self, rows: _Ints | NDArray[np.bool_]) -> Sequence:
        """Return some of the readings."""
        return Sequence(at=self.at[rows], colour=self.colour)


def sequence_of(dataset: Dataset, noise: NoiseFloor) -> Sequence:
    """Return the readings of a data set in sequence, their noise correlated as a fit has found it."""
    gap = gaps_of(dataset)
    at = np.cumsum(np.where(np.isinf(gap), _ANEW, gap))
    return Sequence(at=at, colour=Colour(noise.correlation, noise.white_share))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Means:
    """Means of groups in the order of their places, with standard errors from the scatter within each group.

    Each of shape (groups,).
    """

    at: Floats
    mean: Floats
    error: Floats


def neighbour_means(x: Floats, y: Floats, *, each_place: bool = False, sequence: Sequence | None = None) -> Means:
    """Return the mean of ``y`` at each distinct ``x``, or over groups of equal numbers of neighbours.

    Parameters
    ----------
    x, y
        Places and readings, shape (readings,).
    each_place
        Whether every distinct place is a group, however many there are; else they are where they are few, evenly
        spread and repeated.
    sequence
        Of the readings, for the standard errors; None: they are independent.

    Notes
    -----
    Of ``m`` readings of variance ``s^2`` whose correlations with each other and themselves sum up to ``R``, the mean
    has the variance ``s^2 R / m^2``, and their scatter about it is ``s^2 (m - R / m) / (m - 1)`` on average.

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
    squares = np.add.reduceat((y - np.repeat(mean, count)) ** 2, starts)
    together = np.ones(count.size) if sequence is None else _correlations(sequence.take(order), starts) / count
    free = np.where(count > 1, count - together, 1.0)
    return Means(at=np.add.reduceat(x, starts) / count, mean=mean, error=np.sqrt(squares * together / free / count))


def _correlations(sequence: Sequence, starts: _Ints) -> Floats:
    """Return the sum of the correlations of all pairs in each group, pairs with oneself included, shape (groups,)."""
    count = np.diff(np.append(starts, sequence.at.size))
    at = sequence.at[np.lexsort((sequence.at, np.repeat(np.arange(starts.size), count)))]
    step = sequence.colour.rho ** np.abs(np.diff(at, prepend=at[0]))
    step[starts] = 0.0
    # what each reading has in common with all before it in its group, from what the one before has
    earlier = np.array([*accumulate(step.tolist(), lambda before, one: one * (before + 1.0))])
    return count + 2.0 * (1.0 - sequence.colour.white) * np.add.reduceat(earlier, starts)


def _are_groups(x: Floats, starts: _Ints) -> bool:
    if starts.size > _DISTINCT or x.size < _FEWEST_IN_GROUP * starts.size:
        return False
    gaps = np.diff(x[starts])
    return bool(gaps.size == 0 or gaps.min() > _EVEN * gaps.mean())
