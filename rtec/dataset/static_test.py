"""Readings at rest: one row for each place held, direction and speed of approach, runs, one clock."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.direction import dead_zone, last_direction
from rtec.dataset.from_measurement import one_clock, refuse_other_unit
from rtec.dataset.passes import passages
from rtec.dataset.repeats import cells_of, condition_numbers, one_way_passes, place_numbers, runs_by_recurrence
from rtec.dataset.rows import Rows
from rtec.dataset.standstill import Ints, band_of, starts_of_groups, within_band
from rtec.dataset.to_dataset import dataset_of, with_conditions
from rtec.metrology import direction_of_motion

_BURST = 0.5  # of nine tenths of the steps: a band that is narrower does not hold two places


def static_test(rows: Rows) -> Dataset:
    """Return the data set of readings at rest; without a position, of readings over time."""
    return _of_readings(_one_row_a_burst(rows) if rows.of_drive and rows.coordinate == "actual" else rows)


def held_drive(log: Rows) -> Dataset:
    """Return the data set of a log of a drive that is held at one place after the other: a row for each place."""
    rest = np.asarray(log.rest)
    held = replace(log, velocity=None).keep(rest >= 0).merge(starts_of_groups(rest[rest >= 0]))
    note = f"held at one place after the other: {len(log)} rows became {len(held)}, one for each place held"
    return _of_readings(_direction_of_places(replace(held, notes=(*held.notes, note))))


def _of_readings(rows: Rows) -> Dataset:
    over_time = rows.coordinate in ("time", "temperature")
    number_runs = not over_time and "run" not in rows.measurement.columns
    if rows.direction is None and not over_time:
        rows = _direction_of_steps(_one_way_runs(rows) if number_runs else rows)
    rows = _speed_of_approach(rows)
    numbers = np.full(len(rows), -1, dtype=np.int64)
    if not over_time:
        speed = None if rows.velocity is None else np.abs(rows.velocity)
        numbers = condition_numbers(rows.position, rows.direction, speed, rows.other_axes.values())
    if number_runs:
        if np.ptp(rows.run) == 0 and np.ptp(rows.position) > 0.0:
            rows = runs_of_passes(rows, numbers)
        rows = one_clock(rows)
    rows, conditions = with_conditions(rows, moving=False)
    stated = rows.position if "direction" in rows.measurement.columns else None
    passage = passages(rows.run, None) if over_time else passages(rows.run, rows.direction, stated)
    return dataset_of(rows, conditions, rows.observed, passage, cells_of(numbers, passage))


def _one_row_a_burst(rows: Rows) -> Rows:
    """Put successive readings of a drive at rest at one measured place together into one row.

    The band within which a place is the same is two steps of the resolution, where that is well below the steps from
    place to place, else no band at all.
    """
    if np.ptp(rows.position) == 0.0:
        return rows
    steps = np.abs(np.diff(rows.position))
    narrow, usual = np.quantile(steps[steps > 0.0], [0.05, 0.9]) * (2.0, _BURST)
    band = float(narrow) if narrow < usual else 0.0
    key = rows.run if rows.direction is None else 3 * rows.run + rows.direction.astype(np.int64)
    starts = np.array([begin for begin, _ in within_band(rows.position, key, band * (1.0 + 1e-6))])
    if starts.size == len(rows):
        return rows
    note = f"{len(rows)} rows became {starts.size}: successive readings of the drive at one place are put together"
    return _direction_of_places(replace(rows.merge(starts), notes=(*rows.notes, note)))


def _direction_of_places(rows: Rows) -> Rows:
    """Take the direction in which each place was reached, through the jitter of the measured places."""
    if rows.direction is not None:
        return rows
    least = dead_zone(rows.position, rows.run, band_of(rows.position, rows.run) / 4.0)
    note = "no direction column: the direction is that in which each place was reached"
    return replace(rows, direction=last_direction(rows.position, rows.run, least), notes=(note, *rows.notes))


def _one_way_runs(rows: Rows) -> Rows:
    """Count passes in one direction as runs, where the axis returns in one go between them."""
    passes = one_way_passes(rows.position)
    if passes is None:
        return rows
    note = f"no column 'run': {passes[-1]} passes in one direction count as runs"
    return replace(rows, run=passes, notes=(*rows.notes, note))


def _direction_of_steps(rows: Rows) -> Rows:
    """Take the direction of the step to each reading, where there is one to all of them."""
    step = direction_of_motion(place_numbers(rows.position).astype(np.float64), rows.run)
    if step.all():
        note = "no direction column: the direction is the sign of the motion to each reading"
        return replace(rows, direction=step, notes=(note, *rows.notes))
    note = "no direction: there is no such column, and nothing moves in some run"
    return replace(rows, notes=(*rows.notes, note))


def _speed_of_approach(rows: Rows) -> Rows:
    """Take the velocity from the feed, where no column tells it."""
    if rows.feed is None or rows.velocity is not None or rows.direction is None:
        return rows
    refuse_other_unit(rows, "feed")
    return replace(rows, velocity=rows.direction * rows.feed)


def runs_of_passes(rows: Rows, conditions: Ints) -> Rows:
    """Count whole passes over the same conditions as runs."""
    found = runs_by_recurrence(conditions)
    if found is None:
        return rows
    note = f"no column 'run': {found[-1]} passes over the same places count as runs"
    return replace(rows, run=found, notes=(*rows.notes, note))
