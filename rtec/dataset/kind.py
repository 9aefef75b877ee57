"""Which kind of measurement a file is: this decides how it is prepared."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.drive_signals import local_derivatives
from rtec.dataset.from_measurement import rows_of, run_numbers
from rtec.dataset.observed import coordinate_of, observed_quantity, position_of, without_wraps
from rtec.dataset.rows import Rows
from rtec.dataset.standstill import Ints, rest_numbers, rest_stretches, starts_of_groups, stretches_of
from rtec.effects.conditions import Floats
from rtec.metrology import AxisFacts, Measurement

_FEWEST_ROWS = 20
_FASTEST_TEST_S = 0.05  # no axis goes to a target, settles and is read twenty times a second
_SLOWEST_LOG_S = 1.0
_SMALL_STEP = 0.01  # of the span: a test that reads faster than once a second has no hundred targets on the way
_MOVES = 1e-3  # share of the span that an axis goes within a stretch of a log; at rest it is only read again
_HELD_SHARE, _HELD_PLACES, _EVEN_STEPS = 2 / 3, 20, 0.2  # of a log of places held: rows at rest, places, spread
_STEADY = 0.05  # departure from a straight line, as a share of the way, of a run at constant speed
_FASTER = 5.0  # than ever later is the axis in a transient


class MeasurementKind(Enum):
    """What a file holds; each kind has a pipeline of its own."""

    STATIC_TEST = "readings at rest"
    HELD_DRIVE = "log of a drive that is held at one place after the other: a static test, too"
    MOVING_LOG = "log of a moving axis"
    SPEED_TABLE = "readings at several speeds, with neither time nor position"


def decide(
    measurement: Measurement, axis: AxisFacts, observe: str | None, like: Dataset | None
) -> tuple[MeasurementKind, Rows]:
    """Return the kind of a measurement, and its rows; those of a log without wraps and transients, with its rests."""
    if observe is None and like is not None:
        observe = like.observe
    if observe is not None:
        measurement = measurement.with_channel(observe)
    positions = measurement.positions(axis)
    quantity = observed_quantity(measurement, observe)
    coordinate = coordinate_of(measurement, positions, quantity, None if like is None else like.coordinate)
    has_velocity = "velocity" in measurement.columns and quantity != "velocity"
    position, _ = position_of(measurement, positions, coordinate)
    time_s = measurement.columns["time"].values if "time" in measurement.columns else None
    # where time is the coordinate, only a column can say that something moves
    may_move = coordinate != "velocity" and (has_velocity or coordinate != "time")
    if not (may_move and is_moving(time_s, position, run_numbers(measurement), has_velocity)):
        rows = rows_of(measurement, axis, quantity, coordinate, positions, in_motion=False)
        return MeasurementKind.SPEED_TABLE if coordinate == "velocity" else MeasurementKind.STATIC_TEST, rows
    log = rows_of(measurement, axis, quantity, coordinate, without_wraps(positions), in_motion=True)
    log = with_rests(without_transient(log))
    return MeasurementKind.HELD_DRIVE if log.of_drive and _is_held(log) else MeasurementKind.MOVING_LOG, log


def is_moving(time_s: Floats | None, position: Floats, run: Ints, has_velocity: bool) -> bool:
    """Return whether a file is a log of a moving axis, and not readings at rest; columns of shape (rows,).

    The rule:

    - a ``velocity`` column says that the axis moves, unless a second or more lies between the rows (a ``feed`` column
      does not: it tells how a target was approached);
    - else a log has a time and at least twenty rows; between its gaps (`stretches_of`) the axis mostly moves by more
      than a thousandth of the span (not so in a burst of readings at each target); and it has a median interval
    - below 50 ms: no axis goes to a target, settles and is read twenty times a second;
    - or below 1 s, where half of the steps that are steps at all stay below 1 % of the span.

    Everything else is readings at rest: also a test with a time column in which minutes pass between targets.
    """
    same_run, span = run[1:] == run[:-1], float(np.ptp(position))
    if has_velocity:
        return time_s is None or not same_run.any() or bool(np.median(np.diff(time_s)[same_run]) < _SLOWEST_LOG_S)
    if time_s is None or time_s.size < _FEWEST_ROWS or not same_run.any() or span == 0.0:
        return False
    intervals, steps = np.diff(time_s)[same_run], np.abs(np.diff(position)[same_run])
    passed = intervals[intervals > 0]  # a clock coarser than the readings gives several of them one time
    median = float(np.median(passed)) if passed.size else np.inf
    begin, end = np.array(stretches_of(time_s, run)).T
    reach = np.maximum.reduceat(position, begin) - np.minimum.reduceat(position, begin)
    if median >= _SLOWEST_LOG_S or 2 * (end - begin)[reach > _MOVES * span].sum() <= time_s.size:
        return False
    return bool(median < _FASTEST_TEST_S or np.median(steps[steps > 0]) < _SMALL_STEP * span)


def without_transient(log: Rows) -> Rows:
    """Leave out the motion before the test proper, at the start of each run at constant speed."""
    if log.time_s is None or log.coordinate == "time":
        return log
    kept, notes = np.ones(len(log), dtype=np.bool_), []
    for begin, end in stretches_of(log.time_s, log.run):
        if begin and log.run[begin] == log.run[begin - 1]:
            continue
        time_s = log.time_s[begin:end]
        count = transient_rows(time_s, log.position[begin:end])
        if count:
            kept[begin : begin + count] = False
            which = "" if np.ptp(log.run) == 0 else f" of run {log.run[begin]}"
            why = "the axis is still in another motion (homing) there, far off the constant speed that it keeps later"
            notes.append(f"the first {time_s[count] - time_s[0]:.2f} s{which} ({count} rows) are left out: {why}")
    return replace(log.keep(kept), notes=(*log.notes, *notes))


def transient_rows(time_s: Floats, position: Floats) -> int:
    """Return how many rows at the start of a run at constant speed belong to the motion before it (homing).

    Time and unwrapped position are of one stretch, shape (rows,). It is a run at constant speed where a straight line
    through the second half of its rows is nowhere farther off than 5 % of the way. The range of the velocity there
    (local parabolas through 21 rows), widened by a tenth on both sides, is the usual range. The transient lasts as
    long as the velocity, in the first quarter of the rows, still leaves the usual range, and a tenth of that time
    more, in which the axis rings. It counts as one only if in it the axis is five times faster than ever in the
    second half: slip between cogging positions is part of the run, and so is an acceleration from rest.
    """
    half = time_s.size // 2
    if half < _FEWEST_ROWS or time_s[-1] <= time_s[half]:
        return 0
    since, later = time_s[half:] - time_s[half], position[half:]
    line = np.polyfit(since, later, 1)
    way = abs(line[0]) * since[-1]
    if way == 0.0 or np.abs(later - np.polyval(line, since)).max() > _STEADY * way:
        return 0
    velocity, _ = local_derivatives(time_s, position)
    low, high = velocity[half:].min(), velocity[half:].max()
    margin, early = 0.1 * (high - low) + 1e-6 * abs(line[0]), velocity[: time_s.size // 4]
    unusual = np.flatnonzero((early < low - margin) | (early > high + margin))
    until = time_s[0] + 1.1 * (time_s[unusual[-1]] - time_s[0]) if unusual.size else -np.inf
    rows = int(np.searchsorted(time_s, until, side="right"))
    return rows if np.abs(velocity[:rows]).max(initial=0.0) > _FASTER * np.abs(velocity[half:]).max() else 0


def with_rests(log: Rows) -> Rows:
    """Give each standstill of a log its number."""
    if log.time_s is None or log.coordinate == "time" or np.ptp(log.position) == 0.0:
        return log
    found = rest_stretches(log.time_s, log.position, log.run, log.velocity)
    return replace(log, rest=rest_numbers(found, len(log)) if found else None)


def _is_held(log: Rows) -> bool:
    """Return whether an axis is mostly at rest, at one place after the other, in even steps."""
    if log.rest is None:
        return False
    starts = starts_of_groups(log.rest)
    rests = log.rest[starts] >= 0
    if rests.sum() < _HELD_PLACES or (log.rest >= 0).sum() < _HELD_SHARE * len(log):
        return False
    parts = np.split(log.position, starts[1:])
    steps = np.abs(np.diff([part.mean() for part, at_rest in zip(parts, rests, strict=True) if at_rest]))
    usual = float(np.median(steps))
    return usual > 0.0 and float(np.median(np.abs(steps - usual))) <= _EVEN_STEPS * usual
