"""From a measurement file to a data set that effects can explain."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from rtec.dataset.at_rest import conditions_of, prepare_at_rest, run_clocks, velocity_of
from rtec.dataset.axis_facts import AxisFacts
from rtec.dataset.dataset import Dataset
from rtec.dataset.drive_signals import Resample
from rtec.dataset.log_rows import leave_out_transient, prepare_log
from rtec.dataset.moving_log import is_moving, unwrapped
from rtec.dataset.observed import (
    Positions,
    coordinate_of,
    deviation_of,
    observable_of,
    observed_quantity,
    positions_of,
)
from rtec.dataset.repeats import blocks_of, cells_of
from rtec.dataset.rows import Rows
from rtec.dataset.same_kind import same_kind
from rtec.effects import Units
from rtec.effects.conditions import Conditions, Floats, distance_since_reversal
from rtec.errors import FileFormatError
from rtec.metrology import (
    Measurement,
    is_laser_file,
    measurement_of_readings,
    read_laser_file,
    read_measurement,
)
from rtec.metrology.text_file import read_text

FEWEST_ROWS = 3
"""Below, nothing at all can be told from noise."""
LARGEST = 1e12
"""Largest number in a unit inside: squares and sums of such numbers stay finite."""
_ROOM_DEGC = 20.0


def load_dataset(
    path_or_measurement: str | Path | Measurement,
    *,
    observe: str | None = None,
    like: Dataset | None = None,
    facts: Mapping[str, str] | None = None,
) -> Dataset:
    r"""Return the data set that a measurement holds.

    Parameters
    ----------
    path_or_measurement
        A measurement file (CSV), a laser file, or what was read from one.
    observe
        Quantity to be explained; None for that of ``like``, else ``deviation`` where it is known, else the one column
        of force, current, torque or voltage.
    like
        The data set of the training, where this is another file to score on: the same preparation, units and columns.
    facts
        ``counts_per_rev``, ``screw_pitch``, ``scale_signal_period``, ``reference_temperature`` with their units: they
        go before what the file says.

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
    Positions are in mm, degrees, or counts of unknown size; without a position, time is the coordinate. What tells a
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
    >>> data.observe, data.units.position, data.conditions.direction.tolist(), data.cell.tolist(), data.held_out_by
    ('deviation', 'mm', [1.0, 1.0, 1.0, 1.0], [0, 1, 0, 1], 'run')
    """
    measurement = _measurement(path_or_measurement)
    if measurement.rows < FEWEST_ROWS:
        problem = f"{measurement.rows} rows" if measurement.rows > 1 else "one row"
        raise FileFormatError(measurement.source, None, problem, f"at least {FEWEST_ROWS} readings")
    _refuse_monsters(measurement)
    axis = AxisFacts(measurement=measurement, given=facts or {})
    positions = positions_of(measurement, axis)
    quantity = observed_quantity(measurement, observe if observe is not None or like is None else like.observe)
    rows, observed_unit, moving = _rows(measurement, positions, quantity, like)
    resample = cutoff_hz = None
    if moving:
        leave_out_transient(rows)
        evenly = like is None or like.cutoff_hz is not None
        resample, cutoff_hz = prepare_log(rows, None if like is None else like.cutoff_hz, evenly)
    else:
        prepare_at_rest(rows)
    if len(rows) < FEWEST_ROWS:
        raise FileFormatError(measurement.source, None, f"{len(rows)} rows are left", f"at least {FEWEST_ROWS}")
    conditions = _conditions(rows, axis, positions, moving)
    data = _dataset(rows, conditions, observed_unit, resample, cutoff_hz)
    return data if like is None else same_kind(data, like)


def _measurement(given: str | Path | Measurement) -> Measurement:
    if isinstance(given, Measurement):
        return given
    if is_laser_file(read_text(given)):
        readings = measurement_of_readings(read_laser_file(given), {})
        return Measurement(source=str(given), facts={}, columns=readings.columns, unknown={})
    return read_measurement(given)


def _refuse_monsters(measurement: Measurement) -> None:
    for column in measurement.columns.values():
        size = np.abs(column.values)
        if not size.max() <= LARGEST:
            row = int(np.flatnonzero(~(size <= LARGEST))[0])
            problem, allowed = f"{column.heading} is {column.values[row]:g}", f"at most {LARGEST:g} in size"
            raise FileFormatError(measurement.source, measurement.line_of(row), problem, allowed)


def _rows(
    measurement: Measurement, positions: Positions, quantity: str, like: Dataset | None
) -> tuple[Rows, str, bool]:
    """Return the readings, the unit inside of what is observed, and whether they are a log of a moving axis."""
    columns = measurement.columns
    coordinate = coordinate_of(quantity, positions, None if like is None else like.coordinate)
    run = columns["run"].values.astype(np.int64) if "run" in columns else np.ones(measurement.rows, dtype=np.int64)
    time_s = columns["time"].values if "time" in columns else None
    position = _position(measurement, positions, coordinate)
    has_velocity = "velocity" in columns and quantity != "velocity"
    # where time is the coordinate, only a column can say that something moves
    moving = (has_velocity or coordinate != "time") and is_moving(time_s, position, run, has_velocity)
    if moving and positions.turn is not None:
        positions = _without_wraps(positions, positions.turn)
        position = _position(measurement, positions, coordinate)
    observed, unit = _observed(measurement, positions, quantity)
    rows = Rows(
        measurement=measurement,
        observe=quantity,
        coordinate=coordinate,
        position_unit="s" if coordinate == "time" else positions.unit,
        position=position,
        observed=observed,
        run=run,
        time_s=time_s,
        direction=columns["direction"].values if "direction" in columns else None,
        temperatures={
            name: column.values
            for name, column in columns.items()
            if name.startswith("temperature") and name != quantity
        },
        unknown={
            name: values.astype(np.float64)
            for name, values in measurement.unknown.items()
            if values.dtype.kind == "f"
        },
        notes=list(positions.notes),
    )
    if has_velocity:
        rows.velocity = velocity_of(rows)
    if time_s is not None and (moving or "run" in columns or coordinate == "time"):
        run_clocks(rows)
    _name_what_is_not_used(rows, moving)
    return rows, unit, moving


def _position(measurement: Measurement, positions: Positions, coordinate: str) -> Floats:
    if coordinate != "time":
        found: Floats = getattr(positions, coordinate)
        return found
    if "time" in measurement.columns:
        return measurement.columns["time"].values
    problem = "neither a position nor a time"
    raise FileFormatError(
        measurement.source, None, problem, "a column target_mm, actual_mm or time_s (or other units)"
    )


def _without_wraps(positions: Positions, turn: float) -> Positions:
    target, actual = (None if x is None else unwrapped(x, turn) for x in (positions.target, positions.actual))
    notes, deviation = positions.notes, positions.deviation
    if target is not positions.target or actual is not positions.actual:
        notes = (*notes, "the position jumps by a turn where the single-turn counter starts again: made continuous")
        if target is not None and actual is not None and deviation is None:
            deviation = (actual - target + turn / 2) % turn - turn / 2
    return Positions(target=target, actual=actual, deviation=deviation, unit=positions.unit, notes=notes)


def _observed(measurement: Measurement, positions: Positions, quantity: str) -> tuple[Floats, str]:
    """Return what is explained, with its unit inside."""
    if quantity == "deviation":
        deviation = deviation_of(positions)
        if deviation is None:
            raise ValueError("no deviation")
        return deviation, positions.unit
    if quantity == "actual" and positions.actual is not None:
        return positions.actual, positions.unit
    column = measurement.columns[quantity]
    return column.values, column.unit


def _name_what_is_not_used(rows: Rows, moving: bool) -> None:
    """Note the columns that nothing looks at."""
    used = {"run", "direction", "time", "deviation", "velocity", rows.observe, rows.coordinate, *rows.temperatures}
    if rows.observe == "deviation" and "deviation" not in rows.measurement.columns:
        used |= {"target", "actual"}
    if not moving:
        used.add("feed")
    idle = [column.heading for name, column in rows.measurement.columns.items() if name not in used]
    text = [name for name in rows.measurement.unknown if name not in rows.unknown]
    if idle:
        rows.notes.append(f"not used: {', '.join(idle)}")
    if rows.unknown:
        rows.notes.append(f"of no known quantity, looked at but used by no effect: {', '.join(rows.unknown)}")
    if text:
        rows.notes.append(f"not used, because not all of it are numbers: {', '.join(text)}")


def _conditions(rows: Rows, axis: AxisFacts, positions: Positions, moving: bool) -> Conditions:
    unit = rows.position_unit
    since = None
    if rows.held_direction is not None and rows.coordinate != "time":
        since = distance_since_reversal(rows.position, rows.held_direction, rows.run)
    pitch, signal = axis.period("screw_pitch", unit), axis.period("scale_signal_period", unit)
    for key, period in (("screw_pitch", pitch), ("scale_signal_period", signal)):
        if axis.text(key) is not None and period is None:
            what = "time" if unit == "s" else "counts of unknown size"
            rows.notes.append(f"{key}: {axis.text(key)} is not used, because positions are {what}")
    if rows.time_s is None:
        rows.notes.append("no time column: row order counts as time")
    reference = axis.reference_temperature_degc()
    return Conditions(
        position=rows.position,
        position_unit=unit,
        run=rows.run,
        direction=rows.direction,
        time_s=rows.time_s,
        velocity=rows.velocity,
        acceleration=rows.acceleration,
        since_reversal=since,
        temperatures=MappingProxyType(rows.temperatures),
        reference_temperature_degc=_ROOM_DEGC if reference is None else reference,
        screw_pitch=pitch,
        signal_period=signal,
        revolution=positions.turn if rows.coordinate != "time" else None,
        moving=moving,
    )


def _dataset(
    rows: Rows, conditions: Conditions, unit: str, resample: Resample | None, cutoff_hz: float | None
) -> Dataset:
    observed, run, unknown = rows.observed, rows.run, rows.unknown
    if resample is not None:
        observed, run = resample.apply_rows(observed), run[resample.kept]
        unknown = {name: resample.apply_rows(values) for name, values in unknown.items()}
    cell = np.full(observed.size, -1, dtype=np.int64)
    if not conditions.moving and rows.coordinate != "time":
        cell = cells_of(conditions_of(rows), run)
    block, held_out_by = blocks_of(run)
    return Dataset(
        source=rows.measurement.source,
        observe=rows.observe,
        observable=observable_of(rows.observe),
        units=Units(unit, rows.position_unit, conditions.clock_unit),
        observed=observed,
        conditions=conditions,
        cell=cell,
        block=block,
        notes=tuple(rows.notes),
        unknown=tuple(unknown.items()),
        held_out_by=held_out_by,
        resample=resample,
        coordinate=rows.coordinate,
        cutoff_hz=cutoff_hz,
    )
