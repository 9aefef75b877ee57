"""The noise floor: what differs between readings of the same conditions, else what a model leaves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from rtec.dataset.dataset import Dataset
from rtec.dataset.repeats import place_numbers
from rtec.dataset.standstill import Ints, group_means
from rtec.effects import Floats
from rtec.inference.results import NoiseFloor
from rtec.inference.scored import Judge, Scored

_MOST_LAGS = 200
FEWEST_COMPARED = 10
"""Readings, from which on the variance between cells says something."""


def noise_floor(judge: Judge, model: Scored) -> NoiseFloor:
    """Return the noise of a reading: repeats differ by it, once what a model explains in time has been taken out."""
    dataset, fit = judge.space.dataset, judge.fit(model)
    sigma, dof = float(np.sqrt(fit.variance)), float(max(judge.space.readings - fit.mean.size, 1))
    if dataset.has_repeats:
        in_time = (fit.contribution(k) for k, (effect, _) in enumerate(model.choices) if effect.in_time)
        sigma, dof = within_cells(dataset.observed - sum(in_time, np.zeros(dataset.rows)), dataset.cell)
    return NoiseFloor(
        from_repeats=dataset.has_repeats,
        sigma=sigma,
        correlation=model.colour.rho,
        white_share=model.colour.white,
        degrees_of_freedom=dof,
        sigma_adjacent=_adjacent(dataset) if dataset.has_repeats else None,
    )


def within_cells(values: Floats, cells: Ints) -> tuple[float, float]:
    """Return the standard deviation about the means of the cells, and its degrees of freedom."""
    member = cells >= 0
    cell, count = np.unique(cells[member], return_inverse=True, return_counts=True)[1:]
    means = np.bincount(cell, weights=values[member]) / count
    dof = float(max(int(member.sum()) - count.size, 1))
    return float(np.sqrt(np.sum((values[member] - means[cell]) ** 2) / dof)), dof


def _adjacent(dataset: Dataset) -> float | None:
    """Return the standard deviation from neighbouring repeats only: what changes slowly hardly shows in it."""
    order = np.argsort(dataset.cell, kind="stable")
    cell, values = dataset.cell[order], dataset.observed[order]
    same = (np.diff(cell) == 0) & (cell[1:] >= 0)
    return float(np.sqrt(np.mean(np.diff(values)[same] ** 2) / 2.0)) if same.any() else None


def compared_cells(dataset: Dataset) -> Ints:
    """Return the number of the cell in which each reading is compared with others, -1 where alone; shape (rows,).

    Readings of the same conditions; of a single run at rest those of the same place, from either side: what does not
    depend on the direction is there twice.
    """
    c = dataset.coordinates
    if dataset.has_repeats or c.moving or c.time_is_coordinate or not c.both_directions:
        return dataset.cell
    place = place_numbers(c.position)
    return np.where(np.bincount(place)[place] > 1, place, -1)


def lack_of_fit(judge: Judge, model: Scored) -> tuple[float, float, float] | None:
    """Return the probability that what a model leaves of the repeatable part is noise, and its RMS beyond chance.

    Returns
    -------
    tuple or None
        Probability, RMS beyond chance and RMS within the cells in the observed unit inside; None where no readings
        can be compared.

    Notes
    -----
    One-way analysis of variance over the cells: what repeats lies between them, noise within them. Each of the
    model's columns that repeats costs a degree of freedom. Readings at rest are freed of the correlation that the
    model found. Of a log each visit of a cell is one reading, because those of one visit repeat nothing; correlation
    from visit to visit leaves fewer degrees of freedom: as many as independent readings would need to know a variance
    as well (M. S. Bartlett, J. R. Stat. Soc. Suppl. 8 (1946) 27).
    """
    cells = compared_cells(judge.space.dataset)
    if (cells >= 0).sum() < FEWEST_COMPARED:
        return None
    fit = judge.fit(model)
    left = judge.left(model)
    floor, _ = within_cells(left, cells)
    moving = judge.space.dataset.conditions.moving
    begins, rows = np.append(True, np.isinf(judge.space.gap[1:])), np.ones(cells.size)
    if moving:
        starts = np.flatnonzero(begins | np.append(True, np.diff(cells) != 0))
        cells, begins, rows = cells[starts], begins[starts], np.diff(np.append(starts, cells.size)) + 0.0
        left = white = group_means(left, starts)
    else:
        white = judge.space.view(model.colour).project(left[None, :])[0]
    member = cells >= 0
    cell, count = np.unique(cells[member], return_inverse=True, return_counts=True)[1:]
    spent = sum(
        part.raw.shape[0] for part, (effect, _) in zip(fit.parts, model.choices, strict=False) if not effect.in_time
    )
    above = max(count.size - 1 - spent, 1)
    below = max(int(member.sum()) - count.size, 1)

    def parts(values: Floats, weight: Floats) -> tuple[float, Floats]:
        """Return the sum of squares between the cells, and what each reading is off the mean of its cell."""
        sums = np.bincount(cell, weights=weight[member])
        means = np.bincount(cell, weights=(weight * values)[member]) / sums
        centre = float(np.average(values[member], weights=weight[member])) if judge.space.has_datum else 0.0
        apart = np.zeros(values.size)
        apart[member] = values[member] - means[cell]
        return float(sums @ (means - centre) ** 2), apart

    between, apart = parts(white, np.ones(white.size))
    within = float(apart @ apart)
    if within <= 0.0:
        return None
    share = _independent_share(apart, begins) if moving else 1.0
    p = float(fdtrc(above * share, below * share, between / above / (within / below)))
    raw_between, raw_apart = parts(left, rows)
    excess = (raw_between - float(rows @ raw_apart**2) / below * above) / float(rows[member].sum())
    return p, float(np.sqrt(max(excess, 0.0))), floor


def _independent_share(values: Floats, begins: NDArray[np.bool_]) -> float:
    """Return how many independent values would know their variance as well, as a share of those there are."""
    chain, total = np.cumsum(begins), float(values @ values)
    spent = 1.0
    for lag in range(1, min(_MOST_LAGS, values.size)):
        same = chain[lag:] == chain[:-lag]
        together = float((values[lag:] * values[:-lag])[same].sum()) / max(total, 1e-300)
        if together <= 0.0:
            break
        spent += 2.0 * together**2
    return 1.0 / spent
