"""The box's turn on the bus: it checks its watchdogs, takes its reading, and sends what is due.

The box's words go out as frames, every ``cycle_ps``, and at once when a correction is completed or the status
changes.
"""

from __future__ import annotations

from rtec._jit import Record, helper
from rtec.link import _frame_kernels as frame
from rtec.link._frame_kernels import pack_corrections, pack_position, pack_probe, pack_setup, pack_status
from rtec.link._kernels import mailbox_reset
from rtec.link._outbox_kernels import put
from rtec.requester import _box_kernels as box
from rtec.requester._box_kernels import box_tick
from rtec.requester._box_node_kernels import WORD_STALE, WORD_TORN, box_fail, frames_refused, setup_differs


@helper
def say_setup(n: Record) -> None:
    """Send the setup."""
    n.sequence_setup += 1
    put(n.out, frame.SETUP + n.axis, pack_setup(frame.SETUP + n.axis, n.sequence_setup, n.setup))


@helper
def say_status(n: Record, moments: int) -> None:
    """Send the status."""
    b = n.box
    flags = b.state
    flags |= frame.SWITCH_ON if b.switch_on == 1 else 0
    flags |= frame.IS_PROBING if b.probing == 1 else 0
    flags |= frame.HOLD_WANTED if b.state == box.FATAL else 0
    flags |= frame.AT_HOME if n.at_home == 1 else 0
    n.sequence_status += 1
    frames = frames_refused(n)
    payload = pack_status(n.axis, n.sequence_status, n.code, flags, n.session, frames, b.refused, moments)
    put(n.out, frame.STATUS + n.axis, payload)
    n.said_code = n.code


@helper
def say_corrections(n: Record, completed: int) -> None:
    """Send the totals completed and accepted."""
    n.sequence_corrections += 1
    payload = pack_corrections(n.axis, n.sequence_corrections, completed, n.box.accepted, n.session, n.judged)
    put(n.out, frame.CORRECTIONS + n.axis, payload)
    n.said_completed = completed


@helper
def word_of(n: Record, right: int) -> int:
    """Return the position word where ``right`` is its true value, with the injected faults."""
    word = right
    if n.word_fault == WORD_STALE:
        word = n.word_kept
    elif n.word_fault == WORD_TORN:
        word = (n.word_kept & ~0xFF) | (right & 0xFF)  # the upper bytes are those of an earlier reading
    if word != right:
        n.word_effects += 1
    return int(word)


@helper
def say_position(n: Record, count: int) -> None:
    """Send the position word."""
    right = count - n.box.zero
    word = word_of(n, right)
    n.position = word
    valid = 1 if n.box.state != box.NOT_HOMED else 0
    n.sequence_position += 1
    put(n.out, frame.POSITION + n.axis, pack_position(n.axis, n.sequence_position, word, valid, right))


@helper
def say_trip(n: Record) -> None:
    """Send the probe latch."""
    n.sequence_probe += 1
    payload = pack_probe(n.axis, n.sequence_probe, n.box.trip_position, n.box.trips, n.session)
    put(n.out, frame.PROBE + n.axis, payload)
    n.said_trips = n.box.trips


@helper
def box_check_watchdog(n: Record, t_ps: int, illegal: int, stopped: bool) -> None:
    """Stop for good where the PC is silent, the encoder's lines are not those of an encoder, or the drive is stopped.

    ``illegal`` counts the changes of both lines at once that the box's own decoder saw; ``stopped`` is the contact by
    which the controller says that it has stopped the drive.
    """
    if n.box.state == box.RUNNING:
        if t_ps - n.heard_ps > n.watchdog_ps:
            box_fail(n, box.LINK_LOST)
        elif illegal > 0:
            box_fail(n, box.ENCODER_FAULT)
        elif stopped:
            box_fail(n, box.DRIVE_STOPPED)


@helper
def box_sample(n: Record, t_ps: int, count: int, completed: int) -> None:
    """Let the box take its reading and check the request."""
    if n.box.state == box.NOT_HOMED and n.at_home == 0:
        mailbox_reset(n.down)  # the axis has left home since it was told to take it
    box_tick(n.box, n.down, n.up, t_ps, count, completed)


@helper
def judge_status(n: Record, t_ps: int, completed: int, moments: int) -> None:
    """See which status code the box is in, as far as the bus is concerned."""
    b = n.box
    n.code = b.status
    if b.status == box.OK and b.state == box.RUNNING and completed != b.accepted and moments != n.said_moments:
        n.code = box.REFUSED_TOO_FAST
    kept_back = completed != b.accepted or n.down.word0 != b.accepted
    if b.state == box.RUNNING and b.switch_on == 0 and b.probing == 0 and kept_back:
        n.code = box.STATUS_DISABLED  # also where a total of zero is what the switch keeps it from
    elif b.state == box.NOT_HOMED and setup_differs(n, t_ps):
        n.code = box.SETUP_DIFFERS


@helper
def cycle_is_due(n: Record, t_ps: int) -> bool:
    """Return whether the time of the next cycle has come, and set the time of the one after."""
    if t_ps < n.cycle_next_ps:
        return False
    n.cycle_next_ps += n.cycle_ps
    if n.cycle_next_ps <= t_ps:
        n.cycle_next_ps = t_ps + n.cycle_ps
    return True


@helper
def box_say(n: Record, t_ps: int, count: int, completed: int, moments: int) -> None:
    """Want to send what is due; ``moments`` counts those at which the speed gate refused to insert."""
    b = n.box
    homed = b.homed == 1
    b.homed = 0
    if homed:
        completed = 0  # home zeroes every counter, also that of the injector
        b.accepted = 0
        n.said_completed = 0
        n.large_spent = 0
    elif abs(b.accepted - n.said_accepted) > b.window:
        n.large_spent = 1
    n.said_accepted = b.accepted
    judge_status(n, t_ps, completed, moments)
    due = cycle_is_due(n, t_ps)
    if due:
        n.said_moments = moments
    due = due or homed  # the PC waits for the home position, and the axis may move on any time
    if due or (n.code != n.said_code and box.REFUSED_TOO_FAST not in (n.code, n.said_code)):
        say_status(n, moments)
    if due or (completed == b.accepted and completed != n.said_completed):
        say_corrections(n, completed)
    if b.trips != n.said_trips or (due and b.probing == 1):
        say_trip(n)
    if due:
        say_position(n, count)
        if n.setup != 0 and (homed or b.state == box.NOT_HOMED):
            say_setup(n)
