"""The PC's side of one axis as a node of the bus: frames around its state machine, and what makes it hold.

The box's frames are refused, and counted, where checksum or order are wrong; the latest good ones are the box's four
words for the state machine of ``_pc_kernels``. Whatever the PC cannot believe or explain ends in HOLD, with a reason:
it then asks for nothing any more and says so on the bus until somebody starts it again.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rtec._jit import Record, helper, kernel, step
from rtec.link._crc_kernels import is_sealed
from rtec.link._frame_kernels import (
    AXIS_BITS,
    CORRECTIONS,
    COUNTED_BITS,
    ENABLE,
    GO_HOME,
    HOLD,
    MOST_AXES,
    POSITION,
    PROBE,
    REQUEST,
    RESET,
    STATUS,
    corrections_accepted,
    corrections_completed,
    corrections_judged,
    corrections_session,
    pack_hold,
    pack_request,
    position_counted,
    position_of,
    position_valid,
    probe_trips,
    sequence_of,
    session_of,
    status_code,
    status_flags,
    status_session,
)
from rtec.link._kernels import MAILBOX, deliver, mailbox_reset, post
from rtec.link._outbox_kernels import IN_ORDER, OUTBOX, order_of, put
from rtec.predictors._kernels import AXES, believed_mm
from rtec.requester._box_kernels import (
    AXIS_TAKEN as BOX_AXIS_TAKEN,
    ENCODER_FAULT as BOX_ENCODER_FAULT,
    FATAL,
    I_DONT_BELIEVE_YOU,
    I_STILL_DONT_BELIEVE_YOU,
    IMPLAUSIBLE,
    LINK_LOST,
    NOT_HOMED,
    OK,
    REFUSED_TOO_FAST,
    RUNNING,
    STATUS_DISABLED,
    STATUS_PROBING,
)
from rtec.requester._pc_kernels import (
    ACTIVE,
    BEYOND_EVERYTHING_MM,
    HOLD as HOLDING,
    PC,
    WAITING,
    pc_look,
    pc_read,
    pc_request,
    pc_reset,
    sense,
)
from rtec.signal._kernels import NEVER

# why the PC holds the machine
NONE = 0
BOX_STILL_DOUBTS = 1
BOX_SILENT = 2
BOX_RESTARTED = 3
CORRECTIONS_DISABLED = 4
BOX_LOST_LINK = 5
BOX_HELD = 6
AXIS_TAKEN = 7
POSITION_IMPLAUSIBLE = 8
PREDICTOR_OUT_OF_RANGE = 9
CLOCK_JUMP = 10
ANOTHER_PC = 11
BUS_OFF = 12
OTHER_AXIS = 13
ENCODER_FAULT = 14
BOX_IMPLAUSIBLE = 15
DEVIATION_LIMIT = 16
COMPLETED_WRONG = 17
OPERATOR = 18
NOT_COMPLETED = 19
ANSWER_LATE = 20
STATUS_WRONG = 21
BEYOND_WORD = 22

MOST_DOUBTS = 2
"""Positions in a row that are forgiven although they cannot be: as many as the box forgives unbelievable totals."""

PC_NODE = np.dtype(
    [
        # parameters
        ("axis", np.int64),
        ("requester", np.int64),  # number of this PC, 0 to 7
        ("watch_ps", np.int64),  # longest silence of the box
        ("patience_ps", np.int64),  # longest time that an accepted total may stay unfinished (0: for ever)
        ("most_counts_per_s", np.float64),  # fastest that the axis can move
        ("believed", np.int64),  # 1: the model has been asked
        ("low_mm", np.float64),  # where the predictor knows the axis
        ("high_mm", np.float64),
        ("limit_mm", np.float64),  # largest deviation that is plausible (0: no limit)
        # parts
        ("pc", PC),
        ("down", MAILBOX),
        ("up", MAILBOX),
        ("out", OUTBOX),
        # orders from the operator
        ("reset_meant", np.int64),  # 1: acknowledge the box's fatal error
        # state
        ("reason", np.int64),
        ("held_ps", np.int64),  # when it began to hold
        ("session", np.int64),
        ("has_status", np.int64),
        ("has_corrections", np.int64),
        ("has_position", np.int64),
        ("has_probe", np.int64),
        ("status_ps", np.int64),
        ("corrections_ps", np.int64),
        ("position_ps", np.int64),
        ("status_sequence", np.int64),
        ("corrections_sequence", np.int64),
        ("position_sequence", np.int64),
        ("probe_sequence", np.int64),
        ("code", np.int64),
        ("box_flags", np.int64),
        ("completed", np.int64),
        ("accepted", np.int64),
        ("judged", np.int64),  # the request that the box has judged last
        ("position", np.int64),
        ("valid", np.int64),
        ("doubts", np.int64),  # positions in a row that cannot be
        ("homing", np.int64),  # 1: this PC has sent the axis' box the home command, in this session
        ("home_seen", np.int64),  # 1: and the box has said the home position since
        ("turn_ps", np.int64),
        ("sequence", np.int64),
        ("hold_sequence", np.int64),
        ("trips", np.int64),
        ("trip_position", np.int64),
        ("open_ps", np.int64),  # since when an accepted total is unfinished; NEVER: it is not
        ("wanted_ps", np.int64),  # when the request that is under way was first made; NEVER: none is
        ("last_total", np.int64),
        # observations
        ("answered", np.int64),  # requests that the box has completed
        ("answer_ps", np.int64),  # how long the last of them took
        ("wrong_checksum", np.int64),
        ("out_of_order", np.int64),
        ("implausible", np.int64),  # positions that cannot be
    ],
    align=True,
)


@step
def pc_hold(n: Record, t_ps: int, reason: int) -> None:
    """Hold the machine; the first reason stands."""
    if n.pc.state != HOLDING:
        n.pc.state = HOLDING
        n.reason = reason
        n.held_ps = t_ps


@step
def pc_node_start(n: Record, t_ps: int, sequence: int) -> None:
    """Switch the PC on; it has heard nothing yet, and counts its frames from ``sequence`` on."""
    pc_reset(n.pc, t_ps)
    mailbox_reset(n.down)
    mailbox_reset(n.up)
    n.pc.valid_after_ps = 0  # a frame is whole or not there
    n.out.waiting = 0
    n.reset_meant = 0
    n.reason = NONE
    n.held_ps = NEVER
    n.has_status = 0
    n.has_corrections = 0
    n.has_position = 0
    n.believed = 0
    n.has_probe = 0
    n.valid = 0
    n.doubts = 0
    n.homing = 0
    n.home_seen = 0
    n.turn_ps = -NEVER
    n.sequence = sequence & 0xFF
    n.hold_sequence = 0
    n.trips = 0
    n.open_ps = NEVER
    n.wanted_ps = NEVER
    n.last_total = 0


@step
def follows(n: Record, has: int, last: int, payload: int) -> bool:
    """Return whether a frame follows the last one of its kind."""
    if has == 0 or n.pc.state == WAITING:
        return True
    if order_of(last, sequence_of(payload)) == IN_ORDER:
        return True
    n.out_of_order += 1
    return False


@helper
def take_status(n: Record, t_ps: int, payload: int) -> None:
    """Take a status whose checksum is right."""
    session = status_session(payload)
    if n.has_status == 1 and session != n.session and n.pc.state == ACTIVE:
        pc_hold(n, t_ps, BOX_RESTARTED)
        return
    if not follows(n, n.has_status, n.status_sequence, payload):
        return
    if n.has_status == 0 or session != n.session:
        n.session = session
        n.homing = 0
        n.has_corrections = 0
        n.has_position = 0
        n.has_probe = 0
    n.has_status = 1
    n.status_ps = t_ps
    n.status_sequence = sequence_of(payload)
    n.code = status_code(payload)
    n.box_flags = status_flags(payload)


@helper
def take_corrections(n: Record, t_ps: int, payload: int) -> None:
    """Take totals whose checksum is right."""
    if n.has_status == 0 or corrections_session(payload) != n.session:
        if n.pc.state == ACTIVE:
            pc_hold(n, t_ps, BOX_RESTARTED)
        return
    if not follows(n, n.has_corrections, n.corrections_sequence, payload):
        return
    n.has_corrections = 1
    n.corrections_ps = t_ps
    n.corrections_sequence = sequence_of(payload)
    n.completed = corrections_completed(payload)
    n.accepted = corrections_accepted(payload)
    n.judged = corrections_judged(payload)
    p = n.pc
    if p.state == ACTIVE and n.accepted != p.sent and n.accepted != p.accepted and n.accepted != n.last_total:
        pc_hold(n, t_ps, COMPLETED_WRONG)  # a total that this PC has not asked for
    if n.completed == n.accepted:
        n.open_ps = NEVER
        if n.wanted_ps != NEVER and n.completed == p.sent:
            n.answered += 1
            n.answer_ps = t_ps - n.wanted_ps
            n.wanted_ps = NEVER
    elif n.open_ps == NEVER:
        n.open_ps = t_ps


@helper
def take_position(n: Record, t_ps: int, payload: int) -> None:
    """Take a position whose checksum is right, if the axis can be there."""
    if not follows(n, n.has_position, n.position_sequence, payload):
        return
    sequence = sequence_of(payload)
    position = position_of(payload)
    valid = position_valid(payload)
    if n.has_position == 1 and n.pc.state == ACTIVE and valid == 1:
        # two frames may arrive closer together than they were sent
        far = n.most_counts_per_s * (max(t_ps - n.position_ps, n.pc.period_ps) / 1e12) + 2.0
        # a word that is frozen or torn does not agree with what the box has added up beside it
        if abs(position - n.position) > far or (position - position_counted(payload)) & ((1 << COUNTED_BITS) - 1):
            n.implausible += 1
            n.doubts += 1
            n.position_sequence = sequence
            if n.doubts > MOST_DOUBTS:
                pc_hold(n, t_ps, POSITION_IMPLAUSIBLE)
            return
    n.doubts = 0
    n.has_position = 1
    n.position_ps = t_ps
    n.position_sequence = sequence
    n.position = position
    n.valid = valid
    if valid == 1 and n.homing == 1 and position == n.pc.home_count:
        n.home_seen = 1


@helper
def pc_receive(n: Record, t_ps: int, identifier: int, payload: int) -> None:
    """Take a frame from the bus."""
    kind = identifier & ~AXIS_BITS
    if identifier == HOLD:
        if is_sealed(identifier, payload):
            pc_hold(n, t_ps, ANOTHER_PC)  # only a PC says hold, and this one does not hear itself
        else:
            n.wrong_checksum += 1
        return
    if identifier & AXIS_BITS != n.axis or kind not in (STATUS, CORRECTIONS, POSITION, PROBE, REQUEST):
        return
    if not is_sealed(identifier, payload):
        n.wrong_checksum += 1
    elif kind == STATUS:
        take_status(n, t_ps, payload)
    elif kind == CORRECTIONS:
        take_corrections(n, t_ps, payload)
    elif kind == POSITION:
        take_position(n, t_ps, payload)
    elif kind == REQUEST:
        pc_hold(n, t_ps, ANOTHER_PC)
    elif session_of(payload) == n.session and follows(n, n.has_probe, n.probe_sequence, payload):
        n.has_probe = 1
        n.probe_sequence = sequence_of(payload)
        n.trips = probe_trips(payload)
        n.trip_position = position_of(payload)


@step
def reason_in_status(n: Record) -> int:
    """Return why the box's status makes the PC hold, if it does."""
    state = n.box_flags & 7
    if state == NOT_HOMED:
        return BOX_RESTARTED
    if state == FATAL:
        code = n.code
        if code == I_STILL_DONT_BELIEVE_YOU:
            return BOX_STILL_DOUBTS
        if code == LINK_LOST:
            return BOX_LOST_LINK
        if code == BOX_AXIS_TAKEN:
            return AXIS_TAKEN
        if code == IMPLAUSIBLE:
            return BOX_IMPLAUSIBLE
        if code == BOX_ENCODER_FAULT:
            return ENCODER_FAULT
        return BOX_HELD
    if state != RUNNING or n.code not in (
        OK,
        STATUS_PROBING,
        STATUS_DISABLED,
        I_DONT_BELIEVE_YOU,
        I_STILL_DONT_BELIEVE_YOU,
        REFUSED_TOO_FAST,
    ):
        return STATUS_WRONG
    if n.code == STATUS_DISABLED and (n.pc.sent != 0 or n.completed != 0 or n.accepted != 0):
        return CORRECTIONS_DISABLED
    return NONE


