"""The closed loop in one compiled function: program, servo, axis, encoder, box, PC and receiver.

Time advances from one servo tick to the next. Within a tick the acceleration is constant, so that the lines' crossing
times have a closed form; box, PC and encoder events are taken in the order of their times. An axis at rest, with
nothing left to do for box and PC, is carried to the next time at which anything can change.
"""

from __future__ import annotations

from typing import Any

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
    jitter,
    next_crossing,
    set_piece,
    turning_points,
)
from rtec.controller._kernels import RECEIVER, receiver_edge, receiver_index, receiver_reset, receiver_settle
from rtec.injector._kernels import (
    injector_edge,
    injector_enable,
    injector_fire,
    injector_request,
    injector_reset,
)
from rtec.injector._monitor_kernels import observe
from rtec.injector._state_kernels import INJECTOR
from rtec.link._kernels import MAILBOX, mailbox_reset
from rtec.machine._firmware_kernels import (
    firmware_edge,
    forget_round,
    run_firmware,
    skip_rounds,
    stop_firmware,
    words_valid,
)
from rtec.machine._laser_kernels import PLAY, READER, follow_play, read_laser, true_mm
from rtec.machine._rest_kernels import box_rests, carry_pc_to, carry_to, ticks_at_rest
from rtec.machine._servo_kernels import SERVO, command_at, servo_tick
from rtec.machine._thermometer_kernels import THERMOMETERS, read_thermometers
from rtec.predictors._kernels import believed_mm
from rtec.requester._box_kernels import BOX, box_reset, box_tick
from rtec.requester._pc_kernels import HOLD, PC, pc_look, pc_read, pc_request, pc_reset, pc_start, sense
from rtec.signal._kernels import NEVER

RUNNING, FINISHED, HELD, FAULTED = 0, 1, 2, 3

MACHINE = np.dtype(
    [
        ("encoder", ENCODER),
        ("piece", PIECE),
        ("injector", INJECTOR),
        ("receiver", RECEIVER),
        ("servo", SERVO),
        ("play", PLAY),
        ("reader", READER),
        ("box", BOX),
        ("pc", PC),
        ("down", MAILBOX),
        ("up", MAILBOX),
        ("thermometers", THERMOMETERS),
        ("restless", np.int64),  # 1: what the PC believes may change while the axis stands
        ("correcting", np.int64),  # 0: no PC and no box, the lines pass
        ("skipping", np.int64),  # 0: every tick is computed, for comparison
        ("event_ps", np.int64),  # of the last event carried out
        ("status", np.int64),
    ],
    align=True,
)


@step
def deliver_lines(m: Record, t_ps: int) -> None:
    """Let the receiver see what the behavioural box drives, once all events of this instant are carried out."""
    if observe(m.injector):
        receiver_edge(m.receiver, t_ps, m.injector.ab_out)


@step
def take_edge(m: Record, box: Any, t_ps: int) -> None:
    """Send a transition of the encoder through the box."""
    if box is None:
        while m.injector.next_ps <= t_ps:
            injector_fire(m.injector)
        injector_edge(m.injector, t_ps, encoder_level(m.encoder))
        deliver_lines(m, t_ps)
    else:
        firmware_edge(m, box, t_ps)


@step
def next_of_box(m: Record, box: Any) -> int:
    """Return the time of the behavioural box's next event; that of a running firmware is not known beforehand."""
    if box is None:
        return min(m.injector.next_ps, m.box.next_ps) if m.correcting == 1 else m.injector.next_ps
    return NEVER


@helper
def converse_box(m: Record, t_ps: int) -> None:
    """Let the box read the PC's words and pass its request on to the injector."""
    total = box_tick(m.box, m.down, m.up, t_ps, m.encoder.count, m.injector.completed)
    allowed = 1 if m.box.switch_on == 1 and m.box.probing == 0 else 0
    if m.injector.enabled != allowed:
        injector_enable(m.injector, t_ps, allowed)
    if total != m.injector.requested:
        injector_request(m.injector, t_ps, total)


@helper
def converse_pc(m: Record, box: Any, t_ps: int, model: Any) -> None:
    """Let the PC look at the box's words and send its next request."""
    pc_start(m.pc, m.down, t_ps)
    if box is not None and not words_valid(box):
        pc_look(m.pc, t_ps, False)
        return
    if pc_read(m.pc, m.up, t_ps):
        read_thermometers(m.thermometers, t_ps, m.pc.sensors)
        sense(m.pc, t_ps, m.up.delivered_ps, 1)
        pc_request(m.pc, m.down, t_ps, believed_mm(model, m.pc.sensors, 0))


