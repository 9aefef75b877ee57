"""Compiled axis with its box as one node of a bus: program, servo, encoder, cable, box, controller.

Stations come side by side, ``axes = (stations, moves, plant)``: their records; targets in counts, speeds in counts/s
(along lines in mm/s), rests in ps and lengths of lines in mm, each of shape (axes, moves); what the servos move.
``boxes`` is None where the injectors model them, else their parts as rows (`rtec.machine.firmware_box`). The caller
that owns
the clock calls :func:`advance` and :func:`change_fault` by their addresses, so that an axis is compiled once for all
of them.

The axis follows moves one after the other by speed and acceleration, under a feed override that goes to zero while
the machine is held. Lines, box and controller are the step functions of the closed loop; between two readings of the
box nothing of the bus can reach them, so a station runs on its own from one reading to the next.

::

    moves -> servo -> axis -> encoder -> cable -> box (injector, node) -> controller -> servo
"""

from __future__ import annotations

import math
from typing import Any

from rtec._jit import Record, kernel, step, written_out
from rtec.controller._kernels import receiver_settle
from rtec.machine._axis_kernels import open_tick, run_tick, settle_lines
from rtec.machine._box_kernels import box_obey, box_reading, box_zero
from rtec.machine._fault_kernels import note_effects
from rtec.machine._line_kernels import FOLLOWING, ILLEGAL_LINES, NO_ALARM, fault_at_axis, stand_at_home
from rtec.machine._recorder_kernels import put_aside
from rtec.machine._servo_kernels import servo_tick
from rtec.requester._box_kernels import FATAL, RUNNING
from rtec.requester._box_node_kernels import box_receive, box_start
from rtec.requester._box_turn_kernels import box_check_watchdog, box_say
from rtec.signal._kernels import NEVER


@step
def is_held(st: Record) -> bool:
    """Return whether the machine is held: by the PC, by the box's open contact, or by the controller's own alarm."""
    return bool(st.pc_holds == 1 or st.powered == 0 or st.alarm != NO_ALARM or st.node.box.state == FATAL)


@step
def next_command(st: Record, moves: Any) -> float:
    """Carry the command one tick on along the moves; return its velocity in counts/s."""
    targets, speeds, _, _ = moves
    servo = st.servo
    dt = servo.period_s
    held = is_held(st)
    if held and st.held_ps == NEVER:
        st.held_ps = servo.now_ps
    if not held:
        st.held_ps = NEVER
    along_lines = st.line_acceleration > 0.0
    runs = st.lines_run == 1 if along_lines else not held and st.node.box.state == RUNNING
    aim = 1.0 if runs or st.going_home == 1 else 0.0
    st.override = min(max(aim, st.override - dt / st.ramp_s), st.override + dt / st.ramp_s)
    if along_lines:
        return next_on_line(st, moves)
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
        arrive(st, moves)
        return 0.0
    servo.command += speed * dt
    st.command_speed = speed
    return speed


@step
def next_on_line(st: Record, moves: Any) -> float:
    """Carry the command one tick on along a line that all axes follow; each computes the same share of it to the bit.

    So they need no clock between them, as long as feed override and ticks are the same for all.
    """
    targets, speeds, _, lengths = moves
    servo = st.servo
    dt = servo.period_s
    if st.arrived_ps != NEVER or st.moving_to >= targets.size:
        arrive(st, moves)
        return 0.0
    if st.line_mm == 0.0:
        st.line_from = servo.command
    length = lengths[st.moving_to]
    rest = length - st.line_mm
    most = st.line_acceleration * dt
    fastest = min(speeds[st.moving_to] * st.override, math.sqrt(2.0 * st.line_acceleration * rest))
    speed = min(max(fastest, st.line_speed - most), st.line_speed + most)
    if rest <= speed * dt or (rest < 1e-9 and speed <= most):
        servo.command = targets[st.moving_to]
        st.line_mm = 0.0
        st.line_speed = 0.0
        arrive(st, moves)
        return 0.0
    st.line_mm += speed * dt
    st.line_speed = speed
    counts_per_mm = (targets[st.moving_to] - st.line_from) / length
    servo.command = st.line_from + counts_per_mm * st.line_mm
    return float(counts_per_mm * speed)


@step
def arrive(st: Record, moves: Any) -> None:
    """Rest at the end of a move as long as it says, then go on to the next."""
    targets, _, rests, _ = moves
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


@step
def acceleration_of_tick(st: Record, moves: Any, plant: Any, place: int) -> float:
    """Let the controller look at its counts; return what its drive does in this tick, in counts/s^2."""
    servo = st.servo
    speed = next_command(st, moves)
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


@written_out
def box_of(boxes: Any, i: int) -> Any:
    """Return the box of an axis out of those that lie side by side."""
    parts, run = boxes
    boards, cpu, mem, h, log, queue, rests, snapshots = parts
    execute, words, code = cpu
    return (boards[i], (execute, words[i], code[i]), mem[i], h[i], log[i], queue, rests[i], snapshots[i]), run


