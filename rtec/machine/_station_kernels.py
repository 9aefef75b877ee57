"""Compiled axis with its box as one node of a bus: program, servo, encoder, cable, box, controller.

The axis follows moves one after the other by speed and acceleration, under a feed override that goes to zero while
the machine is held. Lines, box and controller are the step functions of the closed loop; between two readings of the
box nothing of the bus can reach them, so a station runs on its own from one reading to the next.

::

    moves -> servo -> axis -> encoder -> cable -> box (injector, node) -> controller -> servo
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper, kernel, step
from rtec.axis._kernels import (
    ENCODER,
    PIECE,
    emit,
    encoder_level,
    encoder_reset,
    glitch_toggle,
    next_crossing,
    set_piece,
    turning_points,
)
from rtec.controller._kernels import RECEIVER, receiver_edge, receiver_reset, receiver_settle
from rtec.injector._design_kernels import B
from rtec.injector._kernels import (
    injector_edge,
    injector_enable,
    injector_fire,
    injector_power,
    injector_request,
    injector_reset,
)
from rtec.injector._monitor_kernels import observe
from rtec.injector._state_kernels import ARMED, INJECTOR, INSERTING
from rtec.machine._loop_kernels import next_edge
from rtec.machine._servo_kernels import SERVO, servo_tick
from rtec.requester._box_kernels import NOT_HOMED, RUNNING
from rtec.requester._box_node_kernels import (
    BOX_NODE,
    WORD_RIGHT,
    WORD_STALE,
    WORD_TORN,
    box_receive,
    box_start,
    box_turn,
    holds_machine,
    node_trip,
)
from rtec.signal._kernels import ILLEGAL, NEVER, count_delta

# what a fault does to a station
NO_FAULT = 0
BOX_RESTART, POWER_OFF, CABLE_OPEN, LINES_SWAPPED, LINE_BROKEN, GLITCHES, SWITCH_THROWN, PROBE_TRIP = (
    20, 21, 22, 23, 24, 25, 26, 27,
)  # fmt: skip
STALE_WORD, TORN_WORD = 28, 29

WHOLE, OPEN, SWAPPED, BROKEN = 0, 1, 2, 3

GLITCH_LEVEL = 1 << 13
"""Of 2^16: one edge in eight is followed by a glitch."""
GLITCH_PS = 300_000
"""Width of such a glitch: wide enough for the controller's filter to see."""

KEPT = 32
"""Changes of the lines that are kept, where they are."""
AFTER = 6
"""Of them, so many after the end of an insertion."""

NO_ALARM, FOLLOWING, ILLEGAL_LINES = 0, 1, 2
"""Why the controller has stopped the drive: the axis does not follow, or its input saw an illegal transition."""

STATION = np.dtype(
    [
        ("encoder", ENCODER),
        ("piece", PIECE),
        ("injector", INJECTOR),
        ("receiver", RECEIVER),
        ("servo", SERVO),
        ("node", BOX_NODE),
        # parameters
        ("acceleration", np.float64),  # of the moves, counts/s^2
        ("ramp_s", np.float64),  # of the feed override between 0 and 1
        ("following_limit", np.float64),  # counts beyond the lag of the feed, at which the controller stops the drive
        ("repeats", np.int64),  # 1: after the last move comes the first
        # motion
        ("event_ps", np.int64),
        ("tick_open", np.int64),
        ("acceleration_now", np.float64),
        ("turn_s", np.float64),
        ("part_end_s", np.float64),
        ("moving_to", np.int64),  # move of the program
        ("arrived_ps", np.int64),  # at its end; NEVER: still under way
        ("command_speed", np.float64),
        ("lag", np.float64),  # counts that the axis may lag behind at the feed of the last while
        ("override", np.float64),
        ("going_home", np.int64),  # 1: back to the encoder's home, whatever the controller counts
        # cable between encoder and box
        ("cable", np.int64),
        ("cable_level", np.int64),  # what a broken cable says
        ("lines", np.int64),  # levels behind the cable
        ("box_count", np.int64),  # by the box's decoder
        ("illegal_in", np.int64),
        ("cable_struck", np.int64),  # moments at which a broken cable said something else than the encoder
        # what stops it
        ("powered", np.int64),
        ("pc_holds", np.int64),
        ("alarm", np.int64),
        ("alarm_ps", np.int64),
        ("held_ps", np.int64),  # since when it is held; NEVER: it is not
        # a fault that waits for an insertion to be under way
        ("lurking", np.int64),
        ("struck_ps", np.int64),
        # the last changes of the lines, for whoever wants to see an insertion
        ("keeps", np.int64),  # 1: they are kept
        ("kept", np.int64),  # changes so far
        ("kept_ps", np.int64, (KEPT,)),
        ("kept_in", np.int64, (KEPT,)),
        ("kept_out", np.int64, (KEPT,)),
        ("seen_inserted", np.int64),
        ("still_to_keep", np.int64),  # changes after an insertion until it is put aside
        ("aside", np.int64),  # changes put aside
        ("aside_ps", np.int64, (KEPT,)),
        ("aside_in", np.int64, (KEPT,)),
        ("aside_out", np.int64, (KEPT,)),
        # observations
        ("starts", np.int64),
        ("moves", np.int64),
        ("travel_mm", np.float64),
    ],
    align=True,
)


