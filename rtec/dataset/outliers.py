"""Readings that belong to nothing, or to neither direction: found before the search and after it, and left out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.dataset.repeats import medians_of_cells, members_of
from rtec.dataset.standstill import stretches_where
from rtec.effects import Floats, Observable

FAR = 8.0
"""Robust standard deviations from its neighbours, or from what the model says: no noise goes so far."""
MOST, MOST_REPEATED = 0.02, 0.1
"""Share of the readings, at most, and of those that others of the same conditions contradict: more of them are heavy
tails, and these belong to the noise."""
MOST_IN_A_ROW = 3  # readings, of which a sensor drops so many at most
ENOUGH = 50  # readings of a kind with a spread of its own: that of a few may be near zero by chance
MOST_TURNS = 0.1  # share of the readings at which an axis turns round, at most: more is noise
_TO_SIGMA = 1.4826  # standard deviation of normal noise over its median absolute deviation


def at_turns(dataset: Dataset) -> NDArray[np.bool_]:
    """Return which readings of a position in motion are the first after a reversal; shape (rows,).

    The velocity, from which the direction is known, is a reading early or late there, and play is not yet taken up:
    on which side the axis is, is in doubt.
    """
    since = dataset.conditions.since_reversal
    if not dataset.conditions.moving or since is None or dataset.observable is not Observable.DEVIATION:
        return np.zeros(dataset.rows, dtype=np.bool_)
    found: NDArray[np.bool_] = since == 0.0
    return found if found.sum() <= MOST_TURNS * dataset.rows else np.zeros_like(found)


def far_from_neighbours(dataset: Dataset) -> NDArray[np.bool_]:
    """Return which readings lie far from those of the same conditions, or from those before and after; shape (rows,).

    Readings that repeat are compared with the median of their cell where that holds three readings at least, all
    others with the median of the two before and the two after, and with the other of a pair; each kind against its
    own spread where it is large enough to have one, since neighbours differ by more than noise. A step is no outlier:
    on one side its neighbours are like it; nor is what comes back in the next run.
    """
    y = dataset.observed
    away = np.zeros(dataset.rows)
    if dataset.rows >= 5:
        windows = np.lib.stride_tricks.sliding_window_view(np.pad(y, 2, mode="reflect"), 5)
        away = y - np.median(np.delete(windows, 2, axis=1), axis=1)
        # a lone reading is far from both sides; at a bend, or beside an outlier, it is far from one
        before, after = np.abs(y - np.roll(y, 1)), np.abs(y - np.roll(y, -1))
        away = np.sign(away) * np.minimum(np.abs(away), np.minimum(before, after))
    repeated = np.zeros(dataset.rows, dtype=np.bool_)
    if not dataset.conditions.moving:
        middle = medians_of_cells(y, dataset.cell, 3)
        repeated = np.isfinite(middle)
        away[repeated] = (y - middle)[repeated]
        for rows in members_of(dataset.cell):
            if rows.size == 2:
                apart = y[rows] - y[rows[::-1]]
                away[rows] = np.sign(away[rows]) * np.minimum(np.abs(away[rows]), np.abs(apart))
    most = MOST_REPEATED if dataset.has_repeats and not dataset.conditions.moving else MOST
    if min(repeated.sum(), (~repeated).sum()) < ENOUGH:
        return _alone(far(away, most))
    found = np.zeros(dataset.rows, dtype=np.bool_)
    for kind in (repeated, ~repeated):
        found[kind] = far(away[kind], most)
    return _alone(found)


def _alone(found: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return those found of which no more than three follow each other: more are a step, or a run that differs."""
    alone = found.copy()
    for begin, end in stretches_where(found):
        if end - begin > MOST_IN_A_ROW:
            alone[begin:end] = False
    return alone


def far(away: Floats, most: float = MOST) -> NDArray[np.bool_]:
    """Return which deviations are far beyond the others, at most this share of them; shape (rows,)."""
    scale = robust_scale(away[away != 0.0]) if away.any() else 0.0  # the middle reading of a cell is its own median
    if scale <= 0.0:
        scale = float(np.std(away))
    if scale <= 0.0:
        return np.zeros(away.size, dtype=np.bool_)
    found: NDArray[np.bool_] = np.abs(away) > FAR * scale
    return found if found.sum() <= max(1.0, most * away.size) else np.zeros(away.size, dtype=np.bool_)


def robust_scale(away: Floats) -> float:
    """Return the standard deviation of normal noise with the median absolute deviation of these numbers."""
    return _TO_SIGMA * float(np.median(np.abs(away - np.median(away))))
