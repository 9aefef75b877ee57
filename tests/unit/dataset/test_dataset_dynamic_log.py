"""Logs of drives as sequences: inputs, output, runs, and what is refused."""

import numpy as np
import pytest

from rtec.dataset.dynamic_log import dynamic_log, dynamic_residual, log_like
from rtec.errors import ArgumentError, FileFormatError
from rtec.metrology import column_choices
from rtec.predictors.linear_models import Held

T = np.arange(400) * 1e-3
PATH = 20.0 * np.sin(12.0 * T)
SPEED = 240.0 * np.cos(12.0 * T)
ACTUAL = PATH - 0.01 * SPEED


def written(folder, name="log.csv", **columns):
    rows = zip(*(np.asarray(values) for values in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(repr(float(value)) for value in row) for row in rows)]
    (folder / name).write_text("\n".join(lines) + "\n")
    return folder / name


def drive(folder, time_s=T, **more):
    return written(folder, time_s=time_s, command_mm=PATH, actual_mm=ACTUAL, **more)


def test_a_following_error_in_um_comes_from_commanded_velocity_and_acceleration(tmp_path):
    log = dynamic_log(drive(tmp_path))
    data = log.sequences
    assert (log.observe, data.names, data.unit, data.period_s) == (
        "following_error", ("velocity", "acceleration"), "um", 1e-3,
    )  # fmt: skip
    assert data.output == pytest.approx(10.0 * SPEED, abs=1e-6)
    inner = slice(2, -2)
    assert data.inputs[inner, 0] == pytest.approx(SPEED[inner], abs=0.01)
    assert data.inputs[inner, 1] == pytest.approx(-(12.0**2) * PATH[inner], abs=0.5)


def test_a_deviation_has_the_other_sign_and_an_actual_position_its_command(tmp_path):
    file = drive(tmp_path)
    assert dynamic_log(file, observe="deviation").sequences.output == pytest.approx(-10.0 * SPEED, abs=1e-6)
    actual = dynamic_log(file, observe="actual").sequences
    assert (actual.names, actual.unit) == (("command",), "um")
    assert actual.inputs[:, 0] == pytest.approx(PATH)


def test_any_column_is_an_output_and_a_commanded_voltage_an_input(tmp_path):
    file = written(tmp_path, time_s=4.0 * np.arange(50), command_v=np.arange(50.0), level_v=np.arange(50.0) ** 2)
    for said in ("level", "level_v", "LEVEL"):
        log = dynamic_log(file, observe=said)
        assert (log.sequences.names, log.sequences.unit, log.sequences.period_s) == (("command",), "V", 4.0)
        assert log.sequences.output[3] == 9.0


@pytest.mark.parametrize("heading", ["current_a", "voltage_v"])
def test_current_and_voltage_are_inputs_and_saturation_is_said(tmp_path, heading):
    level = np.clip(np.sin(30.0 * T), -0.8, 0.8)
    log = dynamic_log(drive(tmp_path, **{heading: level}))
    name = heading.partition("_")[0]
    assert log.sequences.names == ("velocity", "acceleration", name)
    assert any(name in note and "saturated" in note for note in log.notes)
    free = dynamic_log(drive(tmp_path, **{heading: np.sin(30.0 * T)}))
    assert not any("saturated" in note for note in free.notes)


def test_a_measured_velocity_is_no_input_but_a_commanded_one_is(tmp_path):
    measured = dynamic_log(drive(tmp_path, velocity_mm_s=np.gradient(ACTUAL, 1e-3)))
    assert any("follows the actual position" in note for note in measured.notes)
    given = dynamic_log(drive(tmp_path, velocity_mm_s=SPEED))
    assert given.sequences.inputs[:, 0] == pytest.approx(SPEED)


def test_other_columns_are_named_and_can_be_made_inputs(tmp_path):
    file = drive(tmp_path, force_n=SPEED, pulse_v=np.sin(50.0 * T))
    log = dynamic_log(file)
    assert any("force_n, pulse_v" in note and "pulse_v=voltage_v" in note for note in log.notes)
    mapped = dynamic_log(file, choices=column_choices(["pulse_v=voltage_v"]))
    assert mapped.sequences.names == ("velocity", "acceleration", "voltage")


def test_a_coarse_command_is_smoothed_before_it_is_differentiated(tmp_path):
    coarse = written(tmp_path, time_s=T, command_mm=np.round(PATH, 2), actual_mm=ACTUAL)
    log = dynamic_log(coarse)
    assert any("rounded" in note for note in log.notes)
    inner = slice(50, -50)
    assert np.std(log.sequences.inputs[inner, 1] + 144.0 * PATH[inner]) < 0.1 * np.std(144.0 * PATH)


def test_an_axis_of_several_is_chosen(tmp_path):
    columns = {"target_x_mm": PATH, "actual_x_mm": ACTUAL, "target_y_mm": 2.0 * PATH, "actual_y_mm": 2.0 * ACTUAL}
    file = written(tmp_path, time_s=T, **columns, current_x_a=np.sin(9.0 * T))
    with pytest.raises(ArgumentError, match="--axis is needed"):
        dynamic_log(file)
    log = dynamic_log(file, choices=column_choices((), axis="x"))
    assert log.sequences.names == ("velocity", "acceleration", "current")
    assert log.sequences.output == pytest.approx(10.0 * SPEED, abs=1e-6)