@step
def behind_cable(st: Record, level: int) -> int:
    """Return the levels that the box gets."""
    if st.cable == WHOLE:
        return level
    if st.cable == OPEN:
        return 3  # both inputs are pulled up
    if st.cable == SWAPPED:
        return (level >> 1) | ((level & 1) << 1)
    return (level & 2) | (st.cable_level & 1)  # A rests, B goes on


@helper
def keep(st: Record, t_ps: int) -> None:
    """Keep what the lines say on both sides of the box; put it aside a few changes after each insertion."""
    s = st.injector
    inserted = s.inserted != st.seen_inserted
    k = (st.kept - 1) % KEPT
    if st.kept == 0 or st.kept_in[k] != st.lines or st.kept_out[k] != s.ab_out:
        if st.kept == 0 or st.kept_ps[k] != t_ps:  # changes at one instant are one change
            k = st.kept % KEPT
            st.kept += 1
        st.kept_ps[k] = t_ps
        st.kept_in[k] = st.lines
        st.kept_out[k] = s.ab_out
    elif not inserted:
        return
    if inserted:
        st.seen_inserted = s.inserted
        st.still_to_keep = AFTER
    elif st.still_to_keep > 0:
        st.still_to_keep -= 1
        if st.still_to_keep == 0:
            put_aside(st)


@step
def put_aside(st: Record) -> None:
    """Copy the changes kept, the oldest first."""
    st.aside = min(st.kept, KEPT)
    first = st.kept - st.aside
    for i in range(st.aside):
        k = (first + i) % KEPT
        st.aside_ps[i] = st.kept_ps[k]
        st.aside_in[i] = st.kept_in[k]
        st.aside_out[i] = st.kept_out[k]


@helper
def take_lines(st: Record, t_ps: int) -> None:
    """Send what the cable says at ``t_ps`` through the box to the controller."""
    s = st.injector
    while s.next_ps <= t_ps:
        fire_box(st)
    right = encoder_level(st.encoder)
    level = behind_cable(st, right)
    if level != right:
        st.cable_struck += 1
    if level == st.lines:
        return
    delta = count_delta(st.lines, level)
    if delta == ILLEGAL:
        st.illegal_in += 1
    else:
        st.box_count += delta
    st.lines = level
    injector_edge(s, t_ps, level)
    if observe(s):
        receiver_edge(st.receiver, t_ps, s.ab_out)
    if st.keeps == 1:
        keep(st, t_ps)


@helper
def fire_box(st: Record) -> None:
    """Carry out the box's own next event; a fault that lurks strikes while an insertion is under way."""
    s = st.injector
    t_ps = s.next_ps
    if st.lurking != NO_FAULT and s.design == B and s.phase == ARMED:
        surprise(st, t_ps)  # its insertion is one change: the last moment before it
        return
    injector_fire(s)
    if s.next_ps > t_ps and observe(s):
        receiver_edge(st.receiver, t_ps, s.ab_out)
    if st.keeps == 1:
        keep(st, t_ps)
    if st.lurking != NO_FAULT and s.phase == INSERTING and s.next_ps > t_ps:
        surprise(st, t_ps)


@helper
def surprise(st: Record, t_ps: int) -> None:
    """Let the fault that waited strike."""
    kind = st.lurking
    st.lurking = NO_FAULT
    st.struck_ps = t_ps
    begin_fault(st, t_ps, kind)


@helper
def fire_between_edges(st: Record) -> None:
    """Carry out the box's own next event; the lines change at once where a fault of the cable strikes with it."""
    t_ps = st.injector.next_ps
    before = st.lurking
    fire_box(st)
    if st.lurking != before:
        take_lines(st, t_ps)


