"""The position loop against the textbook: following error, overshoot, deadband, dither, standstill."""

import math

import numpy as np
import pytest
from loop_oracle import servo_path

from rtec.axis import Encoder, Servo
from rtec.machine import TRACE_COLUMNS, Machine, run_machine, straight_pass
from tests.machines import LIMITS

TIME, COMMAND, ENCODER = (TRACE_COLUMNS.index(name) for name in ("time_s", "command_mm", "encoder_mm"))
COUNT_MM = 0.001


def traced(servo, targets=(40.0,), feed=20.0, dwell_s=2.0):
    """Return times, commands and positions at every tick."""
    machine = Machine(servo=servo, encoder=Encoder(count_mm=COUNT_MM))
    result = run_machine(
        machine, straight_pass(targets, feed, LIMITS, dwell_s=dwell_s), trace_every=1, skip_rest=False
    )
    return result.trace[:, TIME], result.trace[:, COMMAND], result.trace[:, ENCODER]


@pytest.mark.parametrize("deadband", [0.5, 20.0])
def test_axis_rests_where_the_deadband_lets_it(deadband):
    _, command, position = traced(Servo(deadband_counts=deadband), targets=(10.0, 0.0))
    standing = np.flatnonzero((np.diff(command) == 0.0) & (np.diff(position) == 0.0) & (command[1:] == 10.0))
    off_counts = (10.0 - position[standing[-1]]) / COUNT_MM
    coasting = deadband * Servo().gain_per_s * Servo().lag_s  # the drive's lag carries it on from there
    assert deadband - coasting - 1.0 <= off_counts <= deadband + 0.5
    assert np.ptp(position[standing[-500:]]) == 0.0  # it stands


@pytest.mark.parametrize("hz", [1.0, 4.0])
def test_dither_moves_the_axis_as_the_loop_answers_to_a_sine(hz):
    servo = Servo(dither_counts=200.0, dither_hz=hz, deadband_counts=0.0)
    time_s, _, position = traced(servo, targets=(1.0,), dwell_s=6.0)
    swing = np.ptp(position[time_s > 4.0]) / 2.0 / COUNT_MM
    s = 2j * math.pi * hz
    answer = abs(servo.gain_per_s / (servo.gain_per_s + s + servo.lag_s * s**2))
    assert swing == pytest.approx(200.0 * answer, rel=0.02)


@pytest.mark.parametrize(
    "servo", [Servo(), Servo(gain_per_s=80.0, lag_s=0.0), Servo(feedforward=0.7, lag_s=0.03, deadband_counts=3.0)]
)
def test_motion_is_that_of_the_oracle(servo):
    motion = straight_pass([12.0, -3.0], 15.0, LIMITS, dwell_s=1.0)
    trace = run_machine(Machine(servo=servo), motion, trace_every=1, skip_rest=False).trace
    times_ps = np.arange(trace.shape[0]) * servo.period_ps
    commands = zip(motion.position_at(times_ps) / COUNT_MM, motion.velocity_at(times_ps) / COUNT_MM, strict=True)
    path = servo_path(
        commands, period_s=0.001, gain_per_s=servo.gain_per_s, lag_s=servo.lag_s, feedforward=servo.feedforward,
        deadband=servo.deadband_counts, standstill=servo.standstill_counts_s,
    )  # fmt: skip
    # an edge in the filter at a tick is counted one tick later: a count for one tick, healed by the loop
    assert trace[:, ENCODER] == pytest.approx(np.array(path) * COUNT_MM, abs=0.5 * COUNT_MM)
    assert np.mean(np.abs(trace[:, ENCODER] / COUNT_MM - path) < 1e-6) > 0.5


@pytest.mark.parametrize(("gain", "lag"), [(1000.0, 1.0), (1000.0, 10.0), (300.0, 0.5), (1e-3, 0.0), (1000.0, 0.0)])
def test_extreme_gains_end_and_keep_their_counts(gain, lag):
    servo = Servo(gain_per_s=gain, lag_s=lag, max_speed_mm_s=200.0)
    result = run_machine(Machine(servo=servo), straight_pass([5.0, 0.0], 20.0, LIMITS))
    assert result.audit
    assert math.isfinite(result.following_max_mm)
