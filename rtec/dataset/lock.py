"""A part of a measurement that is locked away until the end, to judge what was found in the rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtec.dataset.dataset import Dataset, Ints
from rtec.dataset.repeats import cells_of
from rtec.effects import Conditions
from rtec.errors import ArgumentError

EVERY = 5
"""One part in so many is locked away."""
FEWEST_RUNS = 3
"""From so many runs on, whole runs are locked away."""
FEWEST_ROWS = 3
"""Of each part."""


def locked(dataset: Dataset) -> tuple[Dataset, Dataset]:
    """Return what may be looked at, and what is locked away until the end.

    Held-out folds see the readings of all others, and which effects, periods and nodes are looked for is decided with
    all of them. A locked part is as good as another measurement that nobody has opened.

    Parameters
    ----------
    dataset
        With three runs or more the last fifth of the runs is locked away, one at least; of fewer runs at rest every
        fifth reading, for the end of a pass lies where nothing else was measured; of a log in motion its last fifth.

    Returns
    -------
    tuple of Dataset
        The open part and the locked one.

    Raises
    ------
    ArgumentError
        Too few readings for two parts.
    """
    conditions = dataset.coordinates
    away, name = _away(conditions, dataset.rows)
    if min(int(away.sum()), int((~away).sum())) < FEWEST_ROWS:
        found = f"{dataset.rows} reading" + "s" * (dataset.rows != 1)
        raise ArgumentError("--lock", found, f"enough for two parts of {FEWEST_ROWS} readings at least")
    hidden = replace(dataset.take(away), source=f"{name} of {dataset.source}")
    return _renumbered(dataset.take(~away)), _renumbered(hidden)


def _away(conditions: Conditions, rows: int) -> tuple[np.ndarray, str]:
    """Return which readings are locked away, and what to call them."""
    runs = list(dict.fromkeys(conditions.run.tolist()))
    if len(runs) >= FEWEST_RUNS:
        last = runs[-max(1, round(len(runs) / EVERY)) :]
        return np.isin(conditions.run, last), "the last run" if len(last) == 1 else f"the last {len(last)} runs"
    order = np.arange(rows)
    if conditions.moving:
        return order >= rows - rows // EVERY, "the last fifth"
    return order % EVERY == EVERY - 1, "every fifth reading"


def _renumbered(dataset: Dataset) -> Dataset:
    """Return the data with the cells and blocks that are left: what one run visited alone is no repeat any more."""
    cell, block = np.full(dataset.rows, -1, dtype=np.int64), np.unique(dataset.block, return_inverse=True)[1]
    member = dataset.cell >= 0
    if member.any():
        cell[member] = cells_of(dataset.cell[member], dataset.coordinates.run[member])
    if block.max() == 0:
        block = np.arange(dataset.rows) * EVERY // dataset.rows
    blocks: Ints = block.astype(np.int64)
    return replace(dataset, cell=cell, block=blocks)
