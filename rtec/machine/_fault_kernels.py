"""Compiled faults of an axis and of the PC: what begins, what ends, and how often it has taken effect.

A change of the lines takes effect once they are read again (`inject_or_clear`, `rtec.machine._line_kernels`).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper
from rtec.injector._kernels import injector_hang, injector_latch
from rtec.injector._state_kernels import HUNG as STANDS_STILL
from rtec.link._bus_kernels import (
    CABLE_AFFECTED,
    EDGES_KEPT,
    GLITCHES_MADE,
    LAST_OF_BUS,
    NO_FAULT,
    WORD_AFFECTED,
    fire,
)
from rtec.machine._box_kernels import box_power, box_probe, box_switch
from rtec.requester._box_node_kernels import WORD_RIGHT, WORD_STALE, WORD_TORN, box_start
from rtec.signal._kernels import NEVER

PC_PLACE = 0
"""Node of the PC; the box of axis n is node n."""

# at an axis
BOX_RESTART, POWER_OFF, CABLE, GLITCHES, SWITCH_THROWN, PROBE_TRIP, STALE_WORD, TORN_WORD = (
    20, 21, 22, 23, 24, 25, 26, 27,
)  # fmt: skip
# in the open path (`rtec.machine.open_fault_kinds`); what hangs and sticks in a cell, too
PULSES, MISSED, SHIFTED, HUNG, CLOCK, LATCH, REQUEST = 30, 31, 32, 33, 34, 35, 36
FIRST_OPEN, LAST_OPEN = PULSES, REQUEST
# at the PC
PC_KILLED, CLOCK_JUMP_FORWARD, CLOCK_JUMP_BACK = 40, 41, 42
PC_PROBING = 43
"""Not a fault but an order: the PC enters the probing mode, and leaves it."""


@helper
def behind_cable(st: Record, level: int) -> int:
    """Return the levels that the box gets: the encoder's, changed where the record of the cable says so.

    Two bits for each of the levels now, eight for each of those that the box got before the fault.
    """
    return level ^ (st.cable >> (8 * st.cable_level + 2 * level)) & 3


@helper
def begin_at_axis(st: Record, box: Any, t_ps: int, f: Record) -> None:
    """Let a fault of an axis begin at its ``box`` (`rtec.machine._box_kernels`)."""
    n = st.node
    kind = f.kind
    if not finds_box(st, kind):
        return
    if kind == HUNG or kind == LATCH:
        begin_inside(st, t_ps, kind)
    elif kind == BOX_RESTART:
        switch_power(st, box, t_ps, 0)
        switch_power(st, box, t_ps, 1)
    elif kind == POWER_OFF:
        switch_power(st, box, t_ps, 0)
    elif kind == SWITCH_THROWN:
        box_switch(st, box, t_ps, 0)
    elif kind == PROBE_TRIP:
        box_probe(st, box, t_ps)
    elif kind == STALE_WORD or kind == TORN_WORD:
        n.word_kept = st.box_count - n.box.zero
        n.word_fault = WORD_STALE if kind == STALE_WORD else WORD_TORN
    elif kind == CABLE:
        st.cable_level = st.lines
        st.cable = f.cable
    elif kind == GLITCHES:
        st.encoder.glitch_level = f.glitch_level
        st.encoder.glitch_ps = f.glitch_ps


@helper
def begin_inside(st: Record, t_ps: int, kind: int) -> None:
    """Let the program of a modelled box stand still, or its hold latch stick closed."""
    if kind == LATCH:
        injector_latch(st.injector, t_ps, st.lines, 1, 1)
    else:
        injector_hang(st.injector)
        st.powered = STANDS_STILL


@helper
def finds_box(st: Record, kind: int) -> bool:
    """Return whether the box is in a state to which a fault of this kind can happen.

    Without power it has no state to lose; while its program stands still it latches nothing, and cannot hang.
    """
    if kind == BOX_RESTART or kind == POWER_OFF:
        return bool(st.powered != 0)
    return bool(st.powered == 1 or (kind != PROBE_TRIP and kind != HUNG))


@helper
def end_at_axis(st: Record, box: Any, t_ps: int, f: Record) -> None:
    """Let a fault of an axis end."""
    kind = f.kind
    if kind == POWER_OFF:
        if st.powered == 0:
            switch_power(st, box, t_ps, 1)
    elif kind == HUNG:
        if st.powered == STANDS_STILL:
            switch_power(st, box, t_ps, 0)
            switch_power(st, box, t_ps, 1)
    elif kind == LATCH:
        injector_latch(st.injector, t_ps, st.lines, 0, 0)
    elif kind == SWITCH_THROWN:
        box_switch(st, box, t_ps, 1)
    elif kind == STALE_WORD or kind == TORN_WORD:
        st.node.word_fault = WORD_RIGHT
    elif kind == CABLE:
        st.cable = 0
    elif kind == GLITCHES:
        st.encoder.glitch_level = 0


@helper
def switch_power(st: Record, box: Any, t_ps: int, on: int) -> None:
    """Take the power of the box and of its node away, or give it back."""
    box_power(st, box, t_ps, on)
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


@helper
def trigger_pending(st: Record, box: Any, t_ps: int) -> None:
    """Begin the pending fault, now that an insertion is under way."""
    st.triggered_ps = t_ps
    begin_at_axis(st, box, t_ps, st.pending)
    st.pending.kind = NO_FAULT


@helper
def effects_at(st: Record, f: Record) -> int:
    """Return how often faults of this kind have taken effect at an axis."""
    if f.activation == CABLE_AFFECTED:
        return int(st.cable_effects)
    if f.activation == GLITCHES_MADE:
        return int(st.encoder.glitches)
    if f.activation == WORD_AFFECTED:
        return int(st.node.word_effects)
    if f.activation == EDGES_KEPT:
        return int(st.encoder.serial)
    return 1 if f.while_inserting == 1 and st.triggered_ps > 0 else 0


@helper
def note_effects(st: Record, f: Record, t_ps: int) -> None:
    """Note how often a fault at an axis has taken effect since it began."""
    effects = effects_at(st, f) - f.effects_before
    if effects > f.fired:
        fire(f, st.triggered_ps if f.while_inserting == 1 and st.triggered_ps > 0 else t_ps)
        f.fired = effects


@helper
def await_insertion(st: Record, f: Record) -> None:
    """Make a fault pending until an insertion is under way."""
    pending = st.pending
    pending.kind = f.kind
    pending.cable = f.cable
    pending.glitch_level = f.glitch_level
    pending.glitch_ps = f.glitch_ps
    st.triggered_ps = 0


@helper
def comes_due(f: Record, t_ps: int, begins: bool) -> bool:
    """Return whether a fault begins, or ends, at ``t_ps``, and note that it does."""
    if begins and f.kept == 0 and f.from_ps == t_ps:
        f.kept = 1
        return True
    if not begins and f.kept == 1 and f.ended == 0 and f.until_ps == t_ps:
        f.ended = 1
        return True
    return False


@helper
def next_of_faults(faults: NDArray[np.void]) -> int:
    """Return when a fault beyond the bus next begins or ends."""
    t_ps = NEVER
    for i in range(faults.size):
        f = faults[i]
        if f.kind > LAST_OF_BUS:
            if f.kept == 0:
                t_ps = min(t_ps, f.from_ps)
            elif f.ended == 0:
                t_ps = min(t_ps, f.until_ps)
    return t_ps
