"""The noise floor: what differs between readings of the same conditions, without outliers and drift."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from rtec.dataset.dataset import Dataset
from rtec.dataset.outliers import far, far_from_neighbours
from rtec.dataset.repeats import place_numbers
from rtec.dataset.standstill import Ints, group_means
from rtec.effects import Floats
from rtec.inference.results import NoiseFloor
from rtec.inference.scored import Judge, Scored

_MOST_LAGS = 200
_SETTLES = (0.03, 0.1, 0.3, 1.0)
"""Time constants after which an axis is warm, as shares of a measurement."""
_FALLS, _HALVES, _PENALTY = 0.2, 0.5, 2.0
"""Share by which what changes slowly, and a jump, lower the variance at least; penalty of a column, in log(rows)."""
_MOST_NUMBERS = 1_000_000
"""In the columns of jumps: of a long measurement not every reading may be the first after one."""
_NOTHING = 1e-3
"""Size of a column, of numbers from 0 to 1, of which the others leave nothing."""
FEWEST_COMPARED = 10
"""Readings, from which on the variance between cells says something."""


def noise_floor(judge: Judge, model: Scored) -> NoiseFloor:
    """Return the noise of a reading: what repeats of the file differ by, whatever the model; else what it leaves.

    Notes
    -----
    Outliers do not count. From readings at rest, what changes with time or temperature is taken off: a straight line,
    the approach to a steady state, a temperature, each with or without the same in proportion to position, where it
    lowers the variance by a fifth; a step, or the zero of one run, where that halves it. Each has to be worth twice
    the penalty of Schwarz's criterion, because the best of many is taken.
    """
    dataset, fit = judge.space.dataset, judge.fit(model)
    sigma, dof = float(np.sqrt(fit.variance)), float(max(judge.space.readings - fit.mean.size, 1))
    if dataset.has_repeats:
        sigma, dof = dataset.repeat_noise or _of_repeats(dataset)
    return NoiseFloor(
        from_repeats=dataset.has_repeats,
        sigma=sigma,
        correlation=model.colour.rho,
        white_share=model.colour.white,
        degrees_of_freedom=dof,
        sigma_adjacent=_adjacent(dataset) if dataset.has_repeats else None,
    )


def knowing_its_noise(dataset: Dataset) -> Dataset:
    """Return a data set all parts of which have the noise floor of the whole: a file has one, whoever asks."""
    return replace(dataset, repeat_noise=_of_repeats(dataset)) if dataset.has_repeats else dataset


def _of_repeats(dataset: Dataset) -> tuple[float, float]:
    """Return the standard deviation of repeats that nothing slow explains, and its degrees of freedom."""
    dataset = dataset.take(~far_from_neighbours(dataset) & (dataset.cell >= 0))
    sigma, dof = within_cells(dataset.observed, dataset.cell)
    c = dataset.coordinates
    if c.moving or c.time_is_coordinate or dataset.never_changes:
        return sigma, dof
    clock, place, *heat = (
        (values - values.min()) / max(float(np.ptp(values)), 1e-300)
        for values in (c.clock, c.position, *c.temperatures.values())
        if np.isfinite(values).all()
    )
    slow = [clock, *(-np.expm1(-clock / share) for share in _SETTLES), *heat]
    most = 1 + _MOST_NUMBERS // clock.size
    jumps = [clock >= at for at in np.sort(clock)[:: 1 + clock.size // most]]
    jumps += [c.run == run for run in np.unique(c.run)[:most]]
    parts = [*([part] for part in jumps), *([part] for part in slow), *([part, part * place] for part in slow)]
    least = [*(_HALVES for _ in jumps), *(_FALLS for _ in (*slow, *slow))]
    groups = [_off_cells(np.array(part, dtype=np.float64), dataset.cell) for part in parts]
    left, price = _off_cells(dataset.observed[None], dataset.cell)[0], _PENALTY * np.log(dataset.rows)
    while dof > FEWEST_COMPARED:
        square = max(float(left @ left), 1e-300)
        bases = [basis[size > _NOTHING] for _, size, basis in (np.linalg.svd(g, full_matrices=False) for g in groups)]
        shares = [float(np.sum((basis @ left) ** 2)) / square for basis in bases]
        worth = [
            -dataset.rows * np.log1p(-min(share, 1.0 - 1e-12)) - price * (len(basis) + 1) if share > limit else 0.0
            for share, basis, limit in zip(shares, bases, least, strict=True)
        ]
        best = int(np.argmax(worth))
        if worth[best] <= 0.0:
            break
        basis = bases[best]
        left = left - basis.T @ (basis @ left)
        groups = [group - group @ basis.T @ basis for group in groups]
        dof -= len(basis)
    if (out := far(left)).any():
        return _of_repeats(dataset.take(~out))
    return float(np.sqrt(left @ left / dof)), dof


def _off_cells(rows: Floats, cells: Ints) -> Floats:
    """Return numbers about the means of their cells, shape (columns, rows)."""
    number, count = np.unique(cells, return_inverse=True, return_counts=True)[1:]
    return np.array([row - (np.bincount(number, weights=row) / count)[number] for row in rows])


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