@step
def next_edge(m: Record, crossing_ps: int) -> int:
    """Return when the line crossed at ``crossing_ps`` gives its edge, jitter included; nothing comes too late."""
    if crossing_ps == NEVER:
        return NEVER
    e = m.encoder
    edge_ps = crossing_ps + jitter(e.seed, e.serial + 1, e.jitter_ps)
    return max(edge_ps, max(e.last_ps + 1, m.event_ps))


@step
def run_part(m: Record, box: Any, end_ps: int, model: Any) -> None:
    """Carry out all events of one part of a tick, in which the motion does not turn."""
    e, s = m.encoder, m.injector
    crossing_ps = next_crossing(e, m.piece)
    edge_ps = next_edge(m, crossing_ps)
    while True:
        other_ps = min(next_of_box(m, box), e.glitch_next_ps)
        if m.correcting == 1:
            other_ps = min(other_ps, m.pc.next_ps)
        if box is not None:
            # an edge never lies before what the firmware has done already
            run_firmware(m, box, min(min(edge_ps, other_ps), max(end_ps, m.event_ps)))
        if edge_ps <= other_ps:
            if edge_ps == NEVER:
                return
            emit(e, crossing_ps, m.piece.sign)
            e.last_ps = edge_ps
            m.event_ps = edge_ps
            take_edge(m, box, edge_ps)
            if e.index_every > 0 and e.count % e.index_every == 0:
                receiver_index(m.receiver, edge_ps)
            crossing_ps = next_crossing(e, m.piece)
            edge_ps = next_edge(m, crossing_ps)
            continue
        if other_ps >= end_ps and edge_ps == NEVER:
            return
        m.event_ps = other_ps
        if other_ps == e.glitch_next_ps:
            t_ps = max(glitch_toggle(e), e.last_ps + 1)
            e.last_ps = t_ps
            m.event_ps = t_ps
            take_edge(m, box, t_ps)
        elif other_ps == s.next_ps and box is None:
            injector_fire(s)
            if s.next_ps > other_ps:
                deliver_lines(m, other_ps)
        elif other_ps == m.box.next_ps and box is None:
            converse_box(m, other_ps)
        else:
            converse_pc(m, box, other_ps, model)


@kernel
def start(m: Record, count: int, box_first_ps: int, pc_first_ps: int) -> None:
    """Stand still at ``count`` at time 0, everything switched on."""
    encoder_reset(m.encoder, count)
    level = encoder_level(m.encoder)
    injector_reset(m.injector, level)
    receiver_reset(m.receiver, level)
    box_reset(m.box, box_first_ps)
    pc_reset(m.pc, pc_first_ps)
    mailbox_reset(m.down)
    mailbox_reset(m.up)
    m.servo.x = count
    m.servo.v = 0.0
    m.servo.command = count
    m.servo.moving = 0
    m.servo.program = 1
    m.reader.begun_ps = NEVER
    m.reader.next = 0
    m.play.y_mm = count * m.servo.count_mm
    m.status = RUNNING


@kernel
def switch_on_controller(m: Record, ab: int) -> None:
    """Let the receiver begin with the levels that the box drives."""
    receiver_reset(m.receiver, ab)