@helper
def check_before_turn(n: Record, t_ps: int) -> None:
    """Hold the machine where the PC's own clock, the box's silence or its status ask for it."""
    p = n.pc
    since_ps = t_ps - n.turn_ps
    if p.state == ACTIVE:
        if since_ps < 0 or since_ps > n.watch_ps:
            pc_hold(n, t_ps, CLOCK_JUMP)  # also where this program stood still for so long
        oldest_ps = min(min(n.status_ps, n.corrections_ps), n.position_ps)
        if t_ps - oldest_ps > n.watch_ps:
            pc_hold(n, t_ps, BOX_SILENT)
        # a bus that delays everything alike breaks neither order nor watch
        behind_ps = ((n.sequence - n.judged) & 0xFF) * p.period_ps
        if behind_ps > n.watch_ps + 2 * p.period_ps:
            pc_hold(n, t_ps, ANSWER_LATE)
        reason = reason_in_status(n)
        if reason != NONE:
            pc_hold(n, t_ps, reason)
        if n.patience_ps > 0 and n.open_ps != NEVER and t_ps - n.open_ps > n.patience_ps and p.probing == 0:
            pc_hold(n, t_ps, NOT_COMPLETED)
        position_mm = p.home_mm + n.position * p.count_mm
        if not n.low_mm <= position_mm <= n.high_mm:
            pc_hold(n, t_ps, PREDICTOR_OUT_OF_RANGE)
    elif p.state == WAITING and t_ps - n.status_ps > n.watch_ps:
        n.has_status = 0  # what was heard long ago is no box any more
    n.turn_ps = t_ps


