"""The box as a node of the bus: frames around its state machine, and the supervision that frames make possible.

What comes in is refused, and counted, where its checksum, its order, its session or its contents are wrong; only what
is left reaches the state machine of ``_box_kernels``, each request once. What goes out is the box's four words as
frames, every ``cycle_ps`` and at once when the job is done or the code changes.

A box that is homed and hears no valid request for ``watchdog_ps`` stops for good and opens its hold
contact: without a PC the error of the axis is no longer known.
"""

from __future__ import annotations

import numpy as np

from rtec._jit import Record, helper
from rtec.link import _frame_kernels as frame
from rtec.link._crc_kernels import is_sealed
from rtec.link._frame_kernels import field, request_agrees
from rtec.link._kernels import MAILBOX, mailbox_reset, post
from rtec.link._outbox_kernels import DISORDERED, IN_ORDER, OUTBOX, REPEATED, order_of
from rtec.requester import _box_kernels as box
from rtec.requester._box_kernels import BOX, box_reset
from rtec.signal._kernels import NEVER

BOX_NODE = np.dtype(
    [
        # parameters
        ("axis", np.int64),
        ("cycle_ps", np.int64),  # between frames of one kind
        ("watchdog_ps", np.int64),  # longest silence of the PC
        ("gap_ps", np.int64),  # least time between two requests that are judged
        ("limit_steps", np.int64),  # totals beyond this are never accepted (0: no limit)
        ("setup", np.int64),  # word of its own setup (0: none is sent)
        # parts
        ("box", BOX),
        ("down", MAILBOX),
        ("up", MAILBOX),
        ("out", OUTBOX),
        # state
        ("session", np.int64),
        ("expected", np.int64),  # word of the setup that the PC expects (0: none has been received)
        ("expected_ps", np.int64),
        ("at_home", np.int64),  # the home switch
        ("requester", np.int64),  # the PC that took the axis home
        ("heard", np.int64),  # 1: a valid request has come since the start
        ("heard_ps", np.int64),
        ("heard_sequence", np.int64),
        ("judged", np.int64),
        ("judged_ps", np.int64),
        ("said_accepted", np.int64),  # total accepted at the last turn
        ("large_spent", np.int64),  # 1: Large Correction has let a change through, and is still set
        ("resets_requested", np.int64),
        ("cycle_next_ps", np.int64),
        ("sequence_setup", np.int64),
        ("sequence_status", np.int64),
        ("sequence_corrections", np.int64),
        ("sequence_position", np.int64),
        ("sequence_probe", np.int64),
        ("said_code", np.int64),
        ("said_completed", np.int64),
        ("said_trips", np.int64),
        ("said_moments", np.int64),
        ("code", np.int64),
        ("position", np.int64),  # the word of the last frame
        # faults of the position word: 0 none, 1 frozen, 2 its upper bytes are frozen
        ("word_fault", np.int64),
        ("word_kept", np.int64),
        ("word_effects", np.int64),  # frames whose word was wrong
        # observations
        ("requests", np.int64),  # valid and in order
        ("wrong_checksum", np.int64),
        ("repeated", np.int64),
        ("disordered", np.int64),
        ("jumped", np.int64),
        ("wrong_session", np.int64),
        ("wrong_requester", np.int64),
        ("contradictory", np.int64),  # total and inverted total
        ("hasty", np.int64),  # sooner after the last than `gap_ps`
        ("foreign", np.int64),  # frames of unknown senders
        ("resets", np.int64),
    ],
    align=True,
)

WORD_RIGHT, WORD_STALE, WORD_TORN = 0, 1, 2


@helper
def box_fail(n: Record, code: int) -> None:
    """Stop for good; the first reason is kept."""
    if n.box.state != box.FATAL:
        n.box.state = box.FATAL
        n.box.status = code


@helper
def box_start(n: Record, t_ps: int, session: int) -> None:
    """Switch the box's processor on, without a home and without a PC."""
    box_reset(n.box, t_ps)
    mailbox_reset(n.down)
    mailbox_reset(n.up)
    n.out.waiting = 0
    n.session = session & 0xFF
    n.expected = 0
    n.expected_ps = -NEVER
    n.heard = 0
    n.heard_ps = t_ps
    n.judged = 0
    n.judged_ps = -NEVER
    n.said_accepted = 0
    n.large_spent = 0
    n.resets_requested = 0
    n.cycle_next_ps = t_ps
    n.sequence_setup = 0
    n.sequence_status = 0
    n.sequence_corrections = 0
    n.sequence_position = 0
    n.sequence_probe = 0
    n.said_code = -1
    n.said_completed = 0
    n.said_trips = 0
    n.said_moments = 0
    n.code = n.box.status
    n.word_fault = WORD_RIGHT


@helper
def frames_refused(n: Record) -> int:
    """Return how many frames were refused as invalid, whatever they requested."""
    return int(
        n.wrong_checksum
        + n.repeated
        + n.disordered
        + n.jumped
        + n.wrong_session
        + n.wrong_requester
        + n.contradictory
        + n.hasty
    )


@helper
def setup_differs(n: Record, t_ps: int) -> bool:
    """Return whether the PC that was heard last expects another design, step or cycle than this box has."""
    known = n.setup != 0 and n.expected != 0 and t_ps - n.expected_ps <= n.watchdog_ps
    return bool(known and n.expected != n.setup)


