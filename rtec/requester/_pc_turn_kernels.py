"""The PC's turn for one axis on the bus: checks, start-up, its model's deviation, and the request that follows.

What it knows of its box are the last good frames (``_pc_node_kernels``). Whatever is implausible or unexplained ends
in HOLD.
"""

from __future__ import annotations

import math
from typing import Any

from rtec._jit import Record, helper, kernel
from rtec.link import _frame_kernels as frame
from rtec.link._frame_kernels import pack_hold, pack_request, pack_setup
from rtec.link._kernels import deliver, post
from rtec.link._outbox_kernels import put
from rtec.predictors._kernels import AXES, predicted_mm
from rtec.requester import _box_kernels as box, _pc_kernels as pc, _pc_node_kernels as node
from rtec.requester._pc_kernels import fall_back, pc_read, pc_request, schedule_reading, sense
from rtec.requester._pc_node_kernels import pc_hold
from rtec.signal._kernels import NEVER


@helper
def reason_in_fatal(code: int) -> int:
    """Return why the box stands still for good, by its status code."""
    if code == box.I_STILL_DONT_BELIEVE_YOU:
        return node.BOX_STILL_DOUBTS
    if code == box.LINK_LOST:
        return node.BOX_LOST_LINK
    if code == box.AXIS_TAKEN:
        return node.AXIS_TAKEN
    if code == box.IMPLAUSIBLE:
        return node.BOX_IMPLAUSIBLE
    if code == box.ENCODER_FAULT:
        return node.ENCODER_FAULT
    if code == box.SETUP_DIFFERS:
        return node.SETUP_DIFFERS
    if code == box.DRIVE_STOPPED:
        return node.DRIVE_STOPPED
    return node.BOX_HELD


@helper
def reason_in_status(n: Record) -> int:
    """Return why the box's status makes the PC hold, if it does."""
    state = n.box_flags & 7
    if state == box.NOT_HOMED:
        return node.BOX_RESTARTED
    if state == box.FATAL:
        return reason_in_fatal(n.code)
    if state != box.RUNNING or n.code not in (
        box.OK,
        box.STATUS_PROBING,
        box.STATUS_DISABLED,
        box.I_DONT_BELIEVE_YOU,
        box.I_STILL_DONT_BELIEVE_YOU,
        box.REFUSED_TOO_FAST,
    ):
        return node.STATUS_WRONG
    if n.code == box.STATUS_DISABLED and (n.pc.sent != 0 or n.completed != 0 or n.accepted != 0):
        return node.CORRECTIONS_DISABLED
    return node.NONE


@helper
def check_before_turn(n: Record, t_ps: int) -> None:
    """Hold the machine if the PC's own clock, the box's silence or its status requires it."""
    p = n.pc
    since_ps = t_ps - n.turn_ps
    if p.state == pc.ACTIVE:
        if since_ps < 0 or since_ps > n.watchdog_ps:
            pc_hold(n, t_ps, node.CLOCK_JUMP)  # also where this program stood still for so long
        oldest_ps = min(min(n.status_ps, n.corrections_ps), n.position_ps)
        if t_ps - oldest_ps > n.watchdog_ps:
            pc_hold(n, t_ps, node.BOX_SILENT)
        # a bus that delays all frames alike disturbs neither their order nor the watchdog
        behind_ps = ((n.sequence - n.judged) & 0xFF) * p.period_ps
        if behind_ps > n.watchdog_ps + 2 * p.period_ps:
            pc_hold(n, t_ps, node.ANSWER_LATE)
        reason = reason_in_status(n)
        if reason != node.NONE:
            pc_hold(n, t_ps, reason)
        if (
            n.completion_timeout_ps > 0
            and n.open_ps != NEVER
            and t_ps - n.open_ps > n.completion_timeout_ps
            and p.probing == 0
        ):
            pc_hold(n, t_ps, node.NOT_COMPLETED)
        position_mm = p.home_mm + n.position * p.count_mm
        if not n.low_mm <= position_mm <= n.high_mm:
            pc_hold(n, t_ps, node.PREDICTOR_OUT_OF_RANGE)
    elif p.state == pc.WAITING and t_ps - n.status_ps > n.watchdog_ps:
        n.has_status = 0  # a box heard too long ago counts as absent
    n.turn_ps = t_ps


@helper
def say_request(n: Record, total: int, flags: int) -> None:
    """Send a request."""
    n.sequence = (n.sequence + 1) & 0xFF
    put(n.out, frame.REQUEST + n.axis, pack_request(n.axis, n.sequence, total, flags, n.requester, n.session))


@helper
def say_expected(n: Record) -> None:
    """Send the setup that is expected of the box."""
    if n.setup != 0:
        n.expected_sequence += 1
        put(n.out, frame.EXPECTED + n.axis, pack_setup(frame.EXPECTED + n.axis, n.expected_sequence, n.setup))