@step
def say_request(n: Record, total: int, flags: int) -> None:
    """Send a request."""
    n.sequence = (n.sequence + 1) & 0xFF
    put(n.out, REQUEST + n.axis, pack_request(n.axis, n.sequence, total, flags, n.requester, n.session))


@helper
def turn_waiting(n: Record, t_ps: int) -> None:
    """Go through the start-up procedure: reset if the operator says so, home, and wait for the home position.

    A box that runs but was not sent home by this PC hears nothing: it corrects by totals that nobody knows any more,
    and its watch is to stop it.
    """
    state = n.box_flags & 7
    if state == FATAL and n.reset_meant == 1:
        n.homing = 0
        say_request(n, 0, RESET)
    elif state == NOT_HOMED:
        if n.homing == 0:
            n.home_seen = 0
        n.homing = 1
        n.reset_meant = 0
        say_request(n, 0, GO_HOME)
    elif state != RUNNING or n.homing == 1:
        say_request(n, 0, 0)


@helper
def pc_prepare(n: Record, t_ps: int) -> bool:
    """Begin the turn due at ``t_ps``; return whether a prediction is wanted for ``pc.position`` and ``pc.direction``.

    Where none is, the turn is over.
    """
    p = n.pc
    check_before_turn(n, t_ps)
    if p.state == HOLDING:
        pc_look(p, t_ps, True)
        n.hold_sequence += 1
        put(n.out, HOLD, pack_hold(n.hold_sequence, n.reason, n.axis))
        say_request(n, p.sent, 0)
        return False
    incomplete = n.has_corrections == 0 or n.has_position == 0
    if n.has_status == 0 or (incomplete and n.box_flags & 7 != NOT_HOMED):
        pc_look(p, t_ps, True)
        if n.has_status == 1:
            turn_waiting(n, t_ps)
        return False
    counts = n.completed != 0 or n.accepted != 0  # home zeroes the totals, so these are not of this start
    if p.state == WAITING and (n.homing == 0 or n.box_flags & 7 != RUNNING or n.valid == 0 or counts):
        pc_look(p, t_ps, True)
        turn_waiting(n, t_ps)
        return False
    if p.state == WAITING and n.home_seen == 1:
        p.state = ACTIVE  # the axis may have moved on since
        p.extreme = n.position
        p.sent = n.accepted
    if n.code == I_STILL_DONT_BELIEVE_YOU:
        pc_hold(n, t_ps, BOX_STILL_DOUBTS)  # although it says that it runs
        pc_look(p, t_ps, True)
        say_request(n, p.sent, 0)
        return False
    code = n.code if n.code != REFUSED_TOO_FAST else OK  # what is late is not doubted
    post(n.up, t_ps, n.position, n.completed, n.accepted, code)
    if n.valid == 0:
        pc_look(p, t_ps, True)
        say_request(n, p.sent, 0)
        return False
    # where the box is not at home it hears nothing: the home position was missed, and its watch is to stop it
    return bool(pc_read(p, n.up, t_ps))


