"""From a measurement file to a data set that effects can explain."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from rtec.dataset.at_rest import conditions_of, held_places, merge_bursts, prepare_at_rest, run_clocks, velocity_of
from rtec.dataset.dataset import Dataset, same_kind
from rtec.dataset.drive_signals import Resample, step_of
from rtec.dataset.log_rows import leave_out_transient, prepare_log
from rtec.dataset.moving_log import is_moving
from rtec.dataset.observed import (
    coordinate_of,
    observable_of,
    observed_of,
    observed_quantity,
    position_of,
    without_wraps,
)
from rtec.dataset.passes import passages, passed_again
from rtec.dataset.plausibility import implausible, unseen
from rtec.dataset.repeats import cells_of, place_numbers
from rtec.dataset.rows import Rows
from rtec.dataset.standstill import Ints
from rtec.effects import Units
from rtec.effects.conditions import Conditions, Floats, distance_since_reversal
from rtec.errors import FileFormatError
from rtec.metrology import AxisFacts, ColumnChoices, Measurement, read_measurement
from rtec.metrology.columns import MOST_AXES
from rtec.metrology.tables.choices import NO_CHOICES

_FEWEST_ROWS = 3  # below, nothing at all can be told from noise
_NO_POSITION = {
    "time": "no position: time is the coordinate, and what is periodic in position is periodic in time",
    "velocity": "neither time nor position: each row is a reading of its own, and row order counts as time",
}
_AROUND = {"pressure": "pressure_hpa", "humidity": "humidity_percent", "load": "load"}  # columns and their fields
_SHARED = ("position", "position_unit", "run", "direction", "time_s", "velocity", "acceleration", "moving")
_OF_TEST = ("run", "direction", "target", "actual", "deviation")
_PERIODS = ("screw_pitch", "scale_signal_period", "counts_per_rev")
_SAME_LOAD = 0.01  # of what the loads differ by
_LARGEST = 1e12  # in a unit inside: squares and sums of such numbers stay finite


def load_dataset(
    path_or_measurement: str | Path | Measurement,
    *,
    observe: str | None = None,
    like: Dataset | None = None,
    facts: Mapping[str, str] | None = None,
    choices: ColumnChoices = NO_CHOICES,
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
    either a velocity makes the file a table of readings at rest, all at place 0. What tells a
    log of a moving axis from readings at rest, and what is done to it, say `rtec.dataset.moving_log` and
    `rtec.dataset.log_rows`; everything that was done to this file say its ``notes``.

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
    data = _prepared(measurement, observe, like, facts)
    at_targets = data.coordinate == "target" and not data.conditions.moving and data.rows == measurement.rows
    if data.observe != "deviation" or not at_targets:
        return data
    return replace(data, warnings=implausible(measurement, data))


def positioning_warnings(measurement: Measurement, facts: Mapping[str, str] | None = None) -> tuple[str, ...]:
    """Return what speaks against a positioning test of three readings at least, in sentences with line and column.

    Only targets, deviations, directions and runs are looked at: other columns and a clock that runs back, which a
    search refuses, do not matter. ``facts``, and errors, are as of `load_dataset`.

    Examples
    --------
    >>> from rtec.metrology import Readings, measurement_of_readings
    >>> up, down, runs = [0.0, 8, 17, 30, 41], [41.0, 30, 17, 8, 0], 4
    >>> error = np.random.default_rng(1).normal(0.0, 0.001, 40)
    >>> error[17] = 0.1
    >>> r = Readings(target_mm=(up + down) * 4, deviation_mm=error, direction=([1] * 5 + [-1] * 5) * 4,
    ...              run=np.repeat([1, 2, 3, 4], 10))
    >>> positioning_warnings(measurement_of_readings(r, {}))
    ('reading 18, column deviation: 100 µm is far from the other readings at 17 mm backward: an outlier?',)
    """
    if measurement.rows < _FEWEST_ROWS:
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
    if measurement.rows < _FEWEST_ROWS:
        problem = f"{measurement.rows} rows" if measurement.rows > 1 else "one row"
        raise FileFormatError(measurement.source, None, problem, f"at least {_FEWEST_ROWS} readings")
    axis = AxisFacts(source=measurement.source, said=measurement.facts, given=facts or {})
    rows = _rows(measurement, axis, observe, like)
    resample = cutoff_hz = None
    if rows.moving:
        leave_out_transient(rows)
        rows.moving = not (rows.of_drive and held_places(rows))
    elif rows.of_drive:
        merge_bursts(rows)
    if rows.moving:
        resample, cutoff_hz = prepare_log(rows, like)
    else:
        prepare_at_rest(rows)
    if len(rows) < _FEWEST_ROWS:
        raise FileFormatError(measurement.source, None, f"{len(rows)} rows are left", f"at least {_FEWEST_ROWS}")
    data = _dataset(rows, _conditions(rows, axis), resample, cutoff_hz)
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


def _rows(measurement: Measurement, axis: AxisFacts, observe: str | None, like: Dataset | None) -> Rows:
    """Return the readings of a file, whose log is made continuous and whose clock goes on from run to run."""
    columns = measurement.columns
    positions = measurement.positions(axis)
    quantity = observed_quantity(measurement, observe if observe is not None or like is None else like.observe)
    coordinate = coordinate_of(measurement, positions, quantity, None if like is None else like.coordinate)
    run = columns["run"].values.astype(np.int64) if "run" in columns else np.ones(measurement.rows, dtype=np.int64)
    time_s = columns["time"].values if "time" in columns else None
    position, unit = position_of(measurement, positions, coordinate)
    has_velocity = "velocity" in columns and quantity != "velocity"
    # where time is the coordinate, only a column can say that something moves
    moving = coordinate != "velocity" and (has_velocity or coordinate != "time")
    moving = moving and is_moving(time_s, position, run, has_velocity)
    if moving:
        positions = without_wraps(positions)
        position, _ = position_of(measurement, positions, coordinate)
    observed, observed_unit = observed_of(measurement, positions, quantity)
    heat = [name for name in columns if name.startswith("temperature") and name != quantity]
    numeric = {name: values for name, values in measurement.unknown.items() if values.dtype.kind == "f"}
    rows = Rows(
        measurement=measurement,
        observe=quantity,
        coordinate=coordinate,
        position_unit=unit,
        observed_unit=observed_unit,
        moving=moving,
        turn=None if coordinate in _NO_POSITION else positions.turn,
        position=position,
        observed=observed,
        run=run,
        time_s=time_s,
        direction=columns["direction"].values if "direction" in columns else None,
        feed=np.abs(columns["feed"].values) if "feed" in columns and not moving and quantity != "feed" else None,
        temperatures={name: columns[name].values for name in heat},
        unknown={name: values.astype(np.float64) for name, values in numeric.items()},
        notes=[*measurement.notes, *positions.notes],
    )
    for name, item in _AROUND.items():
        if name in columns and name != quantity:
            setattr(rows, item, columns[name].values)
    if has_velocity:
        rows.velocity = velocity_of(rows)
    if coordinate in _NO_POSITION:
        rows.notes.insert(0, _NO_POSITION[coordinate])
    if moving or "run" in columns or coordinate == "time":
        run_clocks(rows)
    _name_what_is_not_used(rows)
    return rows


def _name_what_is_not_used(rows: Rows) -> None:
    used = {"run", "direction", "time", "deviation", "velocity", rows.observe, rows.coordinate, *rows.temperatures}
    used |= {name for name, item in _AROUND.items() if getattr(rows, item) is not None}
    if rows.observe == "deviation" and "deviation" not in rows.measurement.columns:
        used |= {"target", "actual"}
    if not rows.moving:
        used.add("feed")
    idle = [column.heading for name, column in rows.measurement.columns.items() if name not in used]
    text = [name for name in rows.measurement.unknown if name not in rows.unknown]
    others = rows.other_axes
    strange = [name for name in rows.unknown if name not in others]
    unused = {"not used": idle, "of no known quantity, looked at but used by no effect": strange}
    unused["positions of other axes, used by no effect but by rtec train"] = list(others)
    unused["not used, because not all of it are numbers"] = text
    rows.notes += [f"{what}: {', '.join(names)}" for what, names in unused.items() if names]


def _conditions(rows: Rows, axis: AxisFacts) -> Conditions:
    unit, since, periods = rows.position_unit, None, {}
    if rows.held_direction is not None and rows.coordinate not in _NO_POSITION:
        since = distance_since_reversal(rows.position, rows.held_direction, rows.run, moving=rows.moving)
    for key in ("screw_pitch", "scale_signal_period"):
        periods[key] = axis.period(key, unit)
        if axis.text(key) is not None and periods[key] is None:
            what = "time" if unit == "s" else "counts of unknown size"
            rows.notes.append(f"{key}: {axis.text(key)} is not used, because positions are {what}")
    if rows.time_s is None and rows.coordinate != "velocity":
        rows.notes.insert(0, "no time column: row order counts as time")
    return Conditions(
        **{name: getattr(rows, name) for name in (*_SHARED, *_AROUND.values())},
        since_reversal=since,
        temperatures=MappingProxyType(rows.temperatures),
        reference_temperature_degc=axis.reference_temperature_degc(),
        screw_pitch=periods["screw_pitch"],
        signal_period=periods["scale_signal_period"],
        revolution=rows.turn,
    )


def _dataset(rows: Rows, conditions: Conditions, resample: Resample | None, cutoff_hz: float | None) -> Dataset:
    observed, unknown = rows.observed, rows.unknown
    if resample is not None:
        observed = resample.apply(observed)
        unknown = {name: resample.apply(values) for name, values in unknown.items()}
    if rows.moving:
        passage, cell = passed_again(rows, resample, observed)
    elif rows.coordinate == "time":
        passage, cell = passages(rows.run, None), np.full(len(rows), -1, dtype=np.int64)
    else:
        stated = rows.position if "direction" in rows.measurement.columns else None
        passage = passages(rows.run, rows.direction, stated)
        cell = cells_of(conditions_of(rows), passage)
    if conditions.load is not None:
        kept = slice(None) if resample is None else resample.kept
        cell = _under_one_load(cell, passage, conditions.load[kept])
    load_unit = "" if rows.load is None else rows.measurement.columns["load"].unit
    return Dataset(
        source=rows.measurement.source,
        observe=rows.observe,
        observable=observable_of(rows.observe),
        units=Units(rows.observed_unit, rows.position_unit, conditions.clock_unit, load_unit),
        observed=observed,
        conditions=conditions,
        cell=cell,
        stands_for=rows.stands_for if resample is None else resample.stands_for,
        passage=passage,
        notes=tuple(rows.notes),
        unknown=tuple(unknown.items()),
        resample=resample,
        coordinate=rows.coordinate,
        cutoff_hz=cutoff_hz,
        rounding=step_of(rows.observed),
        axis=_axis_of(rows.measurement),
    )


def _axis_of(measurement: Measurement) -> int | None:
    """Return the number of the axis that a file is of; a letter names an axis, but tells no number."""
    text = measurement.facts.get("axis", "").strip()
    if not re.fullmatch(r"[+-]?[0-9.]+", text, re.ASCII):
        return None
    if text in map(str, range(1, MOST_AXES + 1)):
        return int(text)
    raise FileFormatError(measurement.source, None, f"axis: {text}", f"a number from 1 to {MOST_AXES}")


def _under_one_load(cell: Ints, passage: Ints, load: Floats) -> Ints:
    """Return the cells of readings that were taken under the same load as well: others repeat nothing."""
    same = place_numbers(load, _SAME_LOAD * float(np.ptp(load)))
    return cells_of(np.where(cell >= 0, cell * (int(same.max()) + 1) + same, -1), passage)