@helper
def turn_waiting(n: Record, t_ps: int) -> None:
    """Carry out the start-up procedure: reset on the operator's order, home, and wait for the home position.

    A box that runs but was not homed by this PC gets no request: its totals are unknown, and its watchdog is to stop
    it.
    """
    state = n.box_flags & 7
    if state == box.FATAL and n.reset_meant == 1:
        n.homing = 0
        say_request(n, 0, frame.RESET)
    elif state == box.NOT_HOMED:
        if n.code == box.SETUP_DIFFERS and (n.setup == 0 or n.box_setup != n.setup):
            pc_hold(n, t_ps, node.SETUP_DIFFERS)
            return
        if n.homing == 0:
            n.home_seen = 0
        n.homing = 1
        n.reset_meant = 0
        say_expected(n)
        say_request(n, 0, frame.GO_HOME)
    elif state != box.RUNNING or n.homing == 1:
        say_request(n, 0, 0)


@helper
def pc_prepare(n: Record, t_ps: int) -> bool:
    """Begin the turn due at ``t_ps``; return whether a prediction is wanted for ``pc.position`` and ``pc.direction``.

    Where none is, the turn is over.
    """
    p = n.pc
    check_before_turn(n, t_ps)
    if p.state == pc.HOLD:
        schedule_reading(p, t_ps, True)
        n.hold_sequence += 1
        put(n.out, frame.HOLD, pack_hold(n.hold_sequence, n.reason, n.axis))
        if n.reason == node.SETUP_DIFFERS:
            say_expected(n)  # so that the box can say it, too
        say_request(n, p.sent, 0)
        return False
    incomplete = n.has_corrections == 0 or n.has_position == 0
    if n.has_status == 0 or (incomplete and n.box_flags & 7 != box.NOT_HOMED):
        schedule_reading(p, t_ps, True)
        if n.has_status == 1:
            turn_waiting(n, t_ps)
        return False
    counts = n.completed != 0 or n.accepted != 0  # home zeroes the totals, so these are not of this start
    if p.state == pc.WAITING and (n.homing == 0 or n.box_flags & 7 != box.RUNNING or n.valid == 0 or counts):
        schedule_reading(p, t_ps, True)
        turn_waiting(n, t_ps)
        return False
    if p.state == pc.WAITING and n.home_seen == 1:
        p.state = pc.ACTIVE  # the axis may have moved on since
        p.extreme = n.position
        p.sent = n.accepted
    if n.code == box.I_STILL_DONT_BELIEVE_YOU:
        pc_hold(n, t_ps, node.BOX_STILL_DOUBTS)  # although it reports that it runs
        schedule_reading(p, t_ps, True)
        say_request(n, p.sent, 0)
        return False
    code = n.code if n.code != box.REFUSED_TOO_FAST else box.OK  # a late frame is not an implausible one
    post(n.up, t_ps, n.position, n.completed, n.accepted, code)
    if n.valid == 0:
        schedule_reading(p, t_ps, True)
        say_request(n, p.sent, 0)
        return False
    # a box that is not at home gets no request: it missed the home position, and its watchdog is to stop it
    return bool(pc_read(p, n.up, t_ps))


@helper
def pc_finish(n: Record, t_ps: int, deviation_mm: float) -> None:
    """End the turn: turn the predicted deviation into the next request."""
    p = n.pc
    # NaN is beyond every limit
    if not (abs(deviation_mm) <= n.limit_mm or (n.limit_mm == 0.0 and abs(deviation_mm) < pc.BEYOND_EVERYTHING_MM)):
        pc_hold(n, t_ps, node.PREDICTOR_OUT_OF_RANGE if math.isnan(deviation_mm) else node.DEVIATION_LIMIT)
        say_request(n, p.sent, 0)
        return
    # what exceeds the request's word would be lost silently
    if abs(deviation_mm) / p.step_mm > p.word_limit + 0.5 + p.margin_steps:
        pc_hold(n, t_ps, node.BEYOND_WORD)
        say_request(n, p.sent, 0)
        return
    n.last_total = p.sent
    before = p.sent
    pc_request(p, n.down, t_ps, deviation_mm)
    deliver(n.down, t_ps)
    if p.sent != before:
        n.wanted_ps = t_ps
    say_request(n, p.sent, n.down.word1 | frame.ENABLE)


@helper
def pc_predict(n: Record, t_ps: int, model: Any) -> None:
    """End the turn with the model's prediction from the sensors.

    Until all the axes that it looks at have been home, nothing is asked for; after that a sensor that is lost holds
    the machine, as does whatever the model was not made for.
    """
    p = n.pc
    sense(p, t_ps, n.position_ps, n.axis)
    wanted = model[2]
    for k in range(wanted.size):
        at = wanted[k]
        if n.predicted == 0 and AXES <= at and at < AXES + frame.MOST_AXES and math.isnan(p.sensors[at]):
            say_request(n, p.sent, 0)
            return
    n.predicted = 1
    pc_finish(n, t_ps, fall_back(p, model, predicted_mm(model, p.sensors)))


@kernel
def turn(n: Record, t_ps: int, model: Any) -> None:
    """Let the PC take the turn that is due, from outside; the model as `rtec.predictors.binding` makes it."""
    if pc_prepare(n, t_ps):
        pc_predict(n, t_ps, model)
