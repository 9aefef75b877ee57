"""Readings at rest made ready: one for each place held, direction and speed of approach, runs, one clock."""

from __future__ import annotations

import numpy as np

from rtec.dataset.repeats import condition_numbers, one_way_passes, place_numbers, runs_by_recurrence
from rtec.dataset.rows import Rows
from rtec.dataset.standstill import (
    Ints,
    band_of,
    dead_zone,
    last_direction,
    rest_numbers,
    rest_stretches,
    starts_of_groups,
    within_band,
)
from rtec.effects.conditions import Floats
from rtec.errors import FileFormatError
from rtec.metrology import direction_of_motion

_BURST = 0.5  # of nine tenths of the steps: a band that is narrower does not hold two places
_HELD_SHARE, _HELD_PLACES, _EVEN_STEPS = 2 / 3, 20, 0.2  # of a log of places held: rows at rest, places, spread
_SAME_SPEED = 1e-3  # share by which two readings of a table may differ in speed and still be at one speed


def prepare_at_rest(rows: Rows) -> None:
    """Give readings at rest their direction, runs, clock and speed of approach."""
    find_runs = rows.coordinate != "time" and "run" not in rows.measurement.columns
    if rows.direction is None and rows.coordinate != "time":
        _find_direction(rows, find_runs)
    if rows.feed is not None and rows.velocity is None and rows.direction is not None:
        _refuse_other_unit(rows, "feed")
        rows.velocity = rows.direction * rows.feed
    if find_runs and np.ptp(rows.run) == 0 and (np.ptp(rows.position) > 0.0 or rows.coordinate == "velocity"):
        found = runs_by_recurrence(conditions_of(rows))
        if found is not None:
            rows.run = found
            rows.notes.append(f"no column 'run': {found[-1]} passes over the same places count as runs")
    if find_runs:
        run_clocks(rows)
    rows.held_direction = rows.direction


def _find_direction(rows: Rows, find_runs: bool) -> None:
    """Set the direction where no column states it, and the runs where passes in one direction show them."""
    if rows.coordinate == "velocity" and rows.velocity is not None:
        rows.direction = np.sign(rows.velocity)
        rows.notes.insert(0, "no direction column: the direction is the sign of the velocity")
        return
    passes = one_way_passes(rows.position) if find_runs else None
    if passes is not None:
        rows.run = passes
        rows.notes.append(f"no column 'run': {passes[-1]} passes in one direction count as runs")
    step = direction_of_motion(place_numbers(rows.position).astype(np.float64), rows.run)
    if step.all():
        rows.direction = step
        rows.notes.insert(0, "no direction column: the direction is the sign of the motion to each reading")
    else:
        rows.notes.append("no direction: there is no such column, and nothing moves in some run")


def conditions_of(rows: Rows) -> Ints:
    """Return a number for each reading: the same where it was taken under the same conditions."""
    speed = None if rows.velocity is None else np.abs(rows.velocity)
    if speed is not None and rows.coordinate == "velocity":  # measured speeds are never quite the same
        speed = place_numbers(np.log(np.maximum(speed, _SAME_SPEED * speed.max() + 1e-300)), _SAME_SPEED) + 0.0
    return condition_numbers(rows.position, rows.direction, speed, rows.other_axes.values())


def _refuse_other_unit(rows: Rows, quantity: str) -> None:
    """Refuse a column of speed that is not in the unit of the position."""
    unit = rows.measurement.columns[quantity].unit
    if rows.coordinate != "time" and unit != f"{rows.position_unit}_s":
        problem = f"units mixed: {quantity} in {unit.replace('_', '/')}, positions in {rows.position_unit}"
        allowed = "both linear or both angular"
        if rows.position_unit == "count":
            allowed += "; a line '# counts_per_rev: 8192' turns counts into angles"
        raise FileFormatError(rows.measurement.source, None, problem, allowed)


def velocity_of(rows: Rows) -> Floats:
    """Return the column ``velocity`` with the sign of the motion, where it holds speeds only."""
    _refuse_other_unit(rows, "velocity")
    velocity, way = rows.measurement.columns["velocity"].values, rows.direction
    if way is None and rows.coordinate != "time":
        way = np.sign(np.gradient(rows.position))
    if way is None or velocity.min() < 0.0 or not ((way < 0.0) & (velocity > 0.0)).any():
        return velocity
    rows.notes.append(
        "the velocity column is never negative although the axis reverses: it takes the sign of the motion"
    )
    return velocity * way


