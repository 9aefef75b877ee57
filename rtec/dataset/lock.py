"""A part of a measurement that is locked away until the end, to judge what was found in the rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.repeats import cells_of
from rtec.errors import ArgumentError

_EVERY = 5  # one part in so many is locked away
_FEWEST_RUNS = 3  # from so many runs on, whole runs are locked away
_FEWEST_ROWS = 3  # of each part


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
    run, order = dataset.coordinates.run, np.arange(dataset.rows)
    runs = list(dict.fromkeys(run.tolist()))
    if len(runs) >= _FEWEST_RUNS:
        last = runs[-max(1, round(len(runs) / _EVERY)) :]
        away, name = np.isin(run, last), "the last run" if len(last) == 1 else f"the last {len(last)} runs"
    elif dataset.conditions.moving:
        away, name = order >= dataset.rows - dataset.rows // _EVERY, "the last fifth"
    else:
        away, name = order % _EVERY == _EVERY - 1, "every fifth reading"
    if min(int(away.sum()), int((~away).sum())) < _FEWEST_ROWS:
        found = f"{dataset.rows} reading" + "s" * (dataset.rows != 1)
        raise ArgumentError("--lock", found, f"enough for two parts of {_FEWEST_ROWS} readings at least")
    hidden = replace(dataset.take(away), source=f"{name} of {dataset.source}")
    return _renumbered(dataset.take(~away)), _renumbered(hidden)


def _renumbered(part: Dataset) -> Dataset:
    """Return the data with the cells and blocks that are left: what one pass visited alone is no repeat any more."""
    block = np.unique(part.block, return_inverse=True)[1]
    if block.max() == 0:
        block = np.arange(part.rows) * _EVERY // part.rows
    return replace(part, cell=cells_of(part.cell, part.passage), block=block.astype(np.int64))