@step
def at_home(st: Record) -> bool:
    """Return whether the axis stands on its home switch, which knows nothing of the encoder's cable."""
    return bool(st.encoder.count == 0 and abs(st.servo.v) <= st.servo.standstill)


@step
def turn_box(st: Record, box: Any, t_ps: int) -> None:
    """Let a box take a reading."""
    n, s = st.node, st.injector
    if st.powered != 1:
        n.box.next_ps += n.box.period_ps
        return
    n.at_home = 1 if at_home(st) else 0
    box_check_watchdog(n, t_ps, st.illegal_in, st.alarm != NO_ALARM)
    count = box_reading(st, box, t_ps)
    homed = n.box.homed == 1
    box_say(n, t_ps, count, s.completed, s.refused)
    if homed:
        zero_counters(st, box, t_ps)
    box_obey(st, box, t_ps)


@step
def zero_counters(st: Record, box: Any, t_ps: int) -> None:
    """Zero every counter, that of the controller included: the axis stands at home (General Considerations)."""
    box_zero(st, box, t_ps)
    receiver_settle(st.receiver, t_ps)
    st.receiver.count = st.encoder.count
    st.receiver.fault = 0
    st.servo.command = st.encoder.count
    st.command_speed = 0.0
    st.line_mm = 0.0
    st.line_speed = 0.0
    st.lag = 0.0
    st.alarm = NO_ALARM
    st.going_home = 0
    st.moving_to = 0
    st.arrived_ps = NEVER


@step
def advance_box(st: Record, box: Any, until_ps: int, moves: Any, plant: Any, place: int, reads: bool) -> None:
    """Run an axis with its box, None or as of :func:`box_of`, up to ``until_ps``; there it reads, or not."""
    while st.tick_open == 1 or st.servo.now_ps < until_ps:
        if st.tick_open == 0:
            open_tick(st, acceleration_of_tick(st, moves, plant, place), None)
        run_tick(st, box, until_ps, None)
        if st.tick_open == 1:
            break
    if reads:
        turn_box(st, box, until_ps)


@kernel
def advance(axes: Any, boxes: Any, i: int, until_ps: int, reads: bool) -> None:
    """Run axis, lines, box and controller of axis ``i`` up to ``until_ps``; there the box takes a reading, or not."""
    stations, moves, plant = axes
    targets, speeds, rests, lengths = moves
    own = targets[i], speeds[i], rests[i], lengths[i]
    if boxes is None:
        advance_box(stations[i], None, until_ps, own, plant, i, reads)
    else:
        advance_box(stations[i], box_of(boxes, i), until_ps, own, plant, i, reads)


@kernel
def change_fault(axes: Any, boxes: Any, i: int, f: Record, t_ps: int, begins: bool) -> None:
    """Let the fault that ``f`` tells begin or end at axis ``i``, which has been run up to ``t_ps``."""
    stations, _, _ = axes
    if boxes is None:
        fault_at_axis(stations[i], None, f, t_ps, begins)
    else:
        fault_at_axis(stations[i], box_of(boxes, i), f, t_ps, begins)


@kernel
def settle(axes: Any, boxes: Any, i: int) -> None:
    """Bring everything under way at axis ``i`` to its end."""
    stations, _, _ = axes
    if boxes is None:
        settle_lines(stations[i], None)
    else:
        settle_lines(stations[i], box_of(boxes, i))


@kernel
def start(st: Record, t_ps: int, first_reading_ps: int, session: int) -> None:
    """Stand still at home at ``t_ps``, everything switched on, nothing homed."""
    stand_at_home(st)
    box_start(st.node, t_ps, session)
    st.node.box.framed = 1
    st.node.box.next_ps = first_reading_ps
    st.node.cycle_next_ps = first_reading_ps
    st.servo.now_ps = t_ps
    st.event_ps = t_ps
    st.arrived_ps = NEVER
    st.held_ps = NEVER
    st.starts = 1


@kernel
def run(axes: Any, boxes: Any, steps: Any, until_ps: int) -> int:
    """Run the first axis to ``until_ps``, or to its next reading that wants to send; return the time reached.

    ``steps`` are the addresses of :func:`advance` and :func:`change_fault`.
    """
    advance, _ = steps
    st = axes[0][0]
    while st.node.box.next_ps < until_ps:
        t_ps = st.node.box.next_ps
        advance(axes, boxes, 0, t_ps, True)
        if st.node.out.waiting > 0:
            return t_ps
    advance(axes, boxes, 0, until_ps, False)
    return until_ps


@kernel
def receive(st: Record, t_ps: int, identifier: int, payload: int) -> None:
    """Hand the box a frame."""
    if st.powered == 1:
        box_receive(st.node, t_ps, identifier, payload)


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
def effects(st: Record, f: Record, t_ps: int) -> int:
    """Return how often a fault that lasts has taken effect at a station so far."""
    note_effects(st, f, t_ps)
    return int(f.fired)


@kernel
def show_insertion(st: Record) -> int:
    """Put aside what is kept where an insertion has ended since; return how many changes are there to be seen."""
    if st.still_to_keep > 0:
        put_aside(st)
    return int(st.aside)
