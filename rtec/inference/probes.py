"""What an error may depend on that no effect of the library knows: generic columns that compete with the effects.

A probe is no name. Where one earns its place beside all effects, something is missing from the library, and the probe
says what that depends on; where none could compete, an effect would be named that only resembles it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.effects import Effect, Floats, Observable, Shape, Units, effect_named
from rtec.effects._heat import LEAST_CHANGE_K, heats_of
from rtec.effects._smooth import smooth_columns
from rtec.effects.conditions import Conditions, heading_name
from rtec.effects.protocol import Amplitude

FORCE_MAP, GRAVITY = effect_named("force_map"), effect_named("gravity")
FORCE_NODES = (5, 9, 17)
RUN_NODES = (5, 12)
TIME_NODES = (9, 17, 33)
READINGS_A_NODE = 3
"""In time, at least: noise has no fewer."""
FEWEST_RUNS, MOST_RUNS, MOST_PASSES = 3, 10, 20
"""Runs, or passes, each of which may have a course of its own."""
FEWEST_PLACES, MOST_PLACES = 12, 64
"""Of a table that competes with maps and waves: of fewer places a map is a table itself."""
COPY = 0.99
"""Correlation with the target, the run, the direction or the row from which on a column is a copy of it."""
MOST_COLUMNS = 12
"""Of an effect, each of which may change by itself; of more only the sum."""


@dataclass(frozen=True, eq=False)
class Probe(Effect):
    """Generic columns."""

    name: str
    """Stands for it in a search."""
    depends_on: tuple[str, ...]
    """What it is a function of, for people."""
    table: Floats
    """Of the whole data set that it was made for, shape (rows, columns)."""
    builds_on: frozenset[str] = frozenset()
    """The effect whose change it is, beside which alone it may stand."""
    in_time: bool = False
    """Whether it changes from repeat to repeat."""

    needs = "nothing"
    is_map = True

    def at(self, dataset: Dataset) -> Floats:
        """Return the columns at the rows of its data set, shape (rows, columns)."""
        if dataset.rows != self.table.shape[0]:
            raise ValueError(f"a probe of {self.table.shape[0]} rows for {dataset.rows}")
        return self.table

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return the columns, shape (rows, columns)."""
        return self.table

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return a name for each column."""
        return tuple(Amplitude(f"part_{k}", *units.shown) for k in range(1, self.table.shape[1] + 1))


def probes_of(dataset: Dataset) -> tuple[Probe, ...]:
    """Return the probes that a data set has a place for.

    Columns of no known quantity; for a force temperatures and the position; for a deviation that was measured in
    several runs a course in time, a course of each run along the axis, and a reversal error of each run.
    """
    c = dataset.coordinates
    found = []
    # a deviation that follows a temperature or the heat of a spindle has a name: thermal_shift
    heats = heats_of(c) if dataset.observable is Observable.DRIVE else {}
    used = {name for effect in dataset.library for name in effect.other_columns}
    unknown = (item for item in dataset.unknown if heading_name(item[0]) not in used)
    finite = [(heading, values) for heading, values in unknown if np.isfinite(values).all()]
    strange = [(heading, values) for heading, values in finite if not is_index(values, c)]
    for heading, values in (*heats.items(), *strange):
        least = LEAST_CHANGE_K if heading in heats else 0.0
        if np.isfinite(values).all() and np.ptp(values) > least:
            found.append(Probe(f"any {heading}", (heading,), (values - values.mean())[:, None]))
    if dataset.observable is Observable.DRIVE:
        # a smooth force by position has a name where the data can show it: force_map
        if not c.time_is_coordinate and c.span > 0.0 and FORCE_MAP.untestable(c) is not None:
            for count in FORCE_NODES:
                table = smooth_columns(c.position, np.linspace(c.position.min(), c.position.max(), count).tolist())
                found.append(Probe(f"any position {count}", ("position",), _unnamed(c, table)))
        return tuple(found)
    if c.moving or c.time_is_coordinate:
        return tuple(found)
    found += _tables(dataset)
    found += _courses("run", c.run, c)
    if dataset.has_repeats:  # else time and position are one
        found += _in_time(c)
    if c.direction is not None and c.both_directions:
        found += _courses("pass", dataset.passage, c)
        each = _members(c.run, 2, MOST_RUNS)
        if each.size:
            found.append(Probe("any run and direction", ("direction", "run"), each * c.direction[:, None]))
    return tuple(found)


def is_index(values: Floats, c: Conditions) -> bool:
    """Return whether a column only numbers the readings: it follows the target, the run, the direction or the row.

    Exactly and never back, or in proportion but for a little noise, as a copy does.

    What such a column explains, position, run, direction or time explains.

    Examples
    --------
    >>> x = np.array([0.0, 10.0, 20.0, 0.0, 10.0, 20.0])
    >>> c = Conditions(position=x, position_unit="mm", run=np.array([1, 1, 1, 2, 2, 2]))
    >>> is_index(np.array([1.0, 2.0, 3.0, 1.0, 2.0, 3.0]), c), is_index(np.array([1.0, 3.0, 2.0, 1.0, 2.0, 3.0]), c)
    (True, False)
    >>> is_index(x + np.array([0.2, -0.3, 0.1, -0.1, 0.4, -0.2]), c)
    True
    """
    along = [np.arange(c.rows), c.position, c.run, *([] if c.direction is None else [c.direction])]
    return any(
        _is_monotone(values, one) or (np.ptp(one) > 0.0 and abs(np.corrcoef(values, one)[0, 1]) > COPY)
        for one in (np.asarray(one, dtype=np.float64) for one in along)
    )


def _is_monotone(values: Floats, along: Floats) -> bool:
    """Return whether values are a function of others that never falls, or never rises."""
    order = np.argsort(along, kind="stable")
    steps, same = np.diff(values[order]), np.diff(along[order]) == 0.0
    return not steps[same].any() and bool((steps >= 0.0).all() or (steps <= 0.0).all())


def _unnamed(c: Conditions, table: Floats) -> Floats:
    """Return what of smooth curves has no name: a constant and a weight on an arm have one."""
    names = [np.ones((c.rows, 1))]
    if GRAVITY.untestable(c) is None:
        names.append(GRAVITY.columns(c, GRAVITY.shapes(c)[-1]))
    named = np.hstack(names)
    return table - named @ np.linalg.lstsq(named, table, rcond=None)[0]


def _tables(dataset: Dataset) -> list[Probe]:
    """Return probes with a value of its own for each place, and for each place and direction, where these repeat."""
    c = dataset.coordinates
    if not dataset.has_repeats or not FEWEST_PLACES < c.places.size <= MOST_PLACES or c.whole is not None:
        return []
    each = _members(np.abs(c.position[:, None] - c.places).argmin(axis=1), 1, MOST_PLACES)
    found = [Probe("any place", ("position",), each)]
    if c.direction is not None and c.both_directions:
        both = np.hstack([each, each * c.direction[:, None]])
        found.append(Probe("any place and direction", ("position", "direction"), both))
    return found


def _courses(what: str, number: NDArray[np.int64], c: Conditions) -> list[Probe]:
    """Return probes with a smooth course of its own along the axis for each run, or each pass."""
    each = _members(number, FEWEST_RUNS, MOST_RUNS if what == "run" else MOST_PASSES)
    found = []
    for count in RUN_NODES:
        if each.size and count < c.places.size:
            courses = smooth_columns(c.position, np.linspace(c.places[0], c.places[-1], count).tolist())
            table = np.hstack([courses * one[:, None] for one in each.T])
            found.append(Probe(f"any {what} and position {count}", ("position", "run"), table))
    return found


def _members(number: NDArray[np.int64], fewest: int, most: int) -> Floats:
    """Return 1 where a reading has a number and 0 elsewhere, a column for each number, ascending.

    There is no column where there are fewer or more numbers than these.
    """
    numbers = np.unique(number)
    if not fewest <= numbers.size <= most:
        numbers = numbers[:0]
    found: Floats = (number[:, None] == numbers).astype(np.float64)
    return found


def _in_time(c: Conditions) -> list[Probe]:
    """Return probes with one smooth course in time through all runs, as of the weather; nodes where readings are."""
    counts = [count for count in TIME_NODES if READINGS_A_NODE * count <= c.rows and np.ptp(c.clock) > 0.0]
    nodes = [np.unique(np.quantile(c.clock, np.linspace(0.0, 1.0, count))).tolist() for count in counts]
    return [Probe(f"any time {len(n)}", ("time",), smooth_columns(c.clock, n), in_time=True) for n in nodes]


def changing(dataset: Dataset, effect: Effect, contribution: Floats, columns: Floats) -> tuple[Probe, ...]:
    """Return probes for an effect that changes along the axis, in time, or from run to run.

    Parameters
    ----------
    dataset
        Readings at rest; a log has none of these probes.
    effect, contribution
        What was found, and what it adds to the readings, shape (rows,).
    columns
        Its columns, shape (columns, rows).

    Notes
    -----
    An effect of the library is the same everywhere and always. What grows along the axis, fades in time or is another
    one in each run only resembles it.
    """
    c = dataset.coordinates
    if c.moving:
        return ()
    found, itself = [], frozenset((effect.name,))
    if columns.shape[0] > MOST_COLUMNS:
        columns = contribution[None, :]
    for name, values in (("position", c.position), ("time", c.clock)):
        spread = float(np.std(values))
        if spread > 0.0 and not (name == "position" and (effect.is_map or c.time_is_coordinate)):
            table = (columns * (values - values.mean()) / spread).T
            found.append(Probe(f"any {effect.name} by {name}", (name,), table, itself))
    each = _members(c.run, FEWEST_RUNS, MOST_RUNS)
    if each.size and not effect.in_time:
        # less the mean over the runs: what is the same in all of them is the effect itself
        table = np.vstack([columns * (one - 1.0 / each.shape[1]) for one in each.T]).T
        found.append(Probe(f"any {effect.name} by run", ("run",), table, itself))
    return tuple(found)
