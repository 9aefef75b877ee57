"""Compiled axis with its box as one node of a bus: program, servo, encoder, cable, box, controller.

The axis follows moves one after the other by speed and acceleration, under a feed override that goes to zero while
the machine is held. Lines, box and controller are the step functions of the closed loop; between two readings of the
box nothing of the bus can reach them, so a station runs on its own from one reading to the next.

::

    moves -> servo -> axis -> encoder -> cable -> box (injector, node) -> controller -> servo
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper, kernel, step
from rtec.axis._kernels import encoder_level, encoder_reset
from rtec.controller._kernels import receiver_reset, receiver_settle
from rtec.injector._kernels import (
    injector_enable,
    injector_request,
    injector_reset,
)
from rtec.machine._axis_kernels import open_tick, run_tick, settle_lines
from rtec.machine._line_kernels import (
    FOLLOWING,
    ILLEGAL_LINES,
    NO_ALARM,
    mend,
    put_aside,
    strike,
)
from rtec.machine._servo_kernels import servo_tick
from rtec.requester._box_kernels import NOT_HOMED, RUNNING
from rtec.requester._box_node_kernels import (
    box_receive,
    box_start,
    box_turn,
    holds_machine,
)
from rtec.signal._kernels import NEVER


@step
def is_held(st: Record) -> bool:
    """Return whether the machine is held: by the PC, by the box's open contact, or by the controller's own alarm."""
    return bool(st.pc_holds == 1 or st.powered == 0 or st.alarm != NO_ALARM or holds_machine(st.node))


@step
def next_command(
    st: Record, targets: NDArray[np.float64], speeds: NDArray[np.float64], rests: NDArray[np.int64]
) -> float:
    """Carry the command one tick on along the moves; return its velocity in counts/s."""
    servo = st.servo
    dt = servo.period_s
    held = is_held(st)
    if held and st.held_ps == NEVER:
        st.held_ps = servo.now_ps
    if not held:
        st.held_ps = NEVER
    runs = not held and st.node.box.state == RUNNING
    aim = 1.0 if runs or st.going_home == 1 else 0.0
    st.override = min(max(aim, st.override - dt / st.ramp_s), st.override + dt / st.ramp_s)
    if st.going_home == 1:
        target = float(st.receiver.count - st.encoder.count)
        feed = st.servo.max_speed / 8.0
    elif st.moving_to < targets.size:
        target = targets[st.moving_to]
        feed = speeds[st.moving_to]
    else:
        target = servo.command
        feed = 0.0
    rest = target - servo.command
    fastest = min(feed * st.override, math.sqrt(2.0 * st.acceleration * abs(rest)))
    wanted = fastest if rest > 0.0 else -fastest
    most = st.acceleration * dt
    speed = min(max(wanted, st.command_speed - most), st.command_speed + most)
    if abs(rest) <= abs(speed) * dt or (abs(rest) < 1e-9 and abs(speed) <= most):
        servo.command = target
        st.command_speed = 0.0
        arrive(st, targets, rests)
        return 0.0
    servo.command += speed * dt
    st.command_speed = speed
    return speed


@step
def arrive(st: Record, targets: NDArray[np.float64], rests: NDArray[np.int64]) -> None:
    """Rest at the end of a move as long as it says, then go on to the next."""
    if st.going_home == 1 or st.moving_to >= targets.size:
        return
    if st.arrived_ps == NEVER:
        st.arrived_ps = st.servo.now_ps
    if st.servo.now_ps - st.arrived_ps >= rests[st.moving_to] and st.override == 1.0:
        st.arrived_ps = NEVER
        st.moving_to += 1
        st.moves += 1
        if st.moving_to == targets.size and st.repeats == 1:
            st.moving_to = 0


@helper
def acceleration_of_tick(
    st: Record,
    targets: NDArray[np.float64],
    speeds: NDArray[np.float64],
    rests: NDArray[np.int64],
    plant: Any,
    place: int,
) -> float:
    """Let the controller look at its counts; return what its drive does in this tick, in counts/s^2."""
    servo = st.servo
    speed = next_command(st, targets, speeds, rests)
    if st.alarm == NO_ALARM:
        acceleration = servo_tick(st, speed, None, plant, place)
        # a position loop answers the feed like a delay of 1 / Kv
        st.lag += (speed * (1.0 - servo.feedforward) / servo.gain_per_s - st.lag) * servo.gain_per_s * servo.period_s
        lag = servo.command - st.receiver.count * servo.counts_per_unit
        if st.receiver.fault == 1:
            st.alarm = ILLEGAL_LINES
            st.alarm_ps = servo.now_ps
        elif abs(lag - st.lag) > st.following_limit or servo.failed == 1:
            st.alarm = FOLLOWING
            st.alarm_ps = servo.now_ps
        return acceleration
    if abs(servo.v) < servo.standstill + servo.period_s * st.acceleration:
        servo.v = 0.0  # the drive is off and the brake on
        return 0.0
    return -st.acceleration if servo.v > 0.0 else st.acceleration


@helper
def station_advance(
    st: Record,
    until_ps: int,
    targets: NDArray[np.float64],
    speeds: NDArray[np.float64],
    rests: NDArray[np.int64],
    plant: Any,
    place: int,
) -> None:
    """Run axis, lines and controller up to ``until_ps``."""
    while True:
        if st.tick_open == 0:
            if st.servo.now_ps >= until_ps:
                return
            open_tick(st, acceleration_of_tick(st, targets, speeds, rests, plant, place), None)
        run_tick(st, None, until_ps, None)
        if st.tick_open == 1:
            return


@step
def at_home(st: Record) -> bool:
    """Return whether the axis stands on its home switch, which knows nothing of the encoder's cable."""
    return bool(st.encoder.count == 0 and abs(st.servo.v) <= st.servo.standstill)