@kernel
def run(
    m: Record,
    until_ps: int,
    start_ps: NDArray[np.int64],
    duration_ps: NDArray[np.int64],
    motion: NDArray[np.float64],
    targets_mm: NDArray[np.float64],
    begins_ps: NDArray[np.int64],
    ends_ps: NDArray[np.int64],
    readings_mm: NDArray[np.float64],
    error: Any,
    model: Any,
    own: Any,
    plant: Any,
    trace: Any,
    box: Any,
) -> None:
    """Run the machine up to ``until_ps``; ``motion`` holds x, v, a, j of each segment in counts and seconds.

    ``error``, ``model`` and ``own`` are the axis' true curve, what the PC believes and the controller's own table, as
    `rtec.predictors.binding` makes them; ``plant`` is what the servo moves (`rtec.axis.plant`). ``trace`` is None or
    (array (n, 8), every so many ticks, [rows used]); ``box`` is None, or that of `rtec.machine._firmware_kernels`.
    """
    servo, piece = m.servo, m.piece
    while servo.now_ps < until_ps:
        speed = command_at(servo, servo.now_ps, start_ps, duration_ps, motion)
        acceleration = servo_tick(m, speed, own, plant, 0)
        if trace is not None:
            rows, every, used = trace
            if servo.ticks % every == 0 and used[0] < rows.shape[0]:
                follow_play(m, error)
                row = rows[used[0]]
                row[0] = servo.now_ps / 1e12
                row[1] = servo.command * servo.count_mm
                row[2] = servo.x * servo.count_mm
                row[3] = true_mm(m, servo.now_ps)
                row[4] = m.receiver.count * servo.counts_per_unit * servo.count_mm
                row[5] = m.pc.target
                row[6] = m.injector.completed
                row[7] = m.encoder.count
                used[0] += 1
        resting = servo.v == 0.0 and acceleration == 0.0
        ticks = 1
        if resting:
            ticks = ticks_at_rest(
                m, box, targets_mm, begins_ps, ends_ps, start_ps, duration_ps, motion, until_ps, error
            )
        if box is not None:
            if not (resting and box_rests(m, box)):
                forget_round(box)
            elif ticks > 1 and not skip_rounds(m, box, servo.now_ps + ticks * servo.period_ps):
                ticks = 1
        read_laser(m, ticks, targets_mm, begins_ps, ends_ps, readings_mm, error)
        if ticks > 1:
            servo.now_ps += ticks * servo.period_ps
            servo.skipped += ticks
            servo.ticks += ticks
            if box is None:
                carry_to(m, servo.now_ps)
            else:
                carry_pc_to(m, servo.now_ps)
            continue
        piece.start_ps = servo.now_ps
        piece.x0 = servo.x
        piece.v0 = servo.v
        piece.a0 = acceleration
        piece.j0 = 0.0
        turn_s, _ = turning_points(servo.v, acceleration, 0.0, servo.period_s)
        from_s = 0.0
        while from_s < servo.period_s:
            to_s = turn_s if from_s < turn_s else servo.period_s
            set_piece(piece, from_s, to_s)
            if piece.sign != 0 and piece.sign != servo.moving:
                follow_play(m, error)  # the axis turns here
                servo.moving = piece.sign
            run_part(m, box, servo.now_ps + int(to_s * 1e12 + 0.5), model)
            servo.x = piece.x0 + to_s * (piece.v0 + to_s * piece.a0 / 2.0)
            from_s = to_s
        servo.v += acceleration * servo.period_s
        servo.now_ps += servo.period_ps
        servo.ticks += 1
        if m.correcting == 1 and m.pc.state == HOLD:
            m.status = HELD
            return
        if m.receiver.fault == 1 or servo.failed == 1:
            m.status = FAULTED
            return
    m.status = FINISHED


@kernel
def come_to_rest(m: Record, box: Any) -> None:
    """Stop the axis where it is, let what is under way in the box come to its end and the filter see the last edge.

    After that the counts can be audited, also of an axis that dithers, or that was stopped in the middle of a run.
    """
    s, rx = m.injector, m.receiver
    t_ps = m.servo.now_ps
    if box is not None:
        stop_firmware(m, box, t_ps)
        t_ps = m.event_ps
    elif s.enabled == 1:
        injector_enable(s, t_ps, 0)
    while min(next_change(m, box), m.encoder.glitch_next_ps) != NEVER:
        if m.encoder.glitch_next_ps <= next_change(m, box):
            t_ps = max(glitch_toggle(m.encoder), m.encoder.last_ps + 1)
            m.encoder.last_ps = t_ps
            if box is not None:
                run_firmware(m, box, t_ps)
            take_edge(m, box, t_ps)
        else:
            t_ps = s.next_ps
            injector_fire(s)
            if s.next_ps > t_ps:
                deliver_lines(m, t_ps)
    receiver_settle(rx, max(t_ps, rx.last_ps) + rx.sure_ps + 4 * rx.unseen_ps + 1)


@step
def next_change(m: Record, box: Any) -> int:
    """Return when the behavioural box next changes a line."""
    if box is None:
        return int(m.injector.next_ps)
    return NEVER


@kernel
def exchange(m: Record, exchanges: int, turn: int) -> int:
    """Let PC and box converse on their own, each at its own period; return the steps accepted, of either sign.

    The axis goes back and forth: with each exchange the deviation grows by one step of the box, ``turn`` times, then
    shrinks as often, and so on. An exchange is a look of the PC at valid words, its next request, and the box's
    samples up to the PC's next look; what the box accepts counts as inserted at once. The last request is sampled,
    too.
    """
    made = 0
    place = 0
    steps = 0
    completed = 0
    while made < exchanges or m.down.waiting > 0:
        if made == exchanges or m.box.next_ps <= m.pc.next_ps:
            total = box_tick(m.box, m.down, m.up, m.box.next_ps, place * 100, completed)
            steps += abs(total - completed)
            completed = total
        else:
            t_ps = m.pc.next_ps
            pc_start(m.pc, m.down, t_ps)
            if pc_read(m.pc, m.up, t_ps):
                made += 1
                phase = made % (2 * turn)
                place = min(phase, 2 * turn - phase)
                pc_request(m.pc, m.down, t_ps, place * m.pc.step_mm)
    return steps
