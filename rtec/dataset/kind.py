"""Which kind of measurement a file is: this decides how it is prepared."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.from_measurement import rows_of, run_numbers
from rtec.dataset.observed import coordinate_of, observed_quantity, position_of, without_wraps
from rtec.dataset.rows import Rows
from rtec.dataset.standstill import Ints, rest_numbers, rest_stretches, starts_of_groups, stretches_of
from rtec.dataset.transient import without_transient
from rtec.effects.conditions import Floats
from rtec.metrology import AxisFacts, Measurement

_FEWEST_ROWS = 20
_FASTEST_TEST_S = 0.05  # no axis goes to a target, settles and is read twenty times a second
_SLOWEST_LOG_S = 1.0
_SMALL_STEP = 0.01  # of the span: a test that reads faster than once a second has no hundred targets on the way
_MOVES = 1e-3  # share of the span that an axis goes within a stretch of a log; at rest it is only read again
_HELD_SHARE, _HELD_PLACES, _EVEN_STEPS = 2 / 3, 20, 0.2  # of a log of places held: rows at rest, places, spread


class Kind(Enum):
    """What a file holds; each kind has a pipeline of its own."""

    STATIC_TEST = "readings at rest"
    HELD_DRIVE = "log of a drive that is held at one place after the other: a static test, too"
    MOVING_LOG = "log of a moving axis"
    SPEED_TABLE = "readings at several speeds, with neither time nor position"


def decide(measurement: Measurement, axis: AxisFacts, observe: str | None, like: Dataset | None) -> tuple[Kind, Rows]:
    """Return the kind of a measurement, and its rows; those of a log without wraps and transients, with its rests."""
    positions = measurement.positions(axis)
    quantity = observed_quantity(measurement, observe if observe is not None or like is None else like.observe)
    coordinate = coordinate_of(measurement, positions, quantity, None if like is None else like.coordinate)
    has_velocity = "velocity" in measurement.columns and quantity != "velocity"
    position, _ = position_of(measurement, positions, coordinate)
    time_s = measurement.columns["time"].values if "time" in measurement.columns else None
    # where time is the coordinate, only a column can say that something moves
    may_move = coordinate != "velocity" and (has_velocity or coordinate != "time")
    if not (may_move and is_moving(time_s, position, run_numbers(measurement), has_velocity)):
        rows = rows_of(measurement, axis, quantity, coordinate, positions, in_motion=False)
        return Kind.SPEED_TABLE if coordinate == "velocity" else Kind.STATIC_TEST, rows
    log = rows_of(measurement, axis, quantity, coordinate, without_wraps(positions), in_motion=True)
    log = with_rests(without_transient(log))
    return Kind.HELD_DRIVE if log.of_drive and _is_held(log) else Kind.MOVING_LOG, log


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

    Examples
    --------
    >>> t, run = np.arange(100) * 0.01, np.ones(100, dtype=np.int64)
    >>> is_moving(t, np.sin(t), run, False), is_moving(t * 1000, np.sin(t), run, False)
    (True, False)
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
