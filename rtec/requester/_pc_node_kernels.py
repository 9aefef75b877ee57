"""The PC's side of one axis as a node of the bus: its record, the frames that it takes, and its hold.

The box's frames are refused, and counted, where checksum or order are wrong; the latest good ones are the box's four
words for the PC's turns (``_pc_turn_kernels``). In HOLD, with a reason, it asks for nothing any more and says so on
the bus until somebody starts it again.
"""

from __future__ import annotations

import numpy as np

from rtec._jit import Record, helper, kernel
from rtec.link import _frame_kernels as frame
from rtec.link._crc_kernels import is_sealed
from rtec.link._frame_kernels import field
from rtec.link._kernels import MAILBOX, mailbox_reset
from rtec.link._outbox_kernels import IN_ORDER, OUTBOX, order_of
from rtec.requester import _pc_kernels as pc
from rtec.requester._pc_kernels import PC, pc_reset
from rtec.signal._kernels import NEVER
from rtec.units._time_kernels import PS_PER_S

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
SETUP_DIFFERS = 23
DRIVE_STOPPED = 24

MOST_DOUBTS = 2
"""Consecutive implausible positions that are tolerated: as many as the box tolerates totals outside the window."""

PC_NODE = np.dtype(
    [
        # parameters
        ("axis", np.int64),
        ("requester", np.int64),  # number of this PC, 0 to 7
        ("watchdog_ps", np.int64),  # longest silence of the box
        ("completion_timeout_ps", np.int64),  # longest time that an accepted total may stay unfinished (0: for ever)
        ("most_counts_per_s", np.float64),  # largest speed of the axis
        ("predicted", np.int64),  # 1: the model has been evaluated
        ("low_mm", np.float64),  # where the predictor knows the axis
        ("high_mm", np.float64),
        ("limit_mm", np.float64),  # largest deviation that is plausible (0: no limit)
        ("setup", np.int64),  # word of the setup that it expects of the box (0: any)
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
        ("box_setup", np.int64),  # word of the box's setup (0: none has been received)
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
        ("doubts", np.int64),  # consecutive implausible positions
        ("homing", np.int64),  # 1: this PC has sent the axis' box the home command, in this session
        ("home_seen", np.int64),  # 1: and the box has said the home position since
        ("turn_ps", np.int64),
        ("sequence", np.int64),
        ("expected_sequence", np.int64),
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
        ("implausible", np.int64),  # implausible positions
    ],
    align=True,
)


@kernel
def pc_hold(n: Record, t_ps: int, reason: int) -> None:
    """Hold the machine; the first reason is kept."""
    if n.pc.state != pc.HOLD:
        n.pc.state = pc.HOLD
        n.reason = reason
        n.held_ps = t_ps


@kernel
def pc_node_start(n: Record, t_ps: int, sequence: int) -> None:
    """Switch the PC on; nothing is received yet, and its frames are numbered from ``sequence`` on."""
    pc_reset(n.pc, t_ps)
    mailbox_reset(n.down)
    mailbox_reset(n.up)
    n.pc.valid_after_ps = 0  # a frame is whole or not there
    n.out.waiting = 0
    n.reset_meant = 0
    n.reason = NONE
    n.held_ps = NEVER
    n.box_setup = 0
    n.has_status = 0
    n.has_corrections = 0
    n.has_position = 0
    n.predicted = 0
    n.has_probe = 0
    n.valid = 0
    n.doubts = 0
    n.homing = 0
    n.home_seen = 0
    n.turn_ps = -NEVER
    n.sequence = sequence & 0xFF
    n.expected_sequence = 0
    n.hold_sequence = 0
    n.trips = 0
    n.open_ps = NEVER
    n.wanted_ps = NEVER
    n.last_total = 0


@helper
def follows(n: Record, has: int, last: int, payload: int) -> bool:
    """Return whether a frame follows the last one of its kind."""
    if has == 0 or n.pc.state == pc.WAITING:
        return True
    if order_of(last, field(payload, *frame.SEQUENCE)) == IN_ORDER:
        return True
    n.out_of_order += 1
    return False


