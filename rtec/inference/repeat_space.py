"""Differences between repeats: all that repeatable effects leave no trace in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Floats
from rtec.effects._smooth import smooth_columns

MOST_RUN_SHAPES = 4
"""Of the courses over the runs: linear, quadratic, ..."""
MOST_PLACES = 8
"""Nodes over the travel for changes that depend on position."""
SHARE_OF_FREEDOM = 3
"""Generic changes may take so large a part (one in three) of the differences; the rest is needed for the noise."""
SLOW_SHARE = 12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RepeatSpace:
    """Differences between repeats.

    Parameters
    ----------
    dataset
        With repeats.
    observed
        Shape (differences,): contrasts between runs that visit the same cells in the same order, else deviations from
        cell means, stretched to the variance of a reading.
    starts
        Shape (differences,): where a segment of consecutive readings begins.
    freedom
        Independent differences.
    slots
        Readings of a run, where all runs visit the same cells in the same order; else None.
    runs
        Number of runs.
    """

    dataset: Dataset
    observed: Floats
    starts: NDArray[np.bool_]
    freedom: int
    slots: int | None
    runs: int

    def of(self, columns: Floats) -> Floats:
        """Return columns, shape (columns, rows of the data), as differences, shape (columns, differences)."""
        if self.slots is not None:
            return contrasts_of(columns, self.runs)
        return _about_cells(columns, self.dataset.cell)


def contrasts_of(columns: Floats, runs: int) -> Floats:
    """Return orthonormal contrasts (Helmert's) between equal runs of columns, shape (columns, rows)."""
    count, rows = columns.shape
    cube = columns.reshape(count, runs, rows // runs)
    k = np.arange(1.0, runs)[:, None]
    before = np.cumsum(cube[:, :-1], axis=1)  # each run against the sum of those before it
    contrasts: Floats = (before - k * cube[:, 1:]) / np.sqrt(k * (k + 1.0))
    return contrasts.reshape(count, rows - rows // runs)


def _about_cells(columns: Floats, cell: NDArray[np.int64]) -> Floats:
    """Return columns about their cell means; rows without repeats are left out."""
    member = cell >= 0
    own = cell[member]
    count = np.bincount(own)
    stretch = np.sqrt(count / np.maximum(count - 1.0, 1.0))[own]
    out = np.empty((columns.shape[0], own.size))
    for k, column in enumerate(columns[:, member]):
        mean = np.bincount(own, weights=column) / np.maximum(count, 1)
        out[k] = (column - mean[own]) * stretch
    return out


def run_starts(run: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return where runs begin, shape (rows,).

    Examples
    --------
    >>> run_starts(np.array([1, 1, 2, 2])).tolist()
    [True, False, True, False]
    """
    starts = np.ones(run.size, dtype=np.bool_)
    starts[1:] = run[1:] != run[:-1]
    return starts


def equal_runs(dataset: Dataset) -> tuple[int, int] | None:
    """Return number of runs and readings of each, where all runs visit the same cells in the same order."""
    first = np.flatnonzero(run_starts(dataset.coordinates.run))
    lengths = np.diff(np.append(first, dataset.rows))
    if first.size < 2 or not (lengths == lengths[0]).all():
        return None
    grid = dataset.cell.reshape(first.size, -1)
    if (grid != grid[0]).any() or (grid < 0).any() or np.unique(grid[0]).size != grid.shape[1]:
        return None
    return first.size, int(lengths[0])


def repeat_space(dataset: Dataset) -> RepeatSpace | None:
    """Return the differences between repeats, or None where there are none."""
    if not dataset.has_repeats:
        return None
    equal = equal_runs(dataset)
    table = dataset.observed[None, :]
    if equal is not None:
        runs, slots = equal
        starts = np.tile(np.arange(slots) == 0, runs - 1)
        observed, freedom = contrasts_of(table, runs)[0], (runs - 1) * slots
    else:
        member = dataset.cell >= 0
        starts = run_starts(dataset.conditions.run[member])
        observed, runs, slots = _about_cells(table, dataset.cell)[0], int(starts.sum()), None
        freedom = int(member.sum() - np.unique(dataset.cell[member]).size)
    return RepeatSpace(dataset=dataset, observed=observed, starts=starts, freedom=freedom, slots=slots, runs=runs)


def changes_between_repeats(dataset: Dataset, space: RepeatSpace) -> dict[str, Floats]:
    """Return generic changes from repeat to repeat, by what they depend on, each of shape (columns, rows).

    ``time``: slow courses over the whole measurement, alone, along the axis and with measured temperatures. Whatever
    drifts, warms up or grows shows there. (A step does not; it shows in a single innovation.) ``direction`` and
    ``position``: any course over the runs of the reversal error, and of a smooth function of position. They are no
    effects of the library: where they are needed, it lacks something.
    """
    c = dataset.conditions
    found = {"time": _slow_changes(c, min(10, space.freedom // SLOW_SHARE))}
    budget = space.freedom // SHARE_OF_FREEDOM - found["time"].shape[0]
    numbers = np.unique(c.run)
    course = _courses(c.run, numbers)
    if c.both_directions and c.direction is not None and course.shape[0] <= budget:
        found["direction"] = course * c.direction
        budget -= course.shape[0]
    nodes = min(MOST_PLACES, c.places.size // 2)
    if nodes >= 4:
        smooth = smooth_columns(c.position, np.linspace(c.places[0], c.places[-1], nodes).tolist()).T
        parts = [smooth * line for line in course[: budget // nodes]]
        if parts:
            found["position"] = np.vstack(parts)
    return found


def _courses(run: NDArray[np.int64], numbers: NDArray[np.int64]) -> Floats:
    """Return courses over the runs: linear, quadratic, ..., shape (courses, rows)."""
    place = 2.0 * np.searchsorted(numbers, run) / max(numbers.size - 1, 1) - 1.0
    degrees = range(1, min(numbers.size, MOST_RUN_SHAPES + 1))
    return np.array([np.polynomial.legendre.Legendre.basis(k)(place) for k in degrees]).reshape(-1, run.size)


def _slow_changes(c: Conditions, limit: int) -> Floats:
    """Return slow courses in time, the most likely first, at most ``limit``."""
    clock, heats = c.clock, list(c.temperatures.values())
    u = 2.0 * (clock - clock.min()) / (np.ptp(clock) or 1.0) - 1.0
    x = 2.0 * (c.position - c.position.min()) / (c.span or 1.0) - 1.0
    columns = [u]
    for heat in heats:
        warm = (heat - heat.mean()) / (np.ptp(heat) or 1.0)
        columns += [warm, warm * x]
    second = 1.5 * u**2 - 0.5
    columns += [second, u * x, np.exp(-8.0 * (u + 1.0)), 2.5 * u**3 - 1.5 * u, second * x]
    if c.both_directions and c.direction is not None:
        columns.append(u * c.direction)
    return np.array(columns[: max(limit, 0)]).reshape(-1, c.rows)
