"""From rows to the data set: the last steps, which are the same for every kind of measurement."""

from __future__ import annotations

import re
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.drive_signals import Resample, step_of
from rtec.dataset.from_measurement import NO_POSITION
from rtec.dataset.observed import observable_of
from rtec.dataset.repeats import cells_of, place_numbers
from rtec.dataset.rows import Rows
from rtec.dataset.standstill import Ints
from rtec.dataset.warm_blocks import blocks_of, stretch_starts
from rtec.effects import Units
from rtec.effects.conditions import Conditions, Floats, distance_since_reversal, heading_name
from rtec.errors import FileFormatError
from rtec.metrology import Measurement
from rtec.metrology.columns import MOST_AXES

FEWEST_ROWS = 3
"""Below, nothing at all can be told from noise."""
_SHARED = (
    "position",
    "position_unit",
    "run",
    "direction",
    "time_s",
    "velocity",
    "acceleration",
    "load",
    "spindle_rpm",
)
_SAME_LOAD = 0.01  # of what the loads differ by


def with_conditions(rows: Rows, *, moving: bool) -> tuple[Rows, Conditions]:
    """Return the rows, with notes about facts that are not used, and the conditions of each."""
    if len(rows) < FEWEST_ROWS:
        raise FileFormatError(rows.measurement.source, None, f"{len(rows)} rows are left", f"at least {FEWEST_ROWS}")
    unit, since, notes = rows.position_unit, None, list(rows.notes)
    direction = rows.held_direction if moving else rows.direction
    if direction is not None and rows.coordinate not in NO_POSITION:
        since = distance_since_reversal(rows.position, direction, rows.run, moving=moving)
    periods = {key: rows.axis.period(key, unit) for key in ("screw_pitch", "scale_signal_period")}
    for key, period in periods.items():
        if period is None and (text := rows.axis.text(key)) is not None:
            what = "time" if unit == "s" else "counts of unknown size"
            notes.append(f"{key}: {text} is not used, because positions are {what}")
    if rows.time_s is None and rows.coordinate != "velocity":
        notes.insert(0, "no time column: row order counts as time")
    conditions = Conditions(
        **{name: getattr(rows, name) for name in _SHARED},
        pressure_hpa=rows.pressure_hpa,
        humidity_percent=rows.humidity_percent,
        moving=moving,
        since_reversal=since,
        temperatures=MappingProxyType(rows.temperatures),
        others=MappingProxyType({heading_name(heading): values for heading, values in rows.unknown.items()}),
        reference_temperature_degc=rows.axis.reference_temperature_degc(),
        screw_pitch=periods["screw_pitch"],
        signal_period=periods["scale_signal_period"],
        revolution=rows.turn,
    )
    return replace(rows, notes=tuple(notes)), conditions


def dataset_of(
    rows: Rows,
    conditions: Conditions,
    observed: Floats,
    passage: Ints,
    cell: Ints,
    resample: Resample | None = None,
    cutoff_hz: float | None = None,
) -> Dataset:
    """Return the data set; what is observed, pass and cell are of the rows that ``resample`` leaves."""
    unknown, load_unit = rows.unknown, ""
    if resample is not None:
        unknown = {name: resample.apply(values) for name, values in unknown.items()}
    if rows.load is not None:
        cell = _under_one_load(cell, passage, rows.load if resample is None else rows.load[resample.kept])
        load_unit = rows.measurement.columns["load"].unit
    block = _blocks_by_speed(rows, conditions) if rows.block is None else rows.block
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
        block=block if block is None or resample is None else block[resample.kept],
        notes=rows.notes,
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


def _blocks_by_speed(rows: Rows, c: Conditions) -> Ints | None:
    """Return the blocks of one speed of the spindle in readings over time, where there are enough of them."""
    if c.moving or not c.time_is_coordinate or c.time_s is None or c.spindle_rpm is None or not np.ptp(c.spindle_rpm):
        return None
    found = blocks_of(c.time_s, c.spindle_rpm, rows.run, stretch_starts(c.time_s, rows.run))
    return found.of_row if found.by in ("spindle speed", "run or stretch") else None


def _under_one_load(cell: Ints, passage: Ints, load: Floats) -> Ints:
    """Return the cells of readings that were taken under the same load as well: others repeat nothing."""
    same = place_numbers(load, _SAME_LOAD * float(np.ptp(load)))
    return cells_of(np.where(cell >= 0, cell * (int(same.max()) + 1) + same, -1), passage)
