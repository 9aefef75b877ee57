"""Logs of warm machines: what is observed, blocks, sensors that fail, clocks that jump."""

import numpy as np
import pytest

from rtec.dataset.warm_log import is_warm_log, warm_log
from rtec.errors import ArgumentError, FileFormatError
from rtec.metrology.measurement_file import measurement_of_columns

MINUTES = np.arange(720)
STEPS = np.repeat([0.0, 2000.0, 0.0, 4000.0, 0.0, 3000.0], 120)


def heated(speed, lag_min=40.0):
    """A temperature that follows the speed, minute by minute."""
    found, state = [], 0.0
    for rpm in speed:
        state += (rpm / 400.0 - state) / lag_min
        found.append(20.0 + state)
    return np.array(found) + np.random.default_rng(int(lag_min)).normal(0.0, 0.01, len(found))


def columns(**changed):
    heat = heated(STEPS)
    base = {
        "time_s": 60.0 * MINUTES,
        "spindle_rpm": STEPS,
        "axial_um": 3.0 * (heat - 20.0),
        "radial_mm": 1e-3 * (heat - 20.0),
        "temperature_nose_degc": heat,
        "temperature_motor_degc": heated(STEPS, 15.0),
        "temperature_bed_degc": heated(STEPS, 200.0),
    }
    return {name: values for name, values in (base | changed).items() if values is not None}


def read(**changed):
    return warm_log(measurement_of_columns(columns(**changed)))


def written(path, table):
    rows = zip(*(values.tolist() for values in table.values()), strict=True)
    cells = [",".join("" if value is None else f"{value:.6g}" for value in row) for row in rows]
    path.write_text("\n".join([",".join(table), *cells]) + "\n")
    return path


def test_displacements_in_two_units_are_both_in_micrometres():
    log = read()
    assert list(log.outputs) == ["axial", "radial"]
    assert log.outputs["axial"] == pytest.approx(3.0 * log.outputs["radial"])


def test_a_change_of_speed_starts_a_block():
    log = read()
    assert log.blocks.names == ("0 rpm", "2000 rpm", "0 rpm", "4000 rpm", "0 rpm", "3000 rpm")
    assert np.flatnonzero(np.diff(log.blocks.of_row)).tolist() == [119, 239, 359, 479, 599]


def test_ramps_and_measured_speeds_are_no_blocks_of_their_own():
    noisy = STEPS + np.random.default_rng(0).normal(0.0, 2.0, STEPS.size)
    ramp = noisy.copy()
    ramp[120:123] = [500.0, 1000.0, 1500.0]
    assert read(spindle_rpm=ramp).blocks.count == 6


def test_a_column_can_name_the_blocks():
    table = columns() | {"part": np.repeat([1.0, 2.0, 3.0], 240)}
    log = warm_log(measurement_of_columns(table), observe="axial", blocks="part")
    assert (log.blocks.by, log.blocks.count, list(log.others)) == ("column part", 3, ["radial"])
    with pytest.raises(ArgumentError, match="'shift' is not a column"):
        warm_log(measurement_of_columns(table), blocks="shift")


def test_without_a_speed_the_turns_of_the_hottest_sensors_are_blocks():
    log = read(spindle_rpm=None)
    begins = 1 + np.flatnonzero(np.diff(log.blocks.of_row))
    assert log.blocks.by == "turn of the hottest sensors"
    assert np.abs(begins[:, None] - np.arange(120, 720, 120)).min(axis=1).max() <= 5


def test_without_any_turn_equal_parts_of_the_time_are_blocks_and_a_note_says_so():
    rising = 20.0 + MINUTES / 100.0
    one = measurement_of_columns({"time_s": 60.0 * MINUTES, "temperature_a_degc": rising, "z_um": rising})
    log = warm_log(one)
    assert (list(log.outputs), log.blocks.count) == (["z"], 6)
    assert any("equal parts of the time" in note for note in log.notes)


