"""The box's side of the handshake: one state machine, sampled every millisecond.

It reads the PC's "Correction Requested" and "Status" words, checks them against its window, and answers with its
position, the total it has accepted, the corrections completed and a status (Yee 1992, General Considerations).

::

    NOT_HOMED --home command at home--> RUNNING --third reading outside the window in a row--> FATAL
"""

from __future__ import annotations

import numpy as np

from rtec._jit import Record, helper, step
from rtec.link._kernels import deliver, post

NOT_HOMED, RUNNING, FATAL = 0, 1, 2

# what the status word says; the most serious first where several apply
OK = 0
STATUS_NOT_HOMED = 1
STATUS_PROBING = 2
STATUS_DISABLED = 3  # a nonzero request while the switch forbids corrections
I_DONT_BELIEVE_YOU = 4
I_STILL_DONT_BELIEVE_YOU = 5
# used by a box on a bus only (`_box_node_kernels`)
REFUSED_TOO_FAST = 6  # the speed gate refused, and something is still to be inserted
LINK_LOST = 7
HELD = 8
AXIS_TAKEN = 9
IMPLAUSIBLE = 10
ENCODER_FAULT = 11
SETUP_DIFFERS = 12
DRIVE_STOPPED = 13

# flags of the PC's status word
LARGE_CORRECTION = 1
PROBING = 2
GO_HOME = 4

BOX = np.dtype(
    [
        # parameters
        ("period_ps", np.int64),
        ("update_ps", np.int64),  # time for which Data Valid is low while the words change
        ("window", np.int64),
        ("grace", np.int64),  # readings outside the window after the first that are still forgiven
        ("switch_on", np.int64),  # hardware switch: 0 forbids corrections
        (
            "framed",
            np.int64,
        ),  # 1: requests come in frames, each judged once; 0: parallel words, judged at each reading
        # state
        ("next_ps", np.int64),
        ("state", np.int64),
        ("status", np.int64),
        ("zero", np.int64),  # count of the box's decoder at home
        ("accepted", np.int64),
        ("doubts", np.int64),  # readings outside the window in a row
        ("probing", np.int64),
        ("trip_position", np.int64),
        ("trips", np.int64),
        ("judged", np.int64),  # messages of the PC judged so far
        ("homed", np.int64),  # 1: home was taken, and the counters of the lines are not zeroed yet
        # observations
        ("readings", np.int64),
        ("refused", np.int64),
    ],
    align=True,
)


@step
def check_window(b: Record, total: int, flags: int) -> None:
    """Check a requested total against the window: accept it, reject it, or stop for good."""
    change = total - b.accepted
    if change == 0:
        b.doubts = 0
        b.status = OK
    elif -b.window <= change <= b.window or flags & LARGE_CORRECTION:
        b.accepted = total
        b.doubts = 0
        b.status = OK
    else:
        b.refused += 1
        b.doubts += 1
        b.status = I_DONT_BELIEVE_YOU
        if b.doubts > b.grace:
            b.state = FATAL
            b.status = I_STILL_DONT_BELIEVE_YOU


@step
def box_tick(b: Record, down: Record, up: Record, t_ps: int, count: int, completed: int) -> int:
    """Read the PC's words, answer, and return the total that the injector is to reach.

    ``count`` is the box's own decoder on the encoder's side; ``completed`` the total inserted so far.
    """
    b.next_ps += b.period_ps
    b.readings += 1
    deliver(down, t_ps)
    if down.delivered > 0:
        total = down.word0
        flags = down.word1
        b.probing = 1 if flags & PROBING else 0
        if b.state == NOT_HOMED:
            b.status = STATUS_NOT_HOMED
            if flags & GO_HOME:
                b.zero = count
                b.accepted = completed
                b.state = RUNNING
                b.status = OK
                b.homed = 1
        elif b.state == RUNNING and not flags & GO_HOME:  # a command, with no total to believe
            if b.probing == 1:
                b.status = STATUS_PROBING
            elif b.switch_on == 0:
                b.status = STATUS_DISABLED if total != 0 else OK
            elif b.framed == 0 or down.delivered != b.judged:
                check_window(b, total, flags)
        b.judged = down.delivered
    post(up, t_ps, count - b.zero, completed, b.accepted, b.status)
    return b.accepted


@helper
def take_answer(b: Record, accepted: int, message: int, trip_position: int, trips: int) -> None:
    """Take over the state of a running firmware, which checks the requests itself; a fatal stop stays fatal."""
    b.readings += 1
    b.accepted = accepted
    b.trip_position = trip_position
    b.trips += (trips - b.trips) & 255
    if b.state == FATAL:
        return
    b.probing = 1 if message == STATUS_PROBING else 0
    b.status = message
    if message == STATUS_NOT_HOMED:
        b.state = NOT_HOMED
        return
    b.homed |= 1 if b.state == NOT_HOMED else 0
    b.state = RUNNING
    if message in (I_DONT_BELIEVE_YOU, I_STILL_DONT_BELIEVE_YOU):
        b.refused += 1
    if message == I_STILL_DONT_BELIEVE_YOU:
        b.state = FATAL


@helper
def box_trip(b: Record, count: int) -> None:
    """Latch the axis position at a probe trip."""
    b.trip_position = count - b.zero
    b.trips += 1


@helper
def box_reset(b: Record, first_ps: int) -> None:
    """Switch the box on, without a home; the counters of observations go on."""
    b.next_ps = first_ps
    b.state = NOT_HOMED
    b.status = STATUS_NOT_HOMED
    b.zero = 0
    b.accepted = 0
    b.doubts = 0
    b.probing = 0
    b.trips = 0
    b.judged = 0
    b.homed = 0
