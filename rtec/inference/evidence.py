"""How likely the readings are under a model, its amplitudes averaged over what they may be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.effects import Floats

SCALES = 10.0 ** (np.arange(-2, 11) / 2.0)
"""Standard deviations of an effect's contribution before the data have spoken, in units of the noise."""
ABSENT = -1
"""Place on the ladder of a part that may as well be missing."""
ENTRANCES = (1, 4, 7, 10)
"""Places on the ladder at which what is absent is tried: every other one is next to them."""
RARE = 4.0
"""Nats that a part costs which may as well be missing: zeros of runs are rarer than a drift, which explains as much
where a map by direction goes with it."""
SHIFTS = 2
"""Steps of the ladder, up and down: of the noise's variance, at the next colour of the grid, a factor of a hundred."""
_ROUNDS = 12
_ROUNDING = 1e-10
"""Share of the readings' square that may be lost: a model that explains everything leaves that."""


@dataclass(frozen=True, slots=True, eq=False)
class Sums:
    """Sums of products over the whitened readings, the constant taken out.

    Parameters
    ----------
    gram
        Of the columns with each other, shape (columns, columns).
    along
        Of the columns with the readings, shape (columns,).
    total
        Of the readings with themselves.
    readings
        Number of readings less the constant.
    """

    gram: Floats
    along: Floats
    total: float
    readings: int


def log_likelihoods(sums: Sums, deviations: Floats) -> Floats:
    """Return the log marginal likelihood for each set of prior deviations, shape (sets,).

    Parameters
    ----------
    sums
        Of the model.
    deviations
        Prior standard deviation of each amplitude in units of the noise, shape (sets, columns); 0 leaves it out.

    Notes
    -----
    For readings ``y = A b + e`` with ``b ~ N(0, s^2 D^2)`` and ``e ~ N(0, s^2)``, the variance ``s^2`` profiled:
    ``-n/2 log(y'y - z'z) - sum log diag L`` with ``L L' = 1 + D A'A D`` and ``z = L^-1 D A'y`` (O'Hagan and Forster,
    Bayesian Inference, 2004, chapter 11). The determinant of the noise's covariance comes on top.

    Examples
    --------
    >>> sums = Sums(gram=np.array([[100.0]]), along=np.array([50.0]), total=125.0, readings=100)
    >>> worth = log_likelihoods(sums, np.array([[0.0], [1.0]]))
    >>> round(float(worth[1] - worth[0]), 2)
    8.73
    """
    count = sums.along.size
    inner = np.empty((len(deviations), count + 1, count + 1))
    inner[:, :count, :count] = deviations[:, :, None] * sums.gram * deviations[:, None, :]
    inner[:, np.arange(count), np.arange(count)] += 1.0
    inner[:, count, :count] = inner[:, :count, count] = deviations * sums.along
    inner[:, count, count] = sums.total * (1.0 + _ROUNDING) + 1e-300
    # the last pivot squared is what the model leaves: one factorisation gives it and the determinant
    pivots = np.log(np.diagonal(np.linalg.cholesky(inner), axis1=1, axis2=2))
    found: Floats = -sums.readings * pivots[:, -1] - pivots[:, :-1].sum(axis=1)
    return found


def best_scales(
    sums: Sums, block: NDArray[np.int64], start: NDArray[np.int64], optional: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], float]:
    """Return the place of each block on the ladder of scales that makes the readings most likely, and how likely.

    Parameters
    ----------
    sums
        Of the model.
    block
        Number of the block that each column belongs to, shape (columns,).
    start
        Places to begin from, shape (blocks,).
    optional
        Which blocks may be absent, shape (blocks,).
    """
    places = start.copy()

    def likelihoods(every: NDArray[np.int64]) -> Floats:
        return _of_places(sums, block, every, optional)

    value = float(likelihoods(places[None, :])[0])
    for _ in range(_ROUNDS):
        trials = []
        for b in range(places.size):
            moves = [places[b] - 1, places[b] + 1]
            if optional[b]:  # its price stands between absence and the scales: both ways lead over it
                moves = [*moves, ABSENT] if places[b] != ABSENT else [*ENTRANCES]
            for move in moves:
                if (ABSENT if optional[b] else 0) <= move < SCALES.size:
                    moved = places.copy()
                    moved[b] = move
                    trials.append(moved)
        if not trials:
            break
        values = likelihoods(np.array(trials))
        best = int(np.argmax(values))
        if values[best] <= value + 1e-9:
            break
        gained = values - value
        # moves of different blocks seldom hinder each other: all that help are tried at once first
        together = places.copy()
        for k in np.argsort(gained):
            if gained[k] > 0.0:
                b = int(np.flatnonzero(trials[k] != places)[0])
                together[b] = trials[k][b]
        both = float(likelihoods(together[None, :])[0])
        if both >= values[best]:
            places, value = together, both
        else:
            places, value = trials[best], float(values[best])
    return places, value


def shifted_scales(
    sums: Sums, block: NDArray[np.int64], start: NDArray[np.int64], optional: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], float]:
    """Return the same where all blocks keep their proportions.

    Under another colour the noise has another variance, and so contributions of the same size have other places.
    """
    steps = np.arange(-SHIFTS, SHIFTS + 1)[:, None]
    every = np.where(start == ABSENT, ABSENT, np.clip(start + steps, 0, SCALES.size - 1))
    values = _of_places(sums, block, every, optional)
    best = int(np.argmax(values))
    return every[best], float(values[best])


def _of_places(
    sums: Sums, block: NDArray[np.int64], every: NDArray[np.int64], optional: NDArray[np.bool_]
) -> Floats:
    """Return the log marginal likelihood for places of shape (sets, blocks), less what optional parts cost."""
    ladder = np.append(SCALES, 0.0)  # the last, at -1, is absence
    price: Floats = RARE * ((every != ABSENT) & optional).sum(axis=1)
    return log_likelihoods(sums, ladder[every][:, block]) - price


def posterior(sums: Sums, deviations: Floats) -> tuple[Floats, Floats, float]:
    """Return mean and covariance (over the noise's variance) of the amplitudes, and the variance of the noise."""
    used = deviations > 0.0
    mean, covariance = np.zeros(deviations.size), np.zeros((deviations.size, deviations.size))
    if used.any():
        d = deviations[used]
        inner = np.eye(d.size) + d[:, None] * sums.gram[np.ix_(used, used)] * d
        inverse = np.linalg.inv(inner) * np.outer(d, d)
        covariance[np.ix_(used, used)] = inverse
        mean[used] = inverse @ sums.along[used]
    left = max(sums.total - float(mean @ sums.along), 1e-12 * sums.total + 1e-300)
    return mean, covariance, left / max(sums.readings, 1)
