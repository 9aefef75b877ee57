"""A part of a measurement that is locked away until the end, to judge what was found in the rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.errors import ArgumentError

_EVERY = 5  # one part in so many is locked away
_FEWEST_RUNS = 3  # from so many runs on, whole runs are locked away
_FEWEST_ROWS = 3  # of each part


def locked(dataset: Dataset) -> tuple[Dataset, Dataset]:
    """Return what may be looked at, and what is locked away until the end.

    Held-out folds see the readings of all others, and which effects, periods and nodes are looked for is decided with
    all of them. A locked part is as good as another measurement that nobody has opened.

    Of three runs or more the last fifth of the runs is reserved, one at least; of fewer runs at rest every fifth
    reading, for the end of a pass lies where nothing else was measured; of a log in motion its last fifth.

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
    return dataset.alone(~away), replace(dataset.alone(away), source=f"{name} of {dataset.source}")
