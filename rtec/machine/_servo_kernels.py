"""Compiled servo: the command of a tick, and the position loop closed once in it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rtec._jit import Record, step
from rtec.axis._plant_kernels import driven
from rtec.controller._kernels import receiver_settle
from rtec.predictors._kernels import error_at
from rtec.units._time_kernels import PS_PER_S

SERVO = np.dtype(
    [
        # parameters
        ("period_ps", np.int64),
        ("period_s", np.float64),
        ("gain_per_s", np.float64),  # Kv
        ("feedforward", np.float64),
        ("lag_share", np.float64),  # 1 - exp(-period / lag): what the velocity gains of its error in one tick
        ("max_speed", np.float64),  # counts/s
        ("deadband", np.float64),  # counts
        ("standstill", np.float64),  # counts/s below which friction holds the axis
        ("dither", np.float64),  # counts
        ("dither_hz", np.float64),
        ("counts_per_unit", np.float64),  # encoder counts in one unit of the controller's counter
        ("count_mm", np.float64),
        ("compensates", np.int64),  # 1: by a table of its own
        ("rigid", np.int64),  # 0: a plant says how the axis moves
        # state
        ("now_ps", np.int64),
        ("x", np.float64),  # counts
        ("v", np.float64),  # counts/s
        ("command", np.float64),  # counts
        ("command_speed", np.float64),  # counts/s, of the tick before
        ("segment", np.int64),
        ("moving", np.int64),  # sign of the last motion
        ("program", np.int64),  # sign of the last commanded motion
        ("failed", np.int64),  # 1: the plant had no answer
        ("beyond_mm", np.float64),  # by how much the slide stands beyond what the encoder sees
        # observations
        ("following_max", np.float64),
        ("ticks", np.int64),
        ("skipped", np.int64),
    ],
    align=True,
)


@step
def command_at(servo: Record, t_ps: int, command: Any) -> float:
    """Return the commanded velocity in counts/s and set the command, walking along the motion segments."""
    start_ps, duration_ps, motion = command
    last = start_ps.size - 1
    while servo.segment < last and t_ps >= start_ps[servo.segment] + duration_ps[servo.segment]:
        servo.segment += 1
    i = servo.segment
    s = min(t_ps - start_ps[i], duration_ps[i]) / PS_PER_S
    servo.command = motion[0, i] + s * (motion[1, i] + s * (motion[2, i] / 2.0 + s * motion[3, i] / 6.0))
    return motion[1, i] + s * (motion[2, i] + s * motion[3, i] / 2.0)


@step
def servo_tick(m: Record, speed: float, own: Any, plant: Any, place: int) -> float:
    """Close the position loop once; return the acceleration of this tick in counts/s^2.

    ``own`` is the controller's own compensation table, which moves the command; None for a controller without.
    ``plant`` is what it moves, where the axis is not rigid (`rtec.axis._plant_kernels`).
    """
    servo = m.servo
    receiver_settle(m.receiver, servo.now_ps)
    if speed != 0.0:
        servo.program = 1 if speed > 0.0 else -1
    goal = servo.command
    if own is not None:  # known when it is compiled; whether the table is one, not before it runs
        if servo.compensates == 1:
            # where the axis is sent, its error brings it to the goal: the error there, not the one at the goal
            sent = goal
            for _ in range(3):
                sent = goal - error_at(own, sent * servo.count_mm, servo.program) / servo.count_mm
            goal = sent
    if servo.dither != 0.0:
        goal += servo.dither * math.sin(2.0 * math.pi * servo.dither_hz * (servo.now_ps / PS_PER_S))
    counted = m.receiver.count * servo.counts_per_unit
    lag = goal - counted
    servo.following_max = max(servo.following_max, abs(lag))
    if abs(lag) <= servo.deadband:
        lag = 0.0
    wanted = servo.gain_per_s * lag + servo.feedforward * speed
    wanted = min(max(wanted, -servo.max_speed), servo.max_speed)
    if servo.rigid == 0:
        return driven(servo, wanted, counted, speed, plant, place)
    if wanted == 0.0 and abs(servo.v) < servo.standstill:
        servo.v = 0.0
        return 0.0
    return (wanted - servo.v) * servo.lag_share / servo.period_s