@helper
def take_setup(n: Record, t_ps: int, payload: int) -> None:
    """Receive the box's setup; with another one than the PC expects, the same total would mean another correction."""
    n.box_setup = field(payload, *frame.SETUP_WORD)
    if n.setup != 0 and n.box_setup != n.setup:
        pc_hold(n, t_ps, SETUP_DIFFERS)


@helper
def take_status(n: Record, t_ps: int, payload: int) -> None:
    """Receive a status with a valid checksum."""
    session = field(payload, *frame.STATUS_SESSION)
    if n.has_status == 1 and session != n.session and n.pc.state == pc.ACTIVE:
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
    n.status_sequence = field(payload, *frame.SEQUENCE)
    n.code = field(payload, *frame.STATUS_CODE)
    n.box_flags = field(payload, *frame.STATUS_FLAGS)


@helper
def take_corrections(n: Record, t_ps: int, payload: int) -> None:
    """Receive totals with a valid checksum."""
    if n.has_status == 0 or field(payload, *frame.CORRECTIONS_SESSION) != n.session:
        if n.pc.state == pc.ACTIVE:
            pc_hold(n, t_ps, BOX_RESTARTED)
        return
    if not follows(n, n.has_corrections, n.corrections_sequence, payload):
        return
    n.has_corrections = 1
    n.corrections_ps = t_ps
    n.corrections_sequence = field(payload, *frame.SEQUENCE)
    n.completed = field(payload, *frame.CORRECTIONS_COMPLETED)
    n.accepted = field(payload, *frame.CORRECTIONS_ACCEPTED)
    n.judged = field(payload, *frame.CORRECTIONS_JUDGED)
    p = n.pc
    if p.state == pc.ACTIVE and n.accepted != p.sent and n.accepted != p.accepted and n.accepted != n.last_total:
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
    """Receive a position with a valid checksum, if it is plausible."""
    if not follows(n, n.has_position, n.position_sequence, payload):
        return
    sequence = field(payload, *frame.SEQUENCE)
    position = field(payload, *frame.POSITION_COUNTS)
    valid = field(payload, *frame.POSITION_VALID)
    if n.has_position == 1 and n.pc.state == pc.ACTIVE and valid == 1:
        # two frames may arrive closer together than they were sent
        far = n.most_counts_per_s * (max(t_ps - n.position_ps, n.pc.period_ps) / PS_PER_S) + 2.0
        # a frozen or torn word disagrees with the position that the box sums up in parallel
        apart = (position - field(payload, *frame.POSITION_COUNTED)) & ((1 << frame.POSITION_COUNTED[1]) - 1)
        if abs(position - n.position) > far or apart != 0:
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
def take_probe(n: Record, payload: int) -> None:
    """Take where the probe tripped."""
    if field(payload, *frame.PROBE_SESSION) == n.session and follows(n, n.has_probe, n.probe_sequence, payload):
        n.has_probe = 1
        n.probe_sequence = field(payload, *frame.SEQUENCE)
        n.trips = field(payload, *frame.PROBE_TRIPS)
        n.trip_position = field(payload, *frame.PROBE_COUNTS)


@helper
def take_hold(n: Record, t_ps: int, identifier: int, payload: int) -> None:
    """Take a hold: only a PC says it, and this one does not hear itself."""
    if is_sealed(identifier, payload):
        pc_hold(n, t_ps, ANOTHER_PC)
    else:
        n.wrong_checksum += 1


@kernel
def pc_receive(n: Record, t_ps: int, identifier: int, payload: int) -> None:
    """Take a frame from the bus."""
    kind = identifier & ~frame.AXIS_BITS
    if identifier == frame.HOLD:
        take_hold(n, t_ps, identifier, payload)
        return
    if identifier & frame.AXIS_BITS != n.axis or kind not in frame.KINDS_OF_AXIS:
        return
    if not is_sealed(identifier, payload):
        n.wrong_checksum += 1
    elif kind == frame.SETUP:
        take_setup(n, t_ps, payload)
    elif kind == frame.STATUS:
        take_status(n, t_ps, payload)
    elif kind == frame.CORRECTIONS:
        take_corrections(n, t_ps, payload)
    elif kind == frame.POSITION:
        take_position(n, t_ps, payload)
    elif kind in (frame.REQUEST, frame.EXPECTED):
        pc_hold(n, t_ps, ANOTHER_PC)
    else:
        take_probe(n, payload)
