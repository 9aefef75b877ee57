"""What an error may depend on that no effect of the library knows: generic columns that compete with the effects.

A probe is no name. Where one earns its place beside all effects, something is missing from the library, and the probe
says what that depends on; where none could compete, an effect would be named that only resembles it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.effects import Effect, Floats, Observable, Shape, Units, effect_named
from rtec.effects._heat import LEAST_CHANGE_K
from rtec.effects._smooth import smooth_columns
from rtec.effects.conditions import Conditions
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
MOST_COLUMNS = 12
"""Of an effect, each of which may change by itself; of more only the sum."""


@dataclass(frozen=True, eq=False)
class Probe(Effect):
    """Generic columns.

    Parameters
    ----------
    label
        Stands for it in a search.
    depends_on
        What it is a function of, for people.
    table
        Of the whole data set that it was made for, shape (rows, columns).
    """

    label: str
    depends_on: tuple[str, ...]
    table: Floats
    rows: int

    name = "probe"
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


def _probe(label: str, depends_on: Sequence[str], table: Floats, *of: str, in_time: bool = False) -> Probe:
    """Return a probe; ``of`` names the effect whose change it is, beside which alone it may stand."""
    probe = Probe(label, tuple(depends_on), table, table.shape[0])
    object.__setattr__(probe, "name", label)
    object.__setattr__(probe, "builds_on", frozenset(of))
    object.__setattr__(probe, "in_time", in_time)
    return probe


def probes_of(dataset: Dataset) -> tuple[Probe, ...]:
    """Return the probes that a data set has a place for.

    Columns of no known quantity; for a force temperatures and the position; for a deviation that was measured in
    several runs a course in time, a course of each run along the axis, and a reversal error of each run.
    """
    c = dataset.coordinates
    found = []
    # a deviation that follows a temperature has a name: thermal_shift
    heats = c.temperatures if dataset.observable is Observable.DRIVE else {}
    for heading, values in (*heats.items(), *dataset.unknown):
        least = LEAST_CHANGE_K if heading in heats else 0.0
        if np.isfinite(values).all() and np.ptp(values) > least:
            shifted = values - values.mean()
            found.append(_probe(f"any {heading}", [heading], shifted[:, None]))
    if dataset.observable is Observable.DRIVE:
        # a smooth force by position has a name where the data can show it: force_map
        if not c.time_is_coordinate and c.span > 0.0 and FORCE_MAP.untestable(c) is not None:
            for count in FORCE_NODES:
                table = smooth_columns(c.position, np.linspace(c.position.min(), c.position.max(), count).tolist())
                found.append(_probe(f"any position {count}", ["position"], _unnamed(c, table)))
        return tuple(found)
    if c.moving or c.time_is_coordinate:
        return tuple(found)
    found += _tables(dataset)
    found += _courses("run", c.run, c)
    if dataset.has_repeats:  # else time and position are one
        found += _in_time(c)
    if c.direction is not None and c.both_directions:
        found += _courses("pass", dataset.passage, c)
        numbers, run = np.unique(c.run, return_inverse=True)
        if 1 < numbers.size <= MOST_RUNS:
            each = (run == np.arange(numbers.size)[:, None]).astype(np.float64)
            found.append(_probe("any run and direction", ["direction", "run"], (each * c.direction).T))
    return tuple(found)


def _unnamed(c: Conditions, table: Floats) -> Floats:
    """Return what of smooth curves has no name: a constant and a weight on an arm have one."""
    names = [np.ones((c.rows, 1))]
    if GRAVITY.untestable(c) is None:
        names.append(GRAVITY.columns(c, GRAVITY.shapes(c)[-1]))
    named = np.hstack(names)
    found: Floats = table - named @ np.linalg.lstsq(named, table, rcond=None)[0]
    return found


def _tables(dataset: Dataset) -> list[Probe]:
    """Return probes with a value of its own for each place, and for each place and direction, where these repeat."""
    c = dataset.coordinates
    if not dataset.has_repeats or not FEWEST_PLACES < c.places.size <= MOST_PLACES or c.whole is not None:
        return []
    place = np.abs(c.position[:, None] - c.places).argmin(axis=1)
    each = (place[:, None] == np.arange(c.places.size)).astype(np.float64)
    found = [_probe("any place", ["position"], each)]
    if c.direction is not None and c.both_directions:
        found.append(
            _probe(
                "any place and direction", ["position", "direction"], np.hstack([each, each * c.direction[:, None]])
            )
        )
    return found


def _courses(what: str, number: NDArray[np.int64], c: Conditions) -> list[Probe]:
    """Return probes with a smooth course of its own along the axis for each run, or each pass."""
    numbers, place = np.unique(number, return_inverse=True)
    if not FEWEST_RUNS <= numbers.size <= (MOST_RUNS if what == "run" else MOST_PASSES):
        return []
    each = (place == np.arange(numbers.size)[:, None]).astype(np.float64)
    found = []
    for count in RUN_NODES:
        if count < c.places.size:
            courses = smooth_columns(c.position, np.linspace(c.places[0], c.places[-1], count).tolist())
            table = np.hstack([courses * one[:, None] for one in each])
            found.append(_probe(f"any {what} and position {count}", ["position", "run"], table))
    return found


def _in_time(c: Conditions) -> list[Probe]:
    """Return probes with one smooth course in time through all runs, as of the weather; nodes where readings are."""
    counts = [count for count in TIME_NODES if READINGS_A_NODE * count <= c.rows and np.ptp(c.clock) > 0.0]
    nodes = [np.unique(np.quantile(c.clock, np.linspace(0.0, 1.0, count))).tolist() for count in counts]
    return [_probe(f"any time {len(n)}", ["time"], smooth_columns(c.clock, n), in_time=True) for n in nodes]


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
    found = []
    if columns.shape[0] > MOST_COLUMNS:
        columns = contribution[None, :]
    for name, values in (("position", c.position), ("time", c.clock)):
        spread = float(np.std(values))
        if spread > 0.0 and not (name == "position" and (effect.is_map or c.time_is_coordinate)):
            table = (columns * (values - values.mean()) / spread).T
            found.append(_probe(f"any {effect.name} by {name}", [name], table, effect.name))
    numbers, run = np.unique(c.run, return_inverse=True)
    if FEWEST_RUNS <= numbers.size <= MOST_RUNS and not effect.in_time:
        each = (run == np.arange(numbers.size)[:, None]).astype(np.float64)
        # less the mean over the runs: what is the same in all of them is the effect itself
        table = np.vstack([columns * (one - 1.0 / numbers.size) for one in each]).T
        found.append(_probe(f"any {effect.name} by run", ["run"], table, effect.name))
    return tuple(found)
