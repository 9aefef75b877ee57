"""Readings at rest made ready: direction and speed of approach, runs, one clock."""

from __future__ import annotations

import numpy as np

from rtec.dataset.repeats import condition_numbers, one_clock, one_way_passes, place_numbers, runs_by_recurrence
from rtec.dataset.rows import Ints, Rows
from rtec.effects.conditions import Floats
from rtec.errors import FileFormatError
from rtec.metrology import direction_of_motion


def prepare_at_rest(rows: Rows) -> None:
    """Give readings at rest their direction, runs, clock and speed of approach."""
    columns = rows.measurement.columns
    if rows.direction is None and "run" not in columns and rows.coordinate != "time":
        passes = one_way_passes(rows.position)
        if passes is not None:
            rows.run = passes
            rows.notes.append(f"no column 'run': {passes[-1]} passes in one direction count as runs")
    if rows.direction is None and rows.coordinate != "time":
        step = direction_of_motion(place_numbers(rows.position).astype(np.float64), rows.run)
        if step.all():
            rows.direction = step
            rows.notes.append("direction: the sign of the motion to each reading")
        else:
            rows.notes.append("no direction: there is no such column, and nothing moves in some run")
    rows.held_direction = rows.direction
    if "feed" in columns and rows.velocity is None and rows.direction is not None and rows.observe != "feed":
        rows.velocity = rows.direction * np.abs(_speed(rows, "feed"))
    if "run" not in columns and rows.run[-1] == rows.run[0] and rows.coordinate != "time":
        found = runs_by_recurrence(conditions_of(rows)) if np.ptp(rows.position) > 0.0 else None
        if found is not None:
            rows.run = found
            rows.notes.append(f"no column 'run': {found[-1]} passes over the same places count as runs")
    if "run" not in columns and rows.coordinate != "time":
        run_clocks(rows)


def conditions_of(rows: Rows) -> Ints:
    """Return a number for each reading: the same where it was taken under the same conditions."""
    speed = None if rows.velocity is None else np.abs(rows.velocity)
    return condition_numbers(rows.position, rows.direction, speed)


def _speed(rows: Rows, quantity: str) -> Floats:
    """Return a column of speed, which has to be in the unit of the position."""
    column = rows.measurement.columns[quantity]
    if rows.coordinate != "time" and column.unit != f"{rows.position_unit}_s":
        problem = f"units mixed: {quantity} in {column.unit.replace('_', '/')}, positions in {rows.position_unit}"
        allowed = "both linear or both angular"
        if rows.position_unit == "count":
            allowed += "; a line '# counts_per_rev: 8192' turns counts into angles"
        raise FileFormatError(rows.measurement.source, None, problem, allowed)
    return column.values


def velocity_of(rows: Rows) -> Floats:
    """Return the column ``velocity`` with the sign of the motion, where it holds speeds only."""
    velocity = _speed(rows, "velocity")
    if rows.direction is not None:
        way = rows.direction
    elif rows.coordinate != "time":
        way = np.sign(np.gradient(rows.position))
    else:
        return velocity
    if velocity.min() < 0.0 or not ((way < 0.0) & (velocity > 0.0)).any():
        return velocity
    rows.notes.append(
        "the velocity column is never below zero although the axis turns: it takes the sign of the motion"
    )
    return velocity * way


def run_clocks(rows: Rows) -> None:
    """Give all runs one clock, which never goes back."""
    if rows.time_s is None:
        return
    clock, note = one_clock(rows.measurement, rows.time_s, rows.run)
    if note is not None:
        rows.notes.append(note)
        if rows.coordinate == "time":
            rows.position = clock
    rows.time_s = clock
