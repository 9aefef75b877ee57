"""Compiled lines of an axis: encoder, cable, box and controller, and what a fault does to each of them.

::

    encoder -> cable -> box (injector or board, node) -> controller

``box`` is as of `rtec.machine._box_kernels`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rtec._jit import Record, helper, step, written_out
from rtec.axis._kernels import ENCODER, PIECE, encoder_level
from rtec.controller._kernels import RECEIVER
from rtec.injector._state_kernels import INJECTOR
from rtec.link._bus_kernels import BEGUN, FAULT, NO_FAULT, fire
from rtec.machine._box_kernels import box_advance, box_edge, box_finish, box_keep, box_output, stand_still
from rtec.machine._fault_kernels import (
    CABLE,
    await_insertion,
    begin_at_axis,
    behind_cable,
    effects_at,
    end_at_axis,
    finds_box,
    note_effects,
    trigger_pending,
)
from rtec.machine._recorder_kernels import KEPT
from rtec.machine._servo_kernels import SERVO
from rtec.requester._box_node_kernels import BOX_NODE
from rtec.signal._kernels import ILLEGAL, NEVER, count_delta

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
    ("line_acceleration", np.float64),  # mm/s^2 along lines that all axes follow together; 0: moves of its own
    # motion
    ("event_ps", np.int64),
    ("tick_open", np.int64),
    ("turn_s", np.float64),
    ("part_end_s", np.float64),
    ("crossing_ps", np.int64),  # when the axis crosses the next line; NEVER: none in this part of the tick
    ("moving_to", np.int64),  # move of the program
    ("arrived_ps", np.int64),  # at its end; NEVER: still under way
    ("command_speed", np.float64),
    ("lines_run", np.int64),  # 1: all axes are ready to follow lines
    ("line_from", np.float64),  # command at the begin of the line
    ("line_mm", np.float64),  # way along it
    ("line_speed", np.float64),  # mm/s along it
    ("lag", np.float64),  # counts of lag that the recent feed explains
    ("override", np.float64),
    ("going_home", np.int64),  # 1: back to the encoder's home, whatever the controller counts
    # cable between encoder and box
    ("cable", np.int64),  # where its levels differ from the encoder's; 0: nowhere
    ("cable_level", np.int64),  # levels when its fault began
    ("lines", np.int64),  # levels behind the cable
    ("box_count", np.int64),  # by the box's decoder
    ("illegal_in", np.int64),
    ("cable_effects", np.int64),  # moments at which a broken cable said something else than the encoder
    # what stops it
    ("powered", np.int64),
    ("trip_ps", np.int64),  # when the probe's line fell last, for a running firmware
    ("resets", np.int64),  # of the node, that a running firmware has made
    ("pc_holds", np.int64),
    ("alarm", np.int64),
    ("alarm_ps", np.int64),
    ("held_ps", np.int64),  # since when it is held; NEVER: it is not
    # a fault that waits for an insertion to be under way
    ("pending", FAULT),
    ("triggered_ps", np.int64),
    # the last changes of the lines, for pictures of an insertion
    ("keeps", np.int64),  # 1: they are kept
    ("kept", np.int64),  # changes so far
    ("kept_rows", np.int64, (KEPT, 3)),  # time, levels at the encoder's side, levels at the controller
    ("seen_inserted", np.int64),
    ("still_to_keep", np.int64),  # changes after an insertion until it is put aside
    ("aside", np.int64),  # changes put aside
    ("aside_rows", np.int64, (KEPT, 3)),
    # observations
    ("starts", np.int64),
    ("moves", np.int64),
    ("travel_mm", np.float64),
]
"""Fields of one axis with its box; a machine that adds parts of its own has them first."""

STATION = np.dtype(AXIS, align=True)


@helper
def stand_at_home(st: Record) -> None:
    """Let an axis stand at home, its box powered."""
    st.lines = stand_still(st)
    st.powered = 1
    st.trip_ps = -NEVER
    st.servo.program = 1


@step
def take_lines(st: Record, box: Any, t_ps: int) -> None:
    """Send what the cable says at ``t_ps`` through the box to the controller."""
    right = encoder_level(st.encoder)
    level = behind_cable(st, right)
    if level != right:
        st.cable_effects += 1
    if level != st.lines:
        delta = count_delta(st.lines, level)
        if delta == ILLEGAL:
            st.illegal_in += 1
        else:
            st.box_count += delta
        st.lines = level
        box_edge(st, box, t_ps, level)
    box_output(st, box, t_ps)
    box_keep(st, box, t_ps)


@step
def run_box(st: Record, box: Any, t_ps: int) -> bool:
    """Let the box go on to ``t_ps``; a fault that waits for an insertion begins with it.

    Returns whether one has begun at ``t_ps`` itself: then the lines are to be taken there.
    """
    begun = False
    while box_advance(st, box, t_ps):
        trigger_pending(st, box, st.event_ps)
        begun = st.event_ps == t_ps
        if not begun:
            retake_lines(st, box, st.event_ps)
    return begun


@helper
def retake_lines(st: Record, box: Any, t_ps: int) -> None:
    """Send what the cable says after a fault has begun or ended through the box to the controller."""
    box_finish(st, box, t_ps)
    take_lines(st, box, t_ps)


@helper
def inject_or_clear(st: Record, box: Any, t_ps: int, f: Record, begins: bool) -> None:
    """Let a fault begin or end at an axis, which has been run up to ``t_ps``."""
    if begins:
        begin_at_axis(st, box, t_ps, f)
    else:
        end_at_axis(st, box, t_ps, f)
    if f.kind == CABLE:
        retake_lines(st, box, t_ps)
    else:
        box_output(st, box, t_ps)


@written_out
def fault_at_axis(st: Record, box: Any, f: Record, t_ps: int, begins: bool) -> None:
    """Begin the fault ``f`` of an axis, or make it pending until an insertion; or end it.

    At its end it is noted how often it has taken effect.
    """
    if not begins:
        note_effects(st, f, t_ps)
        if st.pending.kind == f.kind:
            st.pending.kind = NO_FAULT  # no insertion came by
        else:
            inject_or_clear(st, box, t_ps, f, False)
    elif f.while_inserting == 1:
        await_insertion(st, f)
        f.effects_before = effects_at(st, f)
    else:
        f.effects_before = effects_at(st, f)
        if f.activation == BEGUN and finds_box(st, f.kind):
            fire(f, t_ps)
        inject_or_clear(st, box, t_ps, f, True)
