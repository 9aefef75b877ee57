"""What a model says as curves that can be drawn: over a column, and over places between the readings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Floats
from rtec.inference.local_means import neighbour_means
from rtec.inference.model import Model

FEW_PLACES = 400
"""Up to so many places a curve has points between them, too."""
FINE = 2000
"""Points of a curve between places."""
_ALONG = 400
"""Points along the axis, and as many among the readings, at which a long contribution is read."""
_PERIOD_GAPS = 6.0
"""Periods below so many distances between targets show between the targets, too."""
_GROUPS, _IN_GROUP = 150, 8
"""Of neighbours at most, and readings in each, whose mean is the curve where a contribution is no function."""
_NEAR, _ROUGH = 1e-3, 0.02
"""Of its span, how near readings are neighbours, and of the contribution, how much these differ where it is none."""
_Mask = NDArray[np.bool_]


def contribution_curve(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return a contribution as a curve: as it is where it is a function of ``x``, else means of neighbours.

    ``x`` and ``y`` have the shape (readings,); places, ascending, and the curve there come back, each (points,).

    A long one is read at places close together, both along the axis and among the readings.

    Examples
    --------
    >>> x, y = contribution_curve(np.array([2.0, 1.0, 3.0]), np.array([20.0, 10.0, 30.0]))
    >>> x.tolist(), y.tolist()
    ([1.0, 2.0, 3.0], [10.0, 20.0, 30.0])
    """
    order = np.argsort(x, kind="stable")
    x, y = x[order], y[order]
    near = np.diff(x) <= _NEAR * float(x[-1] - x[0])
    if near.any() and float(np.abs(np.diff(y))[near].mean()) > _ROUGH * float(np.ptp(y)):
        groups = np.array_split(np.arange(x.size), min(max(x.size // _IN_GROUP, 1), _GROUPS))
        return np.array([x[rows].mean() for rows in groups]), np.array([y[rows].mean() for rows in groups])
    if x.size <= 2 * _ALONG:
        return x, y
    even = np.linspace(x[0], x[-1], _ALONG)
    fine = np.unique(np.concatenate([even, np.quantile(x, np.linspace(0, 1, _ALONG))]))
    return fine, np.interp(fine, x, y)


def at_places(c: Conditions, places: Floats, rows: _Mask) -> Conditions:
    """Return conditions at any places, approached as some readings are: enough for what depends on position alone.

    ``places`` has the shape (points,); ``rows`` are readings of one direction, shape (readings,).
    """
    direction = None
    if c.direction is not None:
        direction = np.full(places.size, float(np.sign(c.direction[rows].mean())))
    return Conditions(
        position=places,
        position_unit=c.position_unit,
        run=np.ones(places.size, dtype=np.int64),
        direction=direction,
        screw_pitch=c.screw_pitch,
        signal_period=c.signal_period,
        revolution=c.revolution,
    )


def model_curve(dataset: Dataset, c: Conditions, model: Model, fitted: Floats, rows: _Mask) -> tuple[Floats, Floats]:
    """Return the model over places, mean of all runs; what is periodic also between targets that stand far apart.

    Places, ascending, and the model there, each of shape (points,).

    Parameters
    ----------
    dataset, c
        The measurement, and what its readings are placed by.
    model, fitted
        The model, and what it says of each reading, shape (readings,).
    rows
        Readings of one direction, shape (readings,).
    """
    means = neighbour_means(c.position[rows], fitted[rows], each_place=True)
    reach = _PERIOD_GAPS * float(np.median(np.diff(means.at))) if means.at.size > 1 else 0.0
    periodic = [term for term in model.terms if term.fitted and (term.period or reach) < reach]
    # nothing filtered: the conditions are those of the readings
    if not periodic or means.at.size > FEW_PLACES or dataset.conditions.rows != dataset.rows:
        return means.at, means.mean
    fine = np.union1d(means.at, np.linspace(means.at[0], means.at[-1], FINE))
    between = at_places(c, fine, rows)
    waves = np.sum([term.contribution(between) for term in periodic], axis=0)
    slow = means.mean - np.interp(means.at, fine, waves)
    return fine, np.interp(fine, means.at, slow) + waves
