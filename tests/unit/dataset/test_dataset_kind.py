"""Each kind of file is told from the others, and its pipeline leaves the columns of the measurement as they are."""

import itertools

import numpy as np
import pytest

from rtec.dataset.kind import MeasurementKind, decide
from rtec.dataset.load import load_dataset
from rtec.metrology import AxisFacts, Column, Measurement


def measured(**columns):
    """Return a measurement whose columns refuse to be written to."""
    known = {name: Column(name, unit, np.array(values, dtype=float)) for name, (unit, values) in columns.items()}
    for column in known.values():
        column.values.flags.writeable = False
    return Measurement(source="x.csv", facts={}, columns=known, unknown={})


def static_test():
    up = np.arange(0.0, 100.0, 10.0)
    targets = np.tile(np.append(up, up[::-1]), 3)
    return measured(target=("mm", targets), deviation=("mm", 1e-3 * np.sin(targets)))


def steps(places):
    """Return time, position and force of a drive that stands for 0.3 s at each place, 100 rows a second."""
    moves = [np.append(np.full(30, a), np.linspace(a, b, 6)[1:-1]) for a, b in itertools.pairwise(places)]
    position = np.concatenate(moves)
    time = 0.01 * np.arange(position.size)
    return measured(time=("s", time), actual=("mm", position), force=("n", 5.0 + np.sin(position)))


def moving_log():
    time = 0.01 * np.arange(3000)
    position = 20.0 * np.sin(time)
    return measured(time=("s", time), actual=("mm", position), force=("n", np.sign(np.cos(time)) + 0.01 * position))


def speed_table():
    speed = np.repeat([1.0, -1.0, 5.0, -5.0], 3)
    return measured(velocity=("mm_s", speed), force=("n", np.sign(speed)))


@pytest.mark.parametrize(
    ("measurement", "kind", "rows"),
    [
        (static_test(), MeasurementKind.STATIC_TEST, 60),
        (steps(np.arange(31.0)), MeasurementKind.HELD_DRIVE, 30),
        (steps(np.arange(11.0)), MeasurementKind.MOVING_LOG, None),  # too few places
        (steps(np.arange(31.0) ** 2), MeasurementKind.MOVING_LOG, None),  # uneven steps
        (moving_log(), MeasurementKind.MOVING_LOG, None),
        (speed_table(), MeasurementKind.SPEED_TABLE, 12),
    ],
)
def test_each_kind_has_its_pipeline(measurement, kind, rows):
    axis = AxisFacts(source="x.csv", said={}, given={})
    assert decide(measurement, axis, None, None)[0] is kind
    data = load_dataset(measurement)
    assert data.conditions.moving is (kind is MeasurementKind.MOVING_LOG)
    assert rows in (None, data.rows)
    assert (data.coordinate == "velocity") is (kind is MeasurementKind.SPEED_TABLE)


def test_a_deviation_of_places_held_stays_a_log():
    held = steps(np.arange(31.0))
    columns = {name: column for name, column in held.columns.items() if name != "force"}
    columns["deviation"] = Column("deviation", "mm", np.zeros(held.rows))
    axis = AxisFacts(source="x.csv", said={}, given={})
    log = Measurement(source="x.csv", facts={}, columns=columns, unknown={})
    assert decide(log, axis, None, None)[0] is MeasurementKind.MOVING_LOG