@helper
def take_expected(n: Record, t_ps: int, payload: int) -> None:
    """Receive the setup that the PC expects; a box with another setup must not be homed by it."""
    n.expected = field(payload, *frame.SETUP_WORD)
    n.expected_ps = t_ps
    if setup_differs(n, t_ps):
        if n.box.state == box.NOT_HOMED:
            mailbox_reset(n.down)  # also where the home command has come first
        elif n.box.state == box.RUNNING:
            box_fail(n, box.SETUP_DIFFERS)


@helper
def is_due(n: Record, payload: int, order: int) -> bool:
    """Return whether a request comes in order, from the PC in charge, and does not contradict itself."""
    running = n.box.state == box.RUNNING
    if order != IN_ORDER and running:
        if order == REPEATED:
            n.repeated += 1
        elif order == DISORDERED:
            n.disordered += 1
        else:
            n.jumped += 1
        return False
    if running and field(payload, *frame.REQUEST_REQUESTER) != n.requester:
        n.wrong_requester += 1
        return False
    if not request_agrees(payload):
        n.contradictory += 1
        return False
    return True


@helper
def take_home(n: Record, t_ps: int, flags: int, payload: int) -> None:
    """Take home where the axis is there; the PC that asks is in charge from now on."""
    n.heard_ps = t_ps
    n.judged = n.heard_sequence
    if flags & box.GO_HOME and n.at_home == 1 and not setup_differs(n, t_ps):
        n.requester = field(payload, *frame.REQUEST_REQUESTER)
        post(n.down, t_ps, 0, box.GO_HOME, 0, 0)


@helper
def spent(n: Record, flags: int) -> int:
    """Return the flags without Large Correction where it has been used: it admits one change."""
    if not flags & box.LARGE_CORRECTION:
        n.large_spent = 0
    elif n.large_spent == 1:
        flags &= ~box.LARGE_CORRECTION  # the flag must be cleared before the next
    return flags


@helper
def take_request(n: Record, t_ps: int, payload: int) -> None:
    """Receive a request with a valid checksum."""
    b = n.box
    if field(payload, *frame.REQUEST_SESSION) != n.session:
        n.wrong_session += 1  # meant for the box before it started again
        return
    order = order_of(n.heard_sequence, field(payload, *frame.SEQUENCE)) if n.heard == 1 else IN_ORDER
    if not is_due(n, payload, order):
        return
    flags = field(payload, *frame.REQUEST_FLAGS)
    total = field(payload, *frame.REQUEST_TOTAL)
    n.heard = 1
    n.heard_sequence = field(payload, *frame.SEQUENCE)
    n.requests += 1
    if b.state == box.FATAL:
        take_reset(n, t_ps, flags, order)
        return
    if b.state == box.NOT_HOMED:
        take_home(n, t_ps, flags, payload)
        return
    if flags & box.GO_HOME or not flags & frame.ENABLE:
        return  # a request for nothing does not reset the watchdog: nobody knows the error of the axis then
    n.heard_ps = t_ps
    if t_ps - n.judged_ps < n.gap_ps:
        n.hasty += 1  # at most one window per gap; a total that follows too soon is not accepted unchecked
        return
    n.judged_ps = t_ps
    n.judged = n.heard_sequence
    flags = spent(n, flags)
    if n.limit_steps > 0 and abs(total) > n.limit_steps:
        b.refused += 1
        box_fail(n, box.IMPLAUSIBLE)
        return
    post(n.down, t_ps, total, flags & 3, 0, 0)


@helper
def take_reset(n: Record, t_ps: int, flags: int, order: int) -> None:
    """Restart at the second consecutive request with Reset: a single stray frame must not restart the box."""
    if not flags & frame.RESET:
        n.resets_requested = 0
    elif n.resets_requested == 1 and order == IN_ORDER:
        n.resets_requested = 0
        restart(n, t_ps)
    else:
        n.resets_requested = 1


@helper
def restart(n: Record, t_ps: int) -> None:
    """Wait for home again at the operator's order: totals and rejections are cleared, the session continues."""
    box_reset(n.box, n.box.next_ps)
    mailbox_reset(n.down)
    n.resets += 1
    n.heard_ps = t_ps


@helper
def box_receive(n: Record, t_ps: int, identifier: int, payload: int) -> None:
    """Take a frame from the bus."""
    kind = identifier & ~frame.AXIS_BITS
    if identifier == frame.HOLD:
        if not is_sealed(identifier, payload):
            n.wrong_checksum += 1
        elif n.box.state == box.RUNNING:
            box_fail(n, box.HELD)
        return
    if identifier & frame.AXIS_BITS != n.axis:
        return  # another axis
    if kind not in frame.KINDS_OF_AXIS:
        n.foreign += 1
    elif not is_sealed(identifier, payload):
        n.wrong_checksum += 1
    elif kind == frame.REQUEST:
        take_request(n, t_ps, payload)
    elif kind == frame.EXPECTED:
        take_expected(n, t_ps, payload)
    else:
        box_fail(n, box.AXIS_TAKEN)  # another node sends under this box's identifiers
