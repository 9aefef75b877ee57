"""Parts of a measurement: what a search looks at of very many rows, and what is locked away until the end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.standstill import Ints
from rtec.errors import ArgumentError

_EVERY = 5  # one part in so many is locked away
_FEWEST_RUNS = 3  # from so many runs on, whole runs are locked away
_FEWEST_ROWS = 3  # of each part
MOST_ROWS = 20_000
"""More readings than these make a search slow, and tell it nothing new."""
ENOUGH_REPEATS = 30
"""Runs, or readings of a cell, from which the noise is known to an eighth."""
MOST_AT_REST, MOST_IN_MOTION = 1600, 900
"""Readings that a search looks at. Those of a log know their neighbours: a thousand say what is there."""


def shortened(dataset: Dataset, most: int = MOST_ROWS, *, seed: int = 0) -> Dataset:
    """Return the readings that a search looks at: all, or a part with whole runs or whole cells where they are many.

    All of them up to ``most`` rows, and where a log was decimated; else about so many at most. Of repeated readings
    evenly spaced runs, as long as 30 are left; then drawn cells with all their readings, 30 of each at most. Without
    repeats, and of a log, one of every so many rows is drawn. A note says so.

    Cells and rows are drawn, not taken at equal steps, where a short period would pass for a long one. The same
    seed draws the same.
    """
    if dataset.rows <= most or dataset.resample is not None:
        return dataset
    rng = np.random.default_rng(seed)
    if not dataset.has_repeats or dataset.conditions.moving:
        rows = one_of_every(-(-dataset.rows // most), dataset.rows, rng)
        return _part(dataset, rows, "drawn from all of the file")
    run = dataset.coordinates.run
    kept, how = dataset.cell >= 0, []
    numbers = np.unique(run[kept])
    runs = min(numbers.size, max(ENOUGH_REPEATS, most * numbers.size // int(kept.sum())))
    if runs < numbers.size:
        chosen = numbers[np.linspace(0, numbers.size - 1, runs).round().astype(np.int64)]
        kept &= np.isin(run, chosen)
        how.append(f"{runs} of {numbers.size} runs")
    if kept.sum() > most:
        if runs == 1:  # readings of a cell, from the first on
            order = np.argsort(dataset.cell, kind="stable")
            ordered = dataset.cell[order]
            kept[order] &= np.arange(kept.size) - np.searchsorted(ordered, ordered) < ENOUGH_REPEATS
        cells = np.unique(dataset.cell[kept])
        count = max(2, min(cells.size, most * cells.size // int(kept.sum())))
        kept &= np.isin(dataset.cell, rng.permutation(cells)[:count])
        how.append(f"{count} of {cells.size} conditions")
    return _part(dataset, np.flatnonzero(kept), ", ".join(how))


def one_of_every(step: int, rows: int, rng: np.random.Generator) -> Ints:
    """Return one row of every ``step``, drawn."""
    begin = np.arange(0, rows, step)
    drawn: Ints = np.minimum(begin + rng.integers(0, step, begin.size), rows - 1)
    return drawn


def _part(dataset: Dataset, rows: Ints, how: str) -> Dataset:
    """Return some of the readings, their cells numbered anew, with a note."""
    note = f"{rows.size} of {dataset.rows} readings are searched, {how}: more would take long and tell nothing new"
    return replace(dataset.alone(rows), notes=(*dataset.notes, note))


def search_sample(dataset: Dataset, seed: int = 0) -> Dataset:
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


def locked(dataset: Dataset) -> tuple[Dataset, Dataset]:
    """Return what may be looked at, and what is locked away until the end.

    Held-out folds see the readings of all others, and which effects, periods and nodes are looked for is decided with
    all of them. A locked part is as good as another measurement that nobody has opened.

    Of three runs or more the last fifth of the runs is reserved, one at least; of blocks the last fifth, too; else of
    readings at rest every fifth, for the end of a pass lies where nothing else was measured; of a log in motion its
    last fifth.

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
    elif dataset.block is not None and (blocks := np.unique(dataset.block).tolist())[1:]:
        ended = blocks[-max(1, round(len(blocks) / _EVERY)) :]
        away = np.isin(dataset.block, ended)
        name = "the last block" if len(ended) == 1 else f"the last {len(ended)} blocks"
    elif dataset.conditions.moving:
        away, name = order >= dataset.rows - dataset.rows // _EVERY, "the last fifth"
    else:
        away, name = order % _EVERY == _EVERY - 1, "every fifth reading"
    if min(int(away.sum()), int((~away).sum())) < _FEWEST_ROWS:
        found = f"{dataset.rows} reading" + "s" * (dataset.rows != 1)
        raise ArgumentError("--lock", found, f"enough for two parts of {_FEWEST_ROWS} readings at least")
    return dataset.alone(~away), replace(dataset.alone(away), source=f"{name} of {dataset.source}")