def run_clocks(rows: Rows) -> None:
    """Give all runs one clock, seconds since the first reading, which never goes back; refuse a run that does."""
    if rows.time_s is None:
        return
    time_s, steps, same_run = rows.time_s, np.diff(rows.time_s), rows.run[1:] == rows.run[:-1]
    back = clock_runs_back(time_s, rows.run)
    if back.size:
        row = int(back[0])
        problem = f"time runs backwards: {time_s[row]:g} s after {time_s[row - 1]:g} s"
        allowed = "times that do not decrease within a run (a column 'run' where each run has a clock of its own)"
        raise FileFormatError(rows.measurement.source, rows.measurement.line_of(row), problem, allowed)
    rows.time_s = time_s - time_s[0]
    rows.pauses_unknown = bool((steps < 0).any())
    if rows.pauses_unknown:
        interval = float(np.median(steps[same_run])) if same_run.any() else 1.0
        rows.time_s = np.append(0.0, np.cumsum(np.where(same_run, steps, interval)))
        rows.notes.append(
            f"the clock of the file starts again with each run: runs follow each other after {interval:.4g} s, the "
            "median interval, although the true pause between them is not known"
        )
        if rows.coordinate == "time":
            rows.position = rows.time_s


def clock_runs_back(time_s: Floats, run: Ints) -> Ints:
    """Return the rows whose time is before that of the row above, in the same run; a run may have its own clock.

    Examples
    --------
    >>> clock_runs_back(np.array([0.0, 2.0, 1.0, 0.0]), np.array([1, 1, 1, 2])).tolist()
    [2]
    """
    return np.flatnonzero((np.diff(time_s) < 0) & (run[1:] == run[:-1])) + 1


def held_places(rows: Rows) -> bool:
    """Make a log of a drive that is held at one place after the other, in even steps, into a row for each place.

    True where it is one: then the rows on the way are left out.
    """
    if rows.time_s is None or rows.coordinate == "time" or np.ptp(rows.position) == 0.0:
        return False
    rests = rest_stretches(rows.time_s, rows.position, rows.run, rows.velocity)
    if len(rests) < _HELD_PLACES or sum(b - a for a, b in rests) < _HELD_SHARE * len(rows):
        return False
    steps = np.abs(np.diff([rows.position[a:b].mean() for a, b in rests]))
    usual = float(np.median(steps))
    if usual == 0.0 or float(np.median(np.abs(steps - usual))) > _EVEN_STEPS * usual:
        return False
    count, number = len(rows), rest_numbers(rests, len(rows))
    rows.keep(number >= 0)
    rows.velocity = None
    rows.merge(starts_of_groups(number[number >= 0]))
    rows.notes.append(f"held at one place after the other: {count} rows became {len(rows)}, one for each place held")
    _direction_of_places(rows)
    return True


def merge_bursts(rows: Rows) -> None:
    """Put successive readings of a drive at rest at one measured place together into one row.

    The band within which a place is the same is two steps of the resolution, where that is well below the steps from
    place to place, else no band at all.
    """
    if rows.coordinate != "actual" or np.ptp(rows.position) == 0.0:
        return
    steps = np.abs(np.diff(rows.position))
    narrow, usual = np.quantile(steps[steps > 0.0], [0.05, 0.9]) * (2.0, _BURST)
    band = float(narrow) if narrow < usual else 0.0
    key = rows.run if rows.direction is None else 3 * rows.run + rows.direction.astype(np.int64)
    starts = np.array([begin for begin, _ in within_band(rows.position, key, band * (1.0 + 1e-6))])
    if starts.size < len(rows):
        what = "successive readings of the drive at one place are put together"
        rows.notes.append(f"{len(rows)} rows became {starts.size}: {what}")
        rows.merge(starts)
        _direction_of_places(rows)


def _direction_of_places(rows: Rows) -> None:
    """Set the direction in which each place was reached, through the jitter of the measured places."""
    if rows.direction is None:
        least = dead_zone(rows.position, rows.run, band_of(rows.position, rows.run) / 4.0)
        rows.direction = last_direction(rows.position, rows.run, least)
        rows.notes.insert(0, "no direction column: the direction is that in which each place was reached")
