"""From a measurement to rows: one position, what is observed, one clock, and what else the file tells."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rtec.dataset.observed import observed_of, position_of
from rtec.dataset.rows import Rows
from rtec.dataset.standstill import Ints
from rtec.effects.conditions import Floats
from rtec.errors import FileFormatError
from rtec.metrology import AxisFacts, Measurement, Positions
from rtec.metrology.columns import channel_of_heading, quantity_of_heading

NO_POSITION = {
    "time": "no position: time is the coordinate, and what is periodic in position is periodic in time",
    "velocity": "neither time nor position: each row is a reading of its own, and row order counts as time",
    "temperature": "neither time nor position: each row is a reading of its own",
}
"""Coordinates that are no position, with a note for each."""


def run_numbers(measurement: Measurement) -> Ints:
    """Return the number of the run of each row, 1 where no column tells it."""
    column = measurement.columns.get("run")
    return np.ones(measurement.rows, dtype=np.int64) if column is None else column.values.astype(np.int64)


def rows_of(
    measurement: Measurement, axis: AxisFacts, observe: str, coordinate: str, positions: Positions, *, in_motion: bool
) -> Rows:
    """Return the readings of a file, whose clock goes on from run to run."""
    columns = {name: column.values for name, column in measurement.columns.items()}
    position, unit = position_of(measurement, positions, coordinate)
    observed, observed_unit = observed_of(measurement, positions, observe)
    beside = {name: values for name, values in columns.items() if name != observe}
    others = _other_channels(measurement, observe)
    strange = {name: values for name, values in measurement.unknown.items() if name not in others}
    numeric = {name: values for name, values in strange.items() if values.dtype.kind == "f"}
    rows = Rows(
        measurement=measurement,
        axis=axis,
        observe=observe,
        coordinate=coordinate,
        position_unit=unit,
        observed_unit=observed_unit,
        turn=None if coordinate in NO_POSITION else positions.turn,
        position=position,
        observed=observed,
        run=run_numbers(measurement),
        block=_said_blocks(measurement, axis),
        time_s=columns.get("time"),
        direction=columns.get("direction"),
        feed=np.abs(beside["feed"]) if "feed" in beside and not in_motion else None,
        pressure_hpa=beside.get("pressure"),
        humidity_percent=beside.get("humidity"),
        load=beside.get("load"),
        spindle_rpm=beside.get("spindle"),
        temperatures={name: values for name, values in beside.items() if name.startswith("temperature")},
        unknown={name: values.astype(np.float64, copy=False) for name, values in numeric.items()},
        notes=(*measurement.notes, *positions.notes),
    )
    if "velocity" in beside:
        rows = _with_velocity(rows)
    if coordinate in NO_POSITION:
        rows = replace(rows, notes=(NO_POSITION[coordinate], *rows.notes))
    if in_motion or "run" in columns or coordinate == "time":
        rows = one_clock(rows)
    return replace(rows, notes=(*rows.notes, *_not_used(rows, in_motion=in_motion)))


def _said_blocks(measurement: Measurement, axis: AxisFacts) -> Ints | None:
    """Return the number of the block of each row, where a column is said to tell it: its change starts a block."""
    if (name := axis.given.get("blocks")) is None:
        return None
    columns = {column.heading: column.values for column in measurement.columns.values()} | dict(measurement.unknown)
    columns |= {quantity: column.values for quantity, column in measurement.columns.items()}
    values = next((values for key, values in columns.items() if key.lower() == name.strip().lower()), None)
    if values is None:
        headings = [*(column.heading for column in measurement.columns.values()), *measurement.unknown]
        raise axis.wrong("blocks", f"the name of a column ({', '.join(headings)})")
    changed: Ints = np.cumsum(np.append(False, values[1:] != values[:-1]))
    return changed


def _other_channels(measurement: Measurement, observe: str) -> list[str]:
    """Return the headings of channels in the unit of the one observed: they show the same, and explain nothing."""
    column = measurement.columns.get(observe)
    if column is None or quantity_of_heading(column.heading) is not None:
        return []
    every = measurement.channels().values()
    return [heading for heading in every if channel_of_heading(heading)[1].inside == column.unit]


def _with_velocity(rows: Rows) -> Rows:
    """Take the velocity from its column, with the sign of the motion where that holds speeds only."""
    refuse_other_unit(rows, "velocity")
    velocity, way = rows.measurement.columns["velocity"].values, rows.direction
    if way is None and rows.coordinate != "time":
        way = np.sign(np.gradient(rows.position))
    if way is None or velocity.min() < 0.0 or not ((way < 0.0) & (velocity > 0.0)).any():
        return replace(rows, velocity=velocity)
    note = "the velocity column is never negative although the axis reverses: it takes the sign of the motion"
    return replace(rows, velocity=velocity * way, notes=(*rows.notes, note))


def refuse_other_unit(rows: Rows, quantity: str) -> None:
    """Refuse a column of speed that is not in the unit of the position."""
    unit = rows.measurement.columns[quantity].unit
    if rows.coordinate != "time" and unit != f"{rows.position_unit}_s":
        problem = f"units mixed: {quantity} in {unit.replace('_', '/')}, positions in {rows.position_unit}"
        allowed = "both linear or both angular"
        if rows.position_unit == "count":
            allowed += "; a line '# counts_per_rev: 8192' turns counts into angles"
        raise FileFormatError(rows.measurement.source, None, problem, allowed)


def one_clock(rows: Rows) -> Rows:
    """Give all runs one clock, seconds since the first reading, which never goes back; refuse a run that does."""
    if rows.time_s is None:
        return rows
    time_s, steps, same_run = rows.time_s, np.diff(rows.time_s), rows.run[1:] == rows.run[:-1]
    back = clock_runs_back(time_s, rows.run)
    if back.size:
        row = int(back[0])
        problem = f"time runs backwards: {time_s[row]:g} s after {time_s[row - 1]:g} s"
        allowed = "times that do not decrease within a run (a column 'run' where each run has a clock of its own)"
        raise FileFormatError(rows.measurement.source, rows.measurement.line_of(row), problem, allowed)
    if not (steps < 0).any():
        return replace(rows, time_s=time_s - time_s[0])
    interval = float(np.median(steps[same_run])) if same_run.any() else 1.0
    time_s = np.append(0.0, np.cumsum(np.where(same_run, steps, interval)))
    note = (
        f"the clock of the file starts again with each run: runs follow each other after {interval:.4g} s, the "
        "median interval, although the true pause between them is not known"
    )
    position = time_s if rows.coordinate == "time" else rows.position
    return replace(rows, time_s=time_s, position=position, pauses_unknown=True, notes=(*rows.notes, note))


def clock_runs_back(time_s: Floats, run: Ints) -> Ints:
    """Return the rows whose time is before that of the row above, in the same run; a run may have its own clock."""
    return np.flatnonzero((np.diff(time_s) < 0) & (run[1:] == run[:-1])) + 1


def _not_used(rows: Rows, *, in_motion: bool) -> Iterator[str]:
    """Yield notes about the columns that nothing, or not everything, uses."""
    columns, unknown = rows.measurement.columns, rows.measurement.unknown
    used = {"run", "direction", "time", "deviation", "velocity", "pressure", "humidity", "load", "spindle"}
    used |= {rows.observe, rows.coordinate, *rows.temperatures, *(() if in_motion else ("feed",))}
    if rows.observe == "deviation" and "deviation" not in columns:
        used |= {"target", "actual"}
    for what, names in (
        ("not used", [column.heading for name, column in columns.items() if name not in used]),
        ("not used, as channels beside the one observed", _other_channels(rows.measurement, rows.observe)),
        (
            "of no known quantity, looked at but used by no effect",
            [name for name in rows.unknown if name not in rows.other_axes],
        ),
        ("positions of other axes, used by no effect but by rtec train", list(rows.other_axes)),
        (
            "not used, because not all of it are numbers",
            [name for name, values in unknown.items() if values.dtype.kind != "f"],
        ),
    ):
        if names:
            yield f"{what}: {', '.join(names)}"