def test_a_gap_begins_another_run_and_short_runs_are_left_out(tmp_path):
    time_s = T.copy()
    time_s[200:] += 0.5
    time_s[390:] += 0.5
    log = dynamic_log(drive(tmp_path, time_s))
    assert log.sequences.starts == (0, 200)
    assert len(log.sequences) == 390
    assert log.rows.tolist() == list(range(390))
    assert any("2 gaps" in note for note in log.notes)
    assert any("10 rows in runs of fewer" in note for note in log.notes)


def test_a_time_that_comes_twice_is_left_out(tmp_path):
    rows = np.insert(np.arange(400), 100, 100)
    file = written(tmp_path, time_s=T[rows], command_mm=PATH[rows], actual_mm=ACTUAL[rows])
    log = dynamic_log(file)
    assert log.sequences.starts == (0,)
    assert log.sequences.output == pytest.approx(10.0 * SPEED, abs=1e-6)
    assert any("1 rows at the time" in note for note in log.notes)


def test_an_uneven_log_is_resampled_and_says_so(tmp_path):
    time_s = T + np.random.default_rng(0).uniform(-2e-4, 2e-4, T.size)
    path = 20.0 * np.sin(12.0 * time_s)
    file = written(tmp_path, time_s=time_s, command_mm=path, actual_mm=path - 2.4 * np.cos(12.0 * time_s))
    log = dynamic_log(file)
    assert any("resampled every" in note for note in log.notes)
    grid = time_s[0] + log.sequences.period_s * np.arange(len(log.sequences))
    assert log.sequences.output == pytest.approx(2400.0 * np.cos(12.0 * grid), abs=0.5)
    assert np.abs(time_s[log.rows] - grid).max() < 1.3e-3


def test_rounded_times_are_even(tmp_path):
    log = dynamic_log(drive(tmp_path, np.round(np.arange(400) * 4.17e-3, 3)))
    assert log.sequences.period_s == pytest.approx(4.17e-3, rel=1e-4)
    assert not any("resampled" in note for note in log.notes)


@pytest.mark.parametrize(
    ("time_s", "message"),
    [
        (np.append(T[:200], T[:200]), "time runs backwards"),
        (np.round(np.arange(400) * 2e-4, 3), "times with more digits"),
        (np.cumsum(np.random.default_rng(1).exponential(1e-3, 400)), "fixed rate"),
        (np.arange(400) * 1e-3 + np.repeat(np.arange(40), 10), "without a gap"),
    ],
)
def test_times_that_are_no_sampling_are_refused(tmp_path, time_s, message):
    with pytest.raises(FileFormatError, match=message):
        dynamic_log(drive(tmp_path, time_s))


def test_what_cannot_teach_is_refused(tmp_path):
    with pytest.raises(FileFormatError, match="no time"):
        dynamic_log(written(tmp_path, command_mm=PATH, actual_mm=ACTUAL))
    with pytest.raises(FileFormatError, match="never moves"):
        dynamic_log(written(tmp_path, time_s=T, command_v=0.0 * T, level_v=T), observe="level")
    with pytest.raises(FileFormatError, match="level never changes"):
        dynamic_log(written(tmp_path, time_s=T, command_v=T, level_v=0.0 * T), observe="level")
    with pytest.raises(FileFormatError, match="no input"):
        dynamic_log(written(tmp_path, time_s=T, level_v=T), observe="level")
    with pytest.raises(FileFormatError, match="--observe level"):
        dynamic_log(written(tmp_path, time_s=T, voltage_v=T, level_v=T))
    with pytest.raises(ArgumentError, match=r"levle.*level"):
        dynamic_log(written(tmp_path, time_s=T, voltage_v=T, level_v=T), observe="levle")


def test_an_input_that_never_moves_is_left_out_with_a_note(tmp_path):
    log = dynamic_log(drive(tmp_path, voltage_v=0.0 * T))
    assert log.sequences.names == ("velocity", "acceleration")
    assert any("'voltage' never moves" in note for note in log.notes)


def test_another_log_is_read_for_a_model(tmp_path):
    first = dynamic_log(drive(tmp_path))
    other = written(tmp_path, "other.csv", time_s=T * (1.0 + 1e-4), command_mm=PATH, actual_mm=ACTUAL, current_a=T)
    log = log_like(first.head, other)
    assert (log.sequences.names, log.sequences.period_s) == (first.sequences.names, 1e-3)
    slow = written(tmp_path, "slow.csv", time_s=2.0 * T, command_mm=PATH, actual_mm=ACTUAL)
    with pytest.raises(FileFormatError, match=r"every 2 ms.*every 1 ms"):
        log_like(first.head, slow)
    turning = written(tmp_path, "turning.csv", time_s=T, command_deg=PATH, actual_deg=ACTUAL)
    with pytest.raises(FileFormatError, match="in deg"):
        log_like(first.head, turning)
    with pytest.raises(FileFormatError, match="no input 'voltage'"):
        dynamic_log(other, inputs=("voltage",))


def test_the_residual_is_not_a_number_where_a_model_starts(tmp_path):
    time_s = T.copy()
    time_s[200:] += 0.5
    log = dynamic_log(drive(tmp_path, time_s))
    left = dynamic_residual(Held(), log)
    assert np.flatnonzero(np.isnan(left)).tolist() == [0, 200]
    assert left[1] == pytest.approx(10.0 * (SPEED[1] - SPEED[0]), abs=1e-6)
    assert left[201] == pytest.approx(10.0 * (SPEED[201] - SPEED[200]), abs=1e-6)
