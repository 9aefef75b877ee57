"""From a measurement file to a data set that effects can explain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from rtec.dataset.dataset import Dataset, same_kind
from rtec.dataset.kind import MeasurementKind, decide
from rtec.dataset.moving_log import moving_log
from rtec.dataset.plausibility import implausible, unseen
from rtec.dataset.speed_table import speed_table
from rtec.dataset.static_test import held_drive, static_test
from rtec.dataset.to_dataset import FEWEST_ROWS
from rtec.effects import LIBRARY, Library
from rtec.errors import FileFormatError
from rtec.metrology import AxisFacts, ColumnChoices, Measurement, read_measurement
from rtec.metrology.tables.choices import NO_CHOICES

_OF_TEST = ("run", "direction", "target", "actual", "deviation")
_PERIODS = ("screw_pitch", "scale_signal_period", "counts_per_rev")
_LARGEST = 1e12  # in a unit inside: squares and sums of such numbers stay finite


def load_dataset(
    path_or_measurement: str | Path | Measurement,
    *,
    observe: str | None = None,
    like: Dataset | None = None,
    facts: Mapping[str, str] | None = None,
    choices: ColumnChoices = NO_CHOICES,
    library: Library = LIBRARY,
) -> Dataset:
    r"""Return the data set that a measurement holds.

    Parameters
    ----------
    path_or_measurement
        A measurement in any form that `rtec.metrology.read_measurement` knows, or what was read from one.
    observe
        Quantity to be explained; None for that of ``like``, else ``deviation`` where it is known, else the one column
        of force, current, torque or voltage.
    like
        The data set of the training, where this is another file to score on: the same preparation, units and columns.
    facts
        ``counts_per_rev``, ``screw_pitch``, ``scale_signal_period``, ``reference_temperature`` with their units: they
        go before what the file says.
    choices
        What the user says of the columns of the file.
    library
        The effects that may explain it, with those that somebody wrote.

    Raises
    ------
    FileFormatError
        The file is no measurement, has fewer than three rows, numbers above 1e12, or nothing to explain, mixes
        lengths and angles, its time runs backwards, a fact is no quantity of its dimension, or units or columns are
        not those of ``like``.
    ArgumentError
        ``observe`` or an option of ``facts`` is wrong.

    Notes
    -----
    Positions are in mm, degrees, or counts of unknown size; without a position, time is the coordinate, and without
    either a velocity makes the file a table of readings at rest, all at place 0. `rtec.dataset.kind` tells the kinds
    of files apart, and each has a pipeline of its own; the ``notes`` say what was done to this file.

    The direction of a reading at rest is its column, or the sign of the motion to it. Where no column numbers the
    runs, but whole passes over the same conditions follow each other, or the axis returns in one go between passes in
    one direction, each pass is a run.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "x.csv"
    >>> _ = file.write_text("# screw_pitch: 0.25 inch\nrun,target_mm,deviation_um\n1,0,1\n1,5,2\n2,0,1.5\n2,5,2\n")
    >>> data = load_dataset(file)
    >>> data.observe, data.units.position, data.conditions.direction.tolist(), data.cell.tolist()
    ('deviation', 'mm', [1.0, 1.0, 1.0, 1.0], [0, 1, 0, 1])
    """
    measurement = measurement_of(path_or_measurement, choices).in_order_of_time()
    data = replace(_prepared(measurement, observe, like, facts), library=library)
    at_targets = data.coordinate == "target" and not data.conditions.moving and data.rows == measurement.rows
    if data.observe != "deviation" or not at_targets:
        return data
    return replace(data, warnings=implausible(measurement, data))


def positioning_warnings(measurement: Measurement, facts: Mapping[str, str] | None = None) -> tuple[str, ...]:
    """Return what speaks against a positioning test of three readings at least, in sentences with line and column.

    Only targets, deviations, directions and runs are looked at: other columns and a clock that runs back, which a
    search refuses, do not matter. ``facts``, and errors, are as of `load_dataset`.
    """
    if measurement.rows < FEWEST_ROWS:
        return ()
    known = {name: column for name, column in measurement.columns.items() if name in _OF_TEST}
    linear = any(column.unit == "mm" for column in known.values())
    said = {name: text for name, text in measurement.facts.items() if name in _PERIODS[0 if linear else 1 :]}
    bare = replace(measurement, columns=known, facts=said, unknown={})
    data = _prepared(bare, "deviation", None, facts)
    return (*implausible(measurement, data), *unseen(measurement, data))


def _prepared(
    measurement: Measurement, observe: str | None, like: Dataset | None, facts: Mapping[str, str] | None
) -> Dataset:
    if measurement.rows < FEWEST_ROWS:
        problem = f"{measurement.rows} rows" if measurement.rows > 1 else "one row"
        raise FileFormatError(measurement.source, None, problem, f"at least {FEWEST_ROWS} readings")
    axis = AxisFacts(source=measurement.source, said=measurement.facts, given=facts or {})
    kind, *rows = decide(measurement, axis, observe, like)
    match kind:
        case MeasurementKind.STATIC_TEST:
            data = static_test(*rows)
        case MeasurementKind.HELD_DRIVE:
            data = held_drive(*rows)
        case MeasurementKind.MOVING_LOG:
            data = moving_log(rows.pop(), like)  # nothing holds long columns that it has replaced
        case MeasurementKind.SPEED_TABLE:
            data = speed_table(*rows)
    return data if like is None else same_kind(data, like)


def measurement_of(given: str | Path | Measurement, choices: ColumnChoices = NO_CHOICES) -> Measurement:
    """Return what is in a file; refuse numbers too large to square."""
    measurement = given if isinstance(given, Measurement) else read_measurement(given, choices)
    for column in measurement.columns.values():
        too_large = np.flatnonzero(~(np.abs(column.values) <= _LARGEST))
        if too_large.size:
            row, allowed = int(too_large[0]), f"at most {_LARGEST:g} in size"
            problem = f"{column.heading} is {column.values[row]:g}"
            raise FileFormatError(measurement.source, measurement.line_of(row), problem, allowed)
    return measurement