@helper
def pc_finish(n: Record, t_ps: int, deviation_mm: float) -> None:
    """End the turn: turn the predicted deviation into the next request."""
    p = n.pc
    # a deviation that is no number is beyond every limit
    if not (abs(deviation_mm) <= n.limit_mm or (n.limit_mm == 0.0 and abs(deviation_mm) < BEYOND_EVERYTHING_MM)):
        pc_hold(n, t_ps, PREDICTOR_OUT_OF_RANGE if math.isnan(deviation_mm) else DEVIATION_LIMIT)
        say_request(n, p.sent, 0)
        return
    # what the request's word cannot say would be left out without a word
    if abs(deviation_mm) / p.step_mm > p.word_limit + 0.5 + p.margin_steps:
        pc_hold(n, t_ps, BEYOND_WORD)
        say_request(n, p.sent, 0)
        return
    n.last_total = p.sent
    before = p.sent
    pc_request(p, n.down, t_ps, deviation_mm)
    deliver(n.down, t_ps)
    if p.sent != before:
        n.wanted_ps = t_ps
    say_request(n, p.sent, n.down.word1 | ENABLE)


@helper
def pc_believe(n: Record, t_ps: int, model: Any, place: int) -> None:
    """End the turn by what a model, at work at this ``place``, sees in what the sensors say.

    Until all the axes that it looks at have been home, nothing is asked for; after that a sensor that is lost holds
    the machine, as does whatever the model was not made for.
    """
    p = n.pc
    sense(p, t_ps, n.position_ps, n.axis)
    wanted = model[2]
    for k in range(wanted.size):
        at = wanted[k]
        if n.believed == 0 and AXES <= at and at < AXES + MOST_AXES and math.isnan(p.sensors[at]):
            say_request(n, p.sent, 0)
            return
    n.believed = 1
    pc_finish(n, t_ps, believed_mm(model, p.sensors, place))


@kernel
def start(n: Record, t_ps: int, sequence: int) -> None:
    """Switch the PC on from outside."""
    pc_node_start(n, t_ps, sequence)


@kernel
def receive(n: Record, t_ps: int, identifier: int, payload: int) -> None:
    """Hand the PC a frame from outside."""
    pc_receive(n, t_ps, identifier, payload)


@kernel
def turn(n: Record, t_ps: int, model: Any) -> None:
    """Let the PC take the turn that is due, from outside; the model as `rtec.predictors.binding` makes it."""
    if pc_prepare(n, t_ps):
        pc_believe(n, t_ps, model, 0)


@kernel
def hold(n: Record, t_ps: int, reason: int) -> None:
    """Hold the machine from outside."""
    pc_hold(n, t_ps, reason)