@helper
def station_turn(st: Record, t_ps: int) -> None:
    """Let the box take a reading; the station has been run up to ``t_ps``."""
    n, s = st.node, st.injector
    if st.powered == 0:
        n.box.next_ps += n.box.period_ps
        return
    n.at_home = 1 if at_home(st) else 0
    before = n.box.state
    total = box_turn(n, t_ps, st.box_count, s.completed, s.refused, st.illegal_in)
    if before == NOT_HOMED and n.box.state == RUNNING:
        zero_counters(st, t_ps)
    allowed = 1 if n.box.switch_on == 1 and n.box.probing == 0 and n.box.state == RUNNING else 0
    if s.enabled != allowed:
        injector_enable(s, t_ps, allowed)
    if n.box.state == RUNNING and total != s.requested:
        injector_request(s, t_ps, total)


@helper
def zero_counters(st: Record, t_ps: int) -> None:
    """Zero every counter, that of the controller included: the axis stands at home (General Considerations)."""
    s = st.injector
    injector_request(s, t_ps, 0)
    s.completed = 0
    s.requested = 0
    s.ahead = 0
    st.illegal_in = 0
    receiver_settle(st.receiver, t_ps)
    st.receiver.count = st.encoder.count
    st.receiver.fault = 0
    st.servo.command = st.encoder.count
    st.command_speed = 0.0
    st.lag = 0.0
    st.alarm = NO_ALARM
    st.going_home = 0
    st.moving_to = 0
    st.arrived_ps = NEVER


@kernel
def start(st: Record, t_ps: int, first_reading_ps: int, session: int) -> None:
    """Stand still at home at ``t_ps``, everything switched on, nothing homed."""
    encoder_reset(st.encoder, 0)
    level = encoder_level(st.encoder)
    injector_reset(st.injector, level)
    receiver_reset(st.receiver, level)
    st.lines = level
    box_start(st.node, t_ps, session)
    st.node.box.next_ps = first_reading_ps
    st.node.cycle_next_ps = first_reading_ps
    st.servo.now_ps = t_ps
    st.event_ps = t_ps
    st.servo.program = 1
    st.arrived_ps = NEVER
    st.held_ps = NEVER
    st.powered = 1
    st.starts = 1


@kernel
def run(
    st: Record,
    until_ps: int,
    targets: NDArray[np.float64],
    speeds: NDArray[np.float64],
    rests: NDArray[np.int64],
    plant: Any,
) -> int:
    """Run the station to ``until_ps``, or to its next reading that wants to send; return the time reached."""
    while st.node.box.next_ps < until_ps:
        t_ps = st.node.box.next_ps
        station_advance(st, t_ps, targets, speeds, rests, plant, 0)
        station_turn(st, t_ps)
        if st.node.out.waiting > 0:
            return t_ps
    station_advance(st, until_ps, targets, speeds, rests, plant, 0)
    return until_ps


@kernel
def receive(st: Record, t_ps: int, identifier: int, payload: int) -> None:
    """Hand the box a frame."""
    if st.powered == 1:
        box_receive(st.node, t_ps, identifier, payload)


@kernel
def fault(st: Record, t_ps: int, kind: int, begins: int) -> None:
    """Let a fault begin or end at the station."""
    if begins == 1:
        strike(st, t_ps, kind)
    else:
        mend(st, t_ps, kind)


@kernel
def go_home(st: Record) -> None:
    """Take the axis back to its home, as the operator would."""
    # the controller has seen whatever is on its lines before its alarm is cleared
    receiver_settle(st.receiver, max(st.receiver.last_ps, st.servo.now_ps, st.event_ps))
    if st.alarm != NO_ALARM:  # a drive that is switched on again begins where the axis is
        st.servo.command = st.receiver.count * st.servo.counts_per_unit
        st.command_speed = 0.0
        st.lag = 0.0
    st.going_home = 1
    st.alarm = NO_ALARM
    st.receiver.fault = 0
    st.pc_holds = 0


@kernel
def settle(st: Record) -> None:
    """Bring everything under way to its end."""
    settle_lines(st, None)


@kernel
def show_insertion(st: Record) -> int:
    """Put aside what is kept where an insertion has ended since; return how many changes are there to be seen."""
    if st.still_to_keep > 0:
        put_aside(st)
    return int(st.aside)
