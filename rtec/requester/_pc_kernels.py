"""The PC's side of the handshake: one state machine, run every 10 ms.

It reads the box's words while Data Valid is high, follows the direction of motion with a hysteresis, turns the
predicted error into a total of steps, and slews its request towards it, never by more than the window beyond what the
box has accepted, and never before the box has sampled the last request.

::

    WAITING --home position read--> ACTIVE --fatal status, home lost, or a model without an answer--> HOLD
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rtec._jit import Record, helper
from rtec.link._kernels import deliver, post
from rtec.predictors._kernels import AXES, DIRECTION, INSIDE, OUTSIDE, POSITION, SENSORS, TIME, VELOCITY
from rtec.requester import _box_kernels as box
from rtec.signal._kernels import NEVER
from rtec.units._time_kernels import PS_PER_S

WAITING, ACTIVE, HOLD = 0, 1, 2

HOLD_OUTSIDE, KEEP_OUTSIDE, ZERO_OUTSIDE = 0, 1, 2

BEYOND_EVERYTHING_MM = 1e3
"""Of a deviation: no axis is so far off."""

PC = np.dtype(
    [
        # parameters
        ("period_ps", np.int64),
        ("retry_ps", np.int64),  # time to the next reading where Data Valid was low
        ("valid_after_ps", np.int64),  # time for which Data Valid is low after the words have arrived
        ("window", np.int64),  # largest change that the box believes
        ("most", np.int64),  # largest change that the PC asks for
        ("word_limit", np.int64),  # largest total that the request's word holds
        ("count_mm", np.float64),
        ("step_mm", np.float64),
        ("reversal_mm", np.float64),  # hysteresis of the direction
        ("margin_steps", np.float64),  # hysteresis of the rounding
        ("home_mm", np.float64),  # position of home in the coordinates of the model
        ("home_count", np.int64),  # what the box must report at home
        ("at_outside", np.int64),  # what becomes of the correction where the model has no answer
        # orders from the operator
        ("probing", np.int64),
        ("large_meant", np.int64),  # 1: the next request may exceed the window, once
        # state
        ("next_ps", np.int64),
        ("slot_ps", np.int64),  # the 10 ms slot that next_ps belongs to
        ("state", np.int64),
        ("position", np.int64),
        ("completed", np.int64),
        ("accepted", np.int64),
        ("status", np.int64),
        ("direction", np.int64),
        ("extreme", np.int64),
        ("target", np.int64),  # total of steps that the prediction asks for
        ("sent", np.int64),
        ("commanded_ps", np.int64),  # when it last gave the home command
        ("large_sent", np.int64),  # 1: the last request carried Large Correction
        ("read_ps", np.int64),  # time of the position that the sensors hold
        ("sensors", np.float64, (SENSORS,)),  # inputs of the model of the axis
        # observations
        ("requests", np.int64),
        ("not_valid", np.int64),
        ("beyond_word", np.int64),  # steps of the target that the word cannot hold
        ("beyond_word_max", np.int64),
        ("outside_turns", np.int64),  # in which the model had no answer
        ("outside_input", np.int64),  # which input was outside at the first of them
    ],
    align=True,
)


@helper
def follow_direction(p: Record, position: int) -> None:
    """Follow the direction of motion: it turns once the axis has come back by the hysteresis."""
    back = (p.extreme - position) * p.direction
    if back <= 0:
        p.extreme = position
    elif back * p.count_mm > p.reversal_mm:
        p.direction = -p.direction
        p.extreme = position
    p.position = position


@helper
def schedule_reading(p: Record, t_ps: int, valid: bool) -> bool:
    """Schedule the next reading: soon where Data Valid is low, else in the next slot; return ``valid``."""
    if not valid:
        p.not_valid += 1
        p.next_ps = t_ps + p.retry_ps
        return False
    p.slot_ps += p.period_ps
    if p.slot_ps <= t_ps:  # the words were not valid for longer than a period
        p.slot_ps += ((t_ps - p.slot_ps) // p.period_ps + 1) * p.period_ps
    p.next_ps = p.slot_ps
    return True


@helper
def pc_read(p: Record, up: Record, t_ps: int) -> bool:
    """Read the box's words; return whether a prediction for ``position`` and ``direction`` is wanted."""
    deliver(up, t_ps)
    if not schedule_reading(p, t_ps, up.delivered > 0 and t_ps - up.delivered_ps >= p.valid_after_ps):
        return False
    p.completed = up.word1
    p.accepted = up.word2
    p.status = up.word3
    if p.status == box.I_STILL_DONT_BELIEVE_YOU or (p.state == ACTIVE and p.status == box.STATUS_NOT_HOMED):
        p.state = HOLD  # a box without a home has restarted and lost its totals
        return False
    if p.state == WAITING and p.status != box.STATUS_NOT_HOMED and up.word0 == p.home_count:
        p.state = ACTIVE
        p.extreme = up.word0
        p.sent = p.accepted
    if p.state != ACTIVE:
        return False
    follow_direction(p, up.word0)
    return True


