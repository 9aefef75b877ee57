"""The part of a measurement that a search looks at: its cost grows with the rows, what they tell does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtec.dataset.dataset import Dataset

MOST_AT_REST, MOST_IN_MOTION = 1600, 900
"""Readings that a search looks at. Those of a log know their neighbours: a thousand say what is there."""


def drawn(dataset: Dataset, seed: int = 0) -> Dataset:
    """Return what a search looks at of a long measurement, drawn by a seed; the final fit takes everything.

    Of readings at rest that repeat, whole conditions with all their repeats, so that differences between repeats
    stay what they are; a reading that nothing repeats is a condition of its own. What the places resolve is what
    those of the whole measurement do.
    """
    most = MOST_IN_MOTION if dataset.conditions.moving else MOST_AT_REST
    if dataset.rows <= most:
        return dataset
    rng = np.random.default_rng(seed)
    if dataset.has_repeats and not dataset.conditions.moving:
        alone = dataset.cell < 0
        cell = np.where(alone, dataset.cell.max() + np.cumsum(alone), dataset.cell)
        cells = np.unique(cell)
        rows = np.flatnonzero(np.isin(cell, rng.permutation(cells)[: max(2, cells.size * most // dataset.rows)]))
    else:
        rows = np.sort(rng.choice(dataset.rows, most, replace=False))
    part = dataset.take(rows)
    if dataset.resample is not None:
        return part
    return replace(part, conditions=replace(part.conditions, whole=dataset.conditions))
