"""The noise floor: what differs between readings of the same conditions, else what a model leaves."""

from __future__ import annotations

import numpy as np
from scipy import stats

from rtec.dataset.dataset import Dataset
from rtec.effects import Floats
from rtec.inference.results import NoiseFloor
from rtec.inference.scored import Fit, Judge, Scored


def noise_floor(judge: Judge, model: Scored) -> NoiseFloor:
    """Return the noise of a reading, with what a model explains in time taken out of the differences between repeats.

    Parameters
    ----------
    judge, model
        The data and what explains them.
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
    within, freedom = within_cells(dataset.observed - changing, dataset)
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


def within_cells(values: Floats, dataset: Dataset) -> tuple[float, float]:
    """Return the standard deviation about the means of the cells, and its degrees of freedom."""
    member = dataset.cell >= 0
    cell, count = np.unique(dataset.cell[member], return_inverse=True, return_counts=True)[1:]
    means = np.bincount(cell, weights=values[member]) / count
    freedom = float(max(int(member.sum()) - count.size, 1))
    return float(np.sqrt(np.sum((values[member] - means[cell]) ** 2) / freedom)), freedom


def _adjacent(dataset: Dataset) -> float | None:
    """Return the standard deviation from neighbouring repeats only: what changes slowly hardly shows in it."""
    order = np.argsort(dataset.cell, kind="stable")
    cell, values = dataset.cell[order], dataset.observed[order]
    same = (np.diff(cell) == 0) & (cell[1:] >= 0)
    return float(np.sqrt(np.mean(np.diff(values)[same] ** 2) / 2.0)) if same.any() else None


def lack_of_fit(judge: Judge, model: Scored) -> tuple[float, float] | None:
    """Return the probability that what a model leaves of the repeatable part is noise, and its RMS beyond chance.

    Returns
    -------
    tuple or None
        Probability, and RMS in the observed unit inside; None without repeats.

    Notes
    -----
    One-way analysis of variance over the cells, of residuals freed of the correlation that the model found: what
    repeats lies between the cells, noise within them. Each of the model's columns that repeats costs a degree of
    freedom.
    """
    dataset = judge.space.dataset
    if not dataset.has_repeats:
        return None
    fit = judge.fit(model)
    left = judge.left(model)
    white = judge.space.project(left[None, :], model.colour)[0]
    member = dataset.cell >= 0
    cell, count = np.unique(dataset.cell[member], return_inverse=True, return_counts=True)[1:]
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
    p = float(stats.f.sf(between / above / (within / below), above, below))
    raw_between, raw_within = parts(_about_zeros(judge, model, fit) if model.zeros else left)
    excess = (raw_between - raw_within / below * above) / float(count.sum())
    return p, float(np.sqrt(max(excess, 0.0)))


def _about_zeros(judge: Judge, model: Scored, fit: Fit) -> Floats:
    """Return what the effects of a model leave about the mean of each run.

    Beside slow noise the zeros of runs, as they are fitted, may be anywhere, and would count as noise.
    """
    dataset = judge.space.dataset
    left = dataset.observed - sum((fit.contribution(k) for k in range(len(model.choices))), np.zeros(dataset.rows))
    run = np.unique(dataset.coordinates.run, return_inverse=True)[1]
    found: Floats = left - (np.bincount(run, weights=left) / np.bincount(run))[run]
    return found