@helper
def strike(st: Record, t_ps: int, kind: int) -> None:
    """Let a fault begin at the station, which has been run up to ``t_ps``."""
    begin_fault(st, t_ps, kind)
    if kind in (CABLE_OPEN, LINES_SWAPPED, LINE_BROKEN):
        take_lines(st, t_ps)


@helper
def begin_fault(st: Record, t_ps: int, kind: int) -> None:
    """Let a fault begin, but leave the lines behind a broken cable to the caller.

    Functions that call each other in a circle crash when numba loads them from its cache.
    """
    s, n = st.injector, st.node
    if kind == BOX_RESTART:
        switch_power(st, t_ps, 0)
        switch_power(st, t_ps, 1)
    elif kind == POWER_OFF:
        switch_power(st, t_ps, 0)
    elif kind == SWITCH_THROWN:
        n.box.switch_on = 0
        injector_enable(s, t_ps, 0)
    elif kind == PROBE_TRIP:
        node_trip(n, st.box_count)
    elif kind == STALE_WORD:
        n.word_kept = st.box_count - n.box.zero
        n.word_fault = WORD_STALE
    elif kind == TORN_WORD:
        n.word_kept = st.box_count - n.box.zero
        n.word_fault = WORD_TORN
    elif kind in (CABLE_OPEN, LINES_SWAPPED, LINE_BROKEN):
        st.cable_level = st.lines
        st.cable = OPEN if kind == CABLE_OPEN else SWAPPED if kind == LINES_SWAPPED else BROKEN
    elif kind == GLITCHES:
        st.encoder.glitch_level = GLITCH_LEVEL
        st.encoder.glitch_ps = GLITCH_PS


@helper
def mend(st: Record, t_ps: int, kind: int) -> None:
    """Let a fault end at ``t_ps``."""
    if kind == POWER_OFF:
        switch_power(st, t_ps, 1)
    elif kind == SWITCH_THROWN:
        st.node.box.switch_on = 1
    elif kind in (STALE_WORD, TORN_WORD):
        st.node.word_fault = WORD_RIGHT
    elif kind in (CABLE_OPEN, LINES_SWAPPED, LINE_BROKEN):
        st.cable = WHOLE
        take_lines(st, t_ps)
    elif kind == GLITCHES:
        st.encoder.glitch_level = 0


@helper
def switch_power(st: Record, t_ps: int, on: int) -> None:
    """Take the power of the box away or give it back; the gates are powered by the controller."""
    s = st.injector
    injector_power(s, t_ps, on)
    if observe(s):
        receiver_edge(st.receiver, t_ps, s.ab_out)
    st.powered = on
    if on == 1:
        st.starts += 1
        next_ps = st.node.box.next_ps
        box_start(st.node, t_ps, st.node.session + 1)
        st.node.box.next_ps = next_ps
        st.box_count = 0
        st.illegal_in = 0
    else:
        st.node.out.waiting = 0


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
def open_tick(
    st: Record, targets: NDArray[np.float64], speeds: NDArray[np.float64], rests: NDArray[np.int64]
) -> None:
    """Begin a tick of the servo: its acceleration holds until the next."""
    servo, piece = st.servo, st.piece
    speed = next_command(st, targets, speeds, rests)
    if st.alarm == NO_ALARM:
        acceleration = servo_tick(st, speed, 0, targets)
        # a position loop answers the feed like a delay of 1 / Kv
        st.lag += (speed * (1.0 - servo.feedforward) / servo.gain_per_s - st.lag) * servo.gain_per_s * servo.period_s
        lag = servo.command - st.receiver.count * servo.counts_per_unit
        if st.receiver.fault == 1:
            st.alarm = ILLEGAL_LINES
            st.alarm_ps = servo.now_ps
        elif abs(lag - st.lag) > st.following_limit:
            st.alarm = FOLLOWING
            st.alarm_ps = servo.now_ps
    elif abs(servo.v) < servo.standstill + servo.period_s * st.acceleration:
        servo.v = 0.0  # the drive is off and the brake on
        acceleration = 0.0
    else:
        acceleration = -st.acceleration if servo.v > 0.0 else st.acceleration
    piece.start_ps = servo.now_ps
    piece.x0 = servo.x
    piece.v0 = servo.v
    piece.a0 = acceleration
    piece.j0 = 0.0
    st.acceleration_now = acceleration
    st.turn_s, _ = turning_points(servo.v, acceleration, 0.0, servo.period_s)
    st.tick_open = 1
    open_part(st, 0.0)