@pytest.mark.parametrize(
    ("broken", "said", "rows", "gone"),
    [
        ({400: 85.0}, "temperature_motor reads 85 degC at 24000 s: 1 rows are left out", 719, False),
        ({400: -127.0, 500: -127.0}, "at 24000 s and in 1 other row: 2 rows are left out", 718, False),
        (dict.fromkeys(range(300, 500), -127.0), "and in 199 other rows: the sensor is left out", 720, True),
        (dict.fromkeys(range(300, 720), 25.0), "stands still at 25 degC from 18000 s on", 720, True),
        (dict.fromkeys(range(720), 25.0), "is 25 in every row: the sensor is left out", 720, True),
        (dict.fromkeys(range(500, 720), 60.0), "jumps from", 720, True),
    ],
)
def test_a_sensor_that_fails_is_named_with_its_time(broken, said, rows, gone):
    motor = columns()["temperature_motor_degc"].copy()
    motor[list(broken)] = list(broken.values())
    log = read(temperature_motor_degc=motor)
    assert any(said in note for note in log.notes), log.notes
    assert (log.rows, "temperature_motor" in log.inputs) == (rows, not gone)


def test_a_sensor_that_hardly_moves_in_steps_has_not_failed():
    table = columns()
    room = np.round((20.0 + 0.3 * np.sin(MINUTES / 200.0)) / 0.0625) * 0.0625
    assert "temperature_room" in warm_log(measurement_of_columns(table | {"temperature_room_degc": room})).inputs


def test_cells_without_a_value_cost_the_sensor_or_the_readings_only(tmp_path):
    table = {name: values.astype(object) for name, values in columns().items()}
    table["temperature_motor_degc"][300:400] = None
    table["axial_um"][100:140] = None
    log = warm_log(written(tmp_path / "gaps.csv", table))
    assert "temperature_motor" not in log.inputs
    assert (log.rows, np.count_nonzero(log.measured)) == (720, 680)
    assert any("axial is missing in 40 rows, first at 6000 s" in note for note in log.notes)


def test_a_clock_that_was_set_does_not_cool_the_machine():
    time_s = 60.0 * MINUTES
    jumped = np.where(MINUTES < 300, time_s, time_s - 17_000.0)
    log = read(time_s=jumped)
    assert log.starts == (0,)
    assert log.time_s == pytest.approx(time_s)


def test_a_spindle_that_turns_in_the_first_row_began_at_rest_where_temperatures_move():
    keep = slice(120, None)  # from the first row at 2000 rpm on
    turning = {name: values[keep] for name, values in columns().items()}
    assert warm_log(measurement_of_columns(turning)).inputs["spindle_speed"][:2].tolist() == [0.0, 2000.0]
    steady = np.where(MINUTES < 300, 25.0, 25.0 - (MINUTES - 300) / 100.0)  # it has turned for long, and stops
    warm = columns(spindle_rpm=np.where(MINUTES < 300, 2000.0, 0.0))
    warm |= {name: steady for name in warm if name.startswith("temperature")}
    assert warm_log(measurement_of_columns(warm)).inputs["spindle_speed"][0] == 2000.0


def test_a_night_between_two_days_starts_anew():
    keep = np.r_[0:200, 480:720]
    table = {name: values[keep] for name, values in columns().items()}
    table["time_s"] = np.where(keep < 300, table["time_s"], table["time_s"] + 36_000.0)
    log = warm_log(measurement_of_columns(table))
    assert log.starts == (0, 200)
    assert any("nothing was read for a while after 11940 s" in note for note in log.notes)


def test_a_log_that_judges_needs_the_same_sensors():
    log = read()
    with pytest.raises(FileFormatError, match="no temperature_bed here"):
        warm_log(measurement_of_columns(columns(temperature_bed_degc=None)), like=log)
    other = warm_log(measurement_of_columns(columns()), like=log)
    assert list(other.inputs) == list(log.inputs)


@pytest.mark.parametrize(
    ("table", "observe", "warm"),
    [
        ({}, None, True),
        ({"target_mm": MINUTES * 1.0}, None, False),
        ({"target_mm": MINUTES * 1.0}, "axial", True),
        ({"target_mm": MINUTES * 1.0}, "deviation", False),
        ({"time_s": None}, None, False),
    ],
)
def test_what_is_over_positions_is_no_warm_log(table, observe, warm):
    assert is_warm_log(measurement_of_columns(columns(**table)), observe) is warm


@pytest.mark.parametrize("observe", ["ch9", "temperature_nose", "spindle"])
def test_what_is_no_displacement_is_refused(observe):
    with pytest.raises(ArgumentError, match="use axial or radial"):
        warm_log(measurement_of_columns(columns()), observe=observe)
    volts = columns() | {"probe_v": columns()["axial_um"]}
    with pytest.raises(ArgumentError, match="unit of length"):
        warm_log(measurement_of_columns(volts), observe="probe")
