"""From the measuring program to a motion and the windows in which the laser reads."""

import numpy as np
import pytest
from profile_oracle import extremes

from rtec.axis import Limits, ProfileShape, Servo
from rtec.errors import ArgumentError
from rtec.machine import Laser, Machine, closed_loop, measuring_run, readings_of, run_machine
from rtec.metrology import MeasuringPlan, measuring_program

LIMITS = Limits(max_speed_mm_s=120.0, max_acceleration_mm_s2=500.0, rapid_mm_s=120.0, max_jerk_mm_s3=5000.0)
S = 1_000_000_000_000


def plan(**changes):
    values = {
        "start_mm": 25.4, "end_mm": 50.8, "increment_mm": 6.35, "dwell_s": 3, "runs": 2, "feed_mm_s": 50 * 25.4 / 60,
        "overshoot_mm": 2.54,
    } | changes  # fmt: skip
    return MeasuringPlan(**values)


def test_the_calibration_of_the_thesis():
    calibration = plan(end_mm=1016, increment_mm=0.635, dwell_s=6, runs=4)
    task = measuring_run(calibration, LIMITS)
    assert task.target_mm.size == 12_488
    assert [int(np.sum(task.run == number)) for number in (1, 2, 3, 4)] == [3_122] * 4
    for number in (1, 2, 3, 4):
        one = task.run == number
        grid = 25.4 + 0.635 * np.arange(1561)
        assert np.sort(task.target_mm[one & (task.direction == 1)]) == pytest.approx(grid, abs=1e-9)
        assert np.sort(task.target_mm[one & (task.direction == -1)]) == pytest.approx(grid, abs=1e-9)
    hours = (task.motion.start_ps[-1] + task.motion.duration_ps[-1]) / S / 3600
    assert hours == pytest.approx(12_488 * 6.05 / 3600, rel=0.01)  # "about 20 hours", nearly all of it dwells


def test_a_metric_plan_runs_at_its_millimetres():
    metric = plan(start_mm=10, end_mm=11, increment_mm=0.1, dwell_s=2.5, runs=1, feed_mm_s=7, overshoot_mm=1)
    task = measuring_run(metric, LIMITS)
    there = [10.0, 10.1, 10.2, 10.3, 10.4, 10.5, 10.6, 10.7, 10.8, 10.9, 11.0]
    assert task.target_mm.tolist() == there + there[::-1]
    assert (task.ends_ps - task.begins_ps == 2.5 * S).all()
    reached = extremes(task.motion)
    assert (reached.max_mm, reached.speed_mm_s) == (12.0, pytest.approx(7.0))
    exported = [line for line in measuring_program(metric) if line.startswith("G53")]
    assert exported[0] == "G53Z0.3937F16.5"  # the inch macro has four decimals: 9.99998 mm


@pytest.mark.parametrize("shape", ProfileShape)
def test_the_axis_stands_at_the_target_in_each_window(shape):
    task = measuring_run(plan(), LIMITS, shape=shape)
    assert task.target_mm.size == plan().number_of_readings == 20
    assert (task.begins_ps[1:] >= task.ends_ps[:-1]).all()
    for at in (task.begins_ps, task.ends_ps, (task.begins_ps + task.ends_ps) // 2):
        assert task.motion.position_at(at) == pytest.approx(task.target_mm, abs=1e-9)
        assert np.abs(task.motion.velocity_at(at + 1)[:-1]).max() < 1e-6
    assert (task.ends_ps - task.begins_ps == 3 * S).all()


def test_the_first_reading_is_taken_at_the_program_stop():
    # the program waits there for the operator; all other dwells are timed
    task = measuring_run(plan(), LIMITS, stop_s=20.0)
    lengths = (task.ends_ps - task.begins_ps) / S
    assert lengths.tolist() == [20.0] + [3.0] * 19


def test_overshoots_are_no_readings_but_take_up_the_play():
    task = measuring_run(plan(), LIMITS)
    reached = extremes(task.motion)
    assert (reached.min_mm, reached.max_mm) == pytest.approx((0.0, 2.1 * 25.4))
    assert reached.speed_mm_s == pytest.approx(50 * 25.4 / 60)


@pytest.mark.parametrize(
    ("machine", "missing"),
    [
        (Machine(laser=Laser(dwell_s=6.0)), 20),  # its second half would begin as the axis leaves
        (Machine(laser=Laser(dwell_s=50.0)), 20),
        (Machine(laser=Laser(window_mm=1e-4, dwell_s=1.0), servo=Servo(deadband_counts=5.0)), 20),
        (Machine(servo=Servo(deadband_counts=1e6)), 20),
    ],
)
def test_readings_that_cannot_be_taken_say_so(machine, missing):
    task = measuring_run(plan(), LIMITS)
    deviation = run_machine(machine, task).deviation_mm
    assert np.isnan(deviation).sum() == missing
    with pytest.raises(ArgumentError, match=rf"readings: {missing} of 20 missing, the first at 25.4000 mm.*lengthen"):
        readings_of(task, deviation)


def test_an_axis_at_rest_before_its_dwell_is_read(monkeypatch):
    # so wide a deadband lets it stop while its command still moves; a part as long as the run bounds no skipping
    monkeypatch.setattr(closed_loop, "_slices", lambda *_: 1)
    lazy = Machine(servo=Servo(deadband_counts=2000.0, lag_s=0.0), laser=Laser(dwell_s=1.0, window_mm=5.0))
    task = measuring_run(plan(), LIMITS)
    result = run_machine(lazy, task)
    assert np.abs(result.deviation_mm).max() <= 2.0
    assert np.array_equal(result.deviation_mm, run_machine(lazy, task, skip_rest=False).deviation_mm)
    assert result.ticks_skipped > 0.5 * result.ticks


def test_a_perfect_axis_reads_within_half_a_count():
    task = measuring_run(plan(), LIMITS)
    readings = readings_of(task, run_machine(Machine(), task).deviation_mm)
    assert np.abs(readings.deviation_mm).max() < 0.0006
    assert (readings.direction == task.direction).all()
    assert (readings.run == task.run).all()


def test_the_reading_is_the_mean_of_the_second_half():
    # an axis that creeps by v until it stands: with Kv of 1/s it covers its last 0.2 mm during the laser's time
    slow = Machine(
        servo=Servo(gain_per_s=1.0, lag_s=0.0, deadband_counts=0.5), laser=Laser(dwell_s=2.0, window_mm=0.2)
    )
    task = measuring_run(plan(dwell_s=12, runs=1), LIMITS)
    deviation = run_machine(slow, task).deviation_mm
    # from 0.2 mm on it is 0.2 e^-t behind: mean over 1..2 s
    expected = 0.2 * (np.exp(-1.0) - np.exp(-2.0))
    forward = task.direction == 1
    assert -deviation[forward][1:] == pytest.approx(expected, abs=0.0015)  # its count is up to half a count off
    assert deviation[~forward][1:] == pytest.approx(expected, abs=0.0015)


@pytest.mark.parametrize(
    "bad", [{"window_mm": 0.0}, {"window_mm": float("nan")}, {"dwell_s": -1.0}, {"dwell_s": 1e400}]
)
def test_a_laser_out_of_range_is_refused(bad):
    with pytest.raises(ArgumentError, match=next(iter(bad))):
        Laser(**bad)
