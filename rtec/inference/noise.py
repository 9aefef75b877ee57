"""The noise floor: what differs between readings of the same conditions, else what a model leaves."""

from __future__ import annotations

import numpy as np
from scipy.special import fdtrc

from rtec.dataset.dataset import Dataset
from rtec.dataset.repeats import place_numbers
from rtec.dataset.standstill import Ints
from rtec.effects import Floats
from rtec.inference.results import NoiseFloor
from rtec.inference.scored import Judge, Scored

FEWEST_COMPARED = 10
"""Readings, from which on the variance between cells says something."""


def noise_floor(judge: Judge, model: Scored, *, levelled: bool = True) -> NoiseFloor:
    """Return the noise of a reading, with what a model explains in time taken out of the differences between repeats.

    Parameters
    ----------
    judge, model
        The data and what explains them.
    levelled
        Whether each run is seen from its own zero where the zeros differ.
    """
    dataset = judge.space.dataset
    fit = judge.fit(model)
    if not dataset.has_repeats:
        return NoiseFloor(
            from_repeats=False,
            sigma=float(np.sqrt(fit.variance)),
            correlation=model.colour.rho,
            white_share=model.colour.white,
            degrees_of_freedom=float(max(judge.space.readings - fit.mean.size, 1)),
            sigma_adjacent=None,
        )
    changing = sum(
        (fit.contribution(k) for k, (effect, _) in enumerate(model.choices) if effect.in_time),
        np.zeros(dataset.rows),
    )
    values, spent = dataset.observed - changing, 0
    if model.zeros and levelled:  # they are the noise of a run, not that of a reading
        values = values - dataset.run_means(dataset.observed - fit.effects())
        spent = np.unique(dataset.coordinates.run).size - 1
    within, freedom = within_cells(values, dataset, spent)
    pooled, _ = within_cells(dataset.observed, dataset)
    return NoiseFloor(
        from_repeats=True,
        sigma=within,
        correlation=model.colour.rho,
        white_share=model.colour.white,
        degrees_of_freedom=freedom,
        sigma_adjacent=_adjacent(dataset),
        sigma_pooled=pooled,
    )


def within_cells(values: Floats, dataset: Dataset, spent: int = 0) -> tuple[float, float]:
    """Return the standard deviation about the means of the cells, and its degrees of freedom less those spent."""
    member = dataset.cell >= 0
    cell, count = np.unique(dataset.cell[member], return_inverse=True, return_counts=True)[1:]
    means = np.bincount(cell, weights=values[member]) / count
    freedom = float(max(int(member.sum()) - count.size - spent, 1))
    return float(np.sqrt(np.sum((values[member] - means[cell]) ** 2) / freedom)), freedom


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
    One-way analysis of variance over the cells, of residuals freed of the correlation that the model found: what
    repeats lies between the cells, noise within them. Each of the model's columns that repeats costs a degree of
    freedom.
    """
    cells = compared_cells(judge.space.dataset)
    if (cells >= 0).sum() < FEWEST_COMPARED:
        return None
    fit = judge.fit(model)
    left = judge.left(model)
    white = judge.space.project(left[None, :], model.colour)[0]
    member = cells >= 0
    cell, count = np.unique(cells[member], return_inverse=True, return_counts=True)[1:]
    spent = sum(
        part.raw.shape[0] for part, (effect, _) in zip(fit.parts, model.choices, strict=False) if not effect.in_time
    )
    above = max(count.size - 1 - spent, 1)
    below = max(int(member.sum()) - count.size, 1)

    def parts(values: Floats) -> tuple[float, float]:
        means = np.bincount(cell, weights=values[member]) / count
        centre = float(values[member].mean()) if judge.space.has_datum else 0.0
        return float(count @ (means - centre) ** 2), float(np.sum((values[member] - means[cell]) ** 2))

    between, within = parts(white)
    if within <= 0.0:
        return None
    p = float(fdtrc(above, below, between / above / (within / below)))
    raw_between, raw_within = parts(left)
    excess = (raw_between - raw_within / below * above) / float(count.sum())
    return p, float(np.sqrt(max(excess, 0.0))), float(np.sqrt(raw_within / below))