@helper
def sense(p: Record, t_ps: int, read_ps: int, axis: int) -> None:
    """Set the model's inputs: the axis position as of ``read_ps``, its direction and velocity, and the clock.

    The velocity is the difference of two readings over their interval; it is zero at the first reading and kept
    between readings.
    """
    sensors = p.sensors
    position_mm = p.home_mm + p.position * p.count_mm
    if p.read_ps == -NEVER:
        sensors[VELOCITY] = 0.0
    elif read_ps > p.read_ps:
        sensors[VELOCITY] = (position_mm - sensors[POSITION]) / ((read_ps - p.read_ps) / PS_PER_S)
    p.read_ps = read_ps
    sensors[POSITION] = position_mm
    sensors[AXES + axis - 1] = position_mm
    sensors[DIRECTION] = p.direction
    sensors[TIME] = t_ps / PS_PER_S


@helper
def pc_start(p: Record, down: Record, t_ps: int) -> None:
    """Command the box to take the present position of the axis as home; nothing else happens before it answers."""
    if p.state == WAITING and t_ps - p.commanded_ps >= p.period_ps:
        p.commanded_ps = t_ps
        post(down, t_ps, 0, box.GO_HOME, 0, 0)


@helper
def fall_back(p: Record, model: Any, deviation_mm: float) -> float:
    """Return the deviation to correct: where the model has no answer, what the operator chose for that.

    It stays no number, which holds the machine, where that was chosen, where a sensor is lost, and where the axis
    stands outside the model's positions.
    """
    outside = model[OUTSIDE]
    if outside[0] == INSIDE:
        return deviation_mm
    if p.outside_turns == 0:
        p.outside_input = outside[0]
    p.outside_turns += 1
    if p.at_outside == KEEP_OUTSIDE:
        return float(p.target * p.step_mm)
    return 0.0 if p.at_outside == ZERO_OUTSIDE else deviation_mm


@helper
def pc_request(p: Record, down: Record, t_ps: int, deviation_mm: float) -> None:
    """Turn the predicted deviation into the next request and send it.

    Added counts pull the axis back, so the total is +deviation / step. A deviation that is no number, or as large
    as a machine, is that of a model which sees something that it was not made for: the machine is held.
    """
    if not abs(deviation_mm) < BEYOND_EVERYTHING_MM:
        p.state = HOLD
        return
    wanted = deviation_mm / p.step_mm
    if abs(wanted - p.target) > 0.5 + p.margin_steps:
        p.target = int(math.floor(wanted + 0.5))
    goal = min(max(p.target, -p.word_limit), p.word_limit)
    p.beyond_word = abs(p.target - goal)
    p.beyond_word_max = max(p.beyond_word_max, p.beyond_word)
    flags = box.PROBING if p.probing == 1 else 0
    sampled = p.accepted == p.sent and p.status == box.OK
    doubted = p.status == box.I_DONT_BELIEVE_YOU and p.large_sent == 0 and abs(p.sent - p.accepted) > p.window
    if p.probing == 0 and (sampled or doubted):
        if p.large_meant == 1:
            p.sent = goal
            if abs(goal - p.accepted) > p.window:
                flags |= box.LARGE_CORRECTION
            p.large_meant = 0
        else:
            p.sent = min(max(goal, p.accepted - p.most), p.accepted + p.most)
    elif p.accepted != p.sent and p.large_sent == 1:
        flags |= box.LARGE_CORRECTION
    p.large_sent = 1 if flags & box.LARGE_CORRECTION else 0
    p.requests += 1
    post(down, t_ps, p.sent, flags, 0, 0)


@helper
def pc_reset(p: Record, first_ps: int) -> None:
    """Switch the PC on."""
    p.next_ps = first_ps
    p.slot_ps = first_ps
    p.state = WAITING
    p.status = box.STATUS_NOT_HOMED
    p.position = 0
    p.completed = 0
    p.accepted = 0
    p.direction = 1
    p.extreme = 0
    p.target = 0
    p.sent = 0
    p.large_sent = 0
    p.commanded_ps = -NEVER
    p.requests = 0
    p.not_valid = 0
    p.beyond_word = 0
    p.beyond_word_max = 0
    p.outside_turns = 0
    p.outside_input = INSIDE
    for k in range(SENSORS):
        p.sensors[k] = math.nan
    p.read_ps = -NEVER