@step
def open_part(st: Record, from_s: float) -> None:
    """Begin a part of the tick in which the motion does not turn."""
    st.part_end_s = st.turn_s if from_s < st.turn_s else st.servo.period_s
    set_piece(st.piece, from_s, st.part_end_s)


@helper
def close_tick(st: Record) -> None:
    """End a tick of the servo."""
    servo, p = st.servo, st.piece
    servo.x = p.x0 + servo.period_s * (p.v0 + servo.period_s * p.a0 / 2.0)
    servo.v += st.acceleration_now * servo.period_s
    servo.now_ps += servo.period_ps
    servo.ticks += 1
    st.travel_mm += abs(servo.v) * servo.period_s * servo.count_mm
    st.tick_open = 0


@helper
def run_lines(st: Record, until_ps: int, closing: bool) -> None:
    """Carry out what the lines do before ``until_ps``; closing, every crossing of this part, jitter or not."""
    e, s = st.encoder, st.injector
    crossing_ps = next_crossing(e, st.piece)
    edge_ps = next_edge(st, crossing_ps)
    while True:
        other_ps = min(s.next_ps, e.glitch_next_ps)
        t_ps = min(edge_ps, other_ps)
        if t_ps >= until_ps and not (closing and edge_ps != NEVER):
            return
        st.event_ps = max(t_ps, st.event_ps)
        if edge_ps <= other_ps:
            emit(e, crossing_ps, st.piece.sign)
            e.last_ps = edge_ps
            take_lines(st, edge_ps)
            crossing_ps = next_crossing(e, st.piece)
            edge_ps = next_edge(st, crossing_ps)
        elif other_ps == e.glitch_next_ps:
            t_ps = max(glitch_toggle(e), e.last_ps + 1)
            e.last_ps = t_ps
            st.event_ps = max(t_ps, st.event_ps)
            take_lines(st, t_ps)
            edge_ps = next_edge(st, crossing_ps)
        else:
            fire_between_edges(st)


@helper
def station_advance(
    st: Record, until_ps: int, targets: NDArray[np.float64], speeds: NDArray[np.float64], rests: NDArray[np.int64]
) -> None:
    """Run axis, lines and controller up to ``until_ps``."""
    servo = st.servo
    while True:
        if st.tick_open == 0:
            if servo.now_ps >= until_ps:
                return
            open_tick(st, targets, speeds, rests)
        part_end_ps = servo.now_ps + int(st.part_end_s * 1e12 + 0.5)
        if until_ps < part_end_ps:
            run_lines(st, until_ps, False)
            return
        run_lines(st, part_end_ps, True)
        if st.part_end_s < servo.period_s:
            open_part(st, st.part_end_s)
        else:
            close_tick(st)


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


@helper
def station_settle(st: Record) -> None:
    """Let what is under way in the box end and the filter see the last edge, so that counts can be audited."""
    s, rx, e = st.injector, st.receiver, st.encoder
    t_ps = max(st.servo.now_ps, st.event_ps)
    if s.enabled == 1:
        injector_enable(s, t_ps, 0)
    while min(s.next_ps, e.glitch_next_ps) != NEVER:
        if e.glitch_next_ps <= s.next_ps:
            t_ps = max(glitch_toggle(e), e.last_ps + 1)
            e.last_ps = t_ps
            take_lines(st, t_ps)
        else:
            t_ps = s.next_ps
            fire_between_edges(st)
    receiver_settle(rx, max(t_ps, rx.last_ps) + rx.sure_ps + 4 * rx.unseen_ps + 1)


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
    st: Record, until_ps: int, targets: NDArray[np.float64], speeds: NDArray[np.float64], rests: NDArray[np.int64]
) -> int:
    """Run the station to ``until_ps``, or to its next reading that wants to send; return the time reached."""
    while st.node.box.next_ps < until_ps:
        t_ps = st.node.box.next_ps
        station_advance(st, t_ps, targets, speeds, rests)
        station_turn(st, t_ps)
        if st.node.out.waiting > 0:
            return t_ps
    station_advance(st, until_ps, targets, speeds, rests)
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
    station_settle(st)


@kernel
def show_insertion(st: Record) -> int:
    """Put aside what is kept where an insertion has ended since; return how many changes are there to be seen."""
    if st.still_to_keep > 0:
        put_aside(st)
    return int(st.aside)
