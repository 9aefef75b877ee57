"""A part of a very large measurement that shows what the whole shows: the search's cost grows with the rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset

MOST_ROWS = 20_000
"""More readings than these make a search slow, and tell it nothing new."""
ENOUGH_REPEATS = 30
"""Runs, or readings of a cell, from which the noise is known to an eighth."""


def looked_at(dataset: Dataset, most: int = MOST_ROWS) -> Dataset:
    """Return the readings that a search looks at: all, or a part with whole runs or whole cells where they are many.

    Parameters
    ----------
    dataset
        Of any size.
    most
        Readings, about, that are kept at most.

    Returns
    -------
    Dataset
        The same one up to ``most`` rows, and where a log was decimated. Of repeated readings evenly spaced runs, as
        long as 30 are left; then drawn cells with all their readings, 30 of each at most. Without repeats one of
        every so many rows is drawn. A note says so.

    Notes
    -----
    Cells and rows are drawn, not taken at equal steps, where a short period would pass for a long one. The draw is
    always the same.

    Examples
    --------
    >>> from rtec.effects import Conditions, Observable, Units
    >>> x, run = np.tile(np.arange(10.0), 50), np.repeat(np.arange(50), 10)
    >>> data = Dataset(
    ...     source="x.csv",
    ...     observe="deviation",
    ...     observable=Observable.DEVIATION,
    ...     units=Units("mm", "mm", "reading"),
    ...     observed=np.zeros(500),
    ...     conditions=Conditions(position=x, position_unit="mm", run=run),
    ...     cell=np.tile(np.arange(10), 50),
    ...     block=run,
    ... )
    >>> part = looked_at(data, most=400)
    >>> part.rows, part.notes
    (400, ('of 500 readings 400 are looked at, 40 of 50 runs: more would take long and tell nothing new',))
    """
    if dataset.rows <= most or dataset.resample is not None:
        return dataset
    rng = np.random.default_rng(0)
    if not dataset.has_repeats:
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
        kept &= _rank_in_cell(dataset.cell) < ENOUGH_REPEATS if runs == 1 else True
        cells = np.unique(dataset.cell[kept])
        count = max(2, min(cells.size, most * cells.size // int(kept.sum())))
        kept &= np.isin(dataset.cell, rng.permutation(cells)[:count])
        how.append(f"{count} of {cells.size} conditions")
    return _part(dataset, np.flatnonzero(kept), ", ".join(how))


def one_of_every(step: int, rows: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return one row of every ``step``, drawn.

    Examples
    --------
    >>> (one_of_every(3, 10, np.random.default_rng(0)) // 3).tolist()
    [0, 1, 2, 3]
    """
    begin = np.arange(0, rows, step)
    return np.asarray(np.minimum(begin + rng.integers(0, step, begin.size), rows - 1), dtype=np.int64)


def _rank_in_cell(cell: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return how many readings of the same cell came before each."""
    order = np.argsort(cell, kind="stable")
    ordered = cell[order]
    first = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1]))
    rank = np.empty(cell.size, dtype=np.int64)
    rank[order] = np.arange(cell.size) - np.repeat(first, np.diff(np.append(first, cell.size)))
    return rank


def _part(dataset: Dataset, rows: NDArray[np.int64], how: str) -> Dataset:
    """Return some of the readings, their cells numbered anew, with a note."""
    part = dataset.take(rows)
    cell = np.full(rows.size, -1, dtype=np.int64)
    member = part.cell >= 0
    _, inverse, count = np.unique(part.cell[member], return_inverse=True, return_counts=True)
    repeated = count > 1
    cell[member] = np.where(repeated, np.cumsum(repeated) - 1, -1)[inverse]
    note = f"of {dataset.rows} readings {rows.size} are looked at, {how}: more would take long and tell nothing new"
    return replace(part, cell=cell, notes=(*dataset.notes, note))
