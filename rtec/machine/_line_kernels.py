"""Compiled lines of an axis: encoder, cable, box and controller, and what a fault does to each of them.

::

    encoder -> cable -> box (injector or board, node) -> controller

``box`` is None where the injector models the box, else that of `rtec.machine._firmware_kernels`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rtec._jit import Record, helper, step
from rtec.axis._kernels import (
    ENCODER,
    PIECE,
    encoder_level,
)
from rtec.controller._kernels import RECEIVER, receiver_edge
from rtec.injector._design_kernels import B
from rtec.injector._kernels import (
    injector_edge,
    injector_enable,
    injector_fire,
    injector_power,
)
from rtec.injector._monitor_kernels import observe
from rtec.injector._state_kernels import ARMED, INJECTOR, INSERTING
from rtec.machine._firmware_kernels import deliver_board, firmware_edge
from rtec.machine._servo_kernels import SERVO
from rtec.requester._box_node_kernels import (
    BOX_NODE,
    WORD_RIGHT,
    WORD_STALE,
    WORD_TORN,
    box_start,
    node_trip,
)
from rtec.signal._kernels import ILLEGAL, count_delta

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

AXIS: list[tuple[object, ...]] = [
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
    ("turn_s", np.float64),
    ("part_end_s", np.float64),
    ("crossing_ps", np.int64),  # when the axis crosses the next line; NEVER: none in this part of the tick
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
]
"""Fields of one axis with its box; a machine that adds parts of its own has them first."""

STATION = np.dtype(AXIS, align=True)


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


@step
def deliver_lines(st: Record, box: Any, t_ps: int) -> None:
    """Let the controller see what the box drives, once all events of this instant are carried out."""
    if box is not None:
        deliver_board(st, box, t_ps)
    elif observe(st.injector):
        receiver_edge(st.receiver, t_ps, st.injector.ab_out)


@step
def take_lines(st: Record, box: Any, t_ps: int) -> None:
    """Send what the cable says at ``t_ps`` through the box to the controller."""
    if box is None:
        while st.injector.next_ps <= t_ps:
            fire_box(st)
    right = encoder_level(st.encoder)
    level = behind_cable(st, right)
    if level != right:
        st.cable_struck += 1
    if level != st.lines:
        delta = count_delta(st.lines, level)
        if delta == ILLEGAL:
            st.illegal_in += 1
        else:
            st.box_count += delta
        st.lines = level
        if box is None:
            injector_edge(st.injector, t_ps, level)
        else:
            firmware_edge(box, t_ps, level)
    deliver_lines(st, box, t_ps)
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
    """Carry out what the box does next; the lines change at once where a fault of the cable strikes with it."""
    t_ps = st.injector.next_ps
    before = st.lurking
    while st.injector.next_ps <= t_ps:
        fire_box(st)
    if st.lurking != before:
        take_lines(st, None, t_ps)
    else:
        deliver_lines(st, None, t_ps)
        if st.keeps == 1:
            keep(st, t_ps)


@helper
def strike(st: Record, t_ps: int, kind: int) -> None:
    """Let a fault begin at the station, which has been run up to ``t_ps``."""
    begin_fault(st, t_ps, kind)
    if kind in (CABLE_OPEN, LINES_SWAPPED, LINE_BROKEN):
        take_lines(st, None, t_ps)


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
        take_lines(st, None, t_ps)
    elif kind == GLITCHES:
        st.encoder.glitch_level = 0


@helper
def switch_power(st: Record, t_ps: int, on: int) -> None:
    """Take the power of the box away or give it back; the gates are powered by the controller."""
    s = st.injector
    injector_power(s, t_ps, on)
    deliver_lines(st, None, t_ps)
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
