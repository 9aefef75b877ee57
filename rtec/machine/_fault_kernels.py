"""Compiled faults of an axis and of the PC: what begins, what ends, and how often it has taken effect.

What changes the lines is seen on them once they are taken anew (`strike`, `rtec.machine._line_kernels`).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper, step
from rtec.injector._kernels import injector_enable, injector_power
from rtec.link._bus_kernels import CABLE_STRUCK, GLITCHES_MADE, LAST_OF_BUS, NO_FAULT, WORD_STRUCK, fire
from rtec.machine._firmware_kernels import power_firmware, set_inputs
from rtec.requester._box_node_kernels import WORD_RIGHT, WORD_STALE, WORD_TORN, box_start, node_trip
from rtec.signal._kernels import NEVER

PC_PLACE = 0
"""Node of the PC; the box of axis n is node n."""

# at an axis
BOX_RESTART, POWER_OFF, CABLE_OPEN, LINES_SWAPPED, LINE_BROKEN, GLITCHES, SWITCH_THROWN, PROBE_TRIP = (
    20, 21, 22, 23, 24, 25, 26, 27,
)  # fmt: skip
STALE_WORD, TORN_WORD = 28, 29
# at the PC
PC_KILLED, CLOCK_JUMP_FORWARD, CLOCK_JUMP_BACK = 40, 41, 42
PC_PROBING = 43
"""An order and no fault: the PC enters the probing mode, and leaves it."""

WHOLE, OPEN, SWAPPED, BROKEN = 0, 1, 2, 3
"""States of the cable between encoder and box."""

GLITCH_LEVEL = 1 << 13
"""Of 2^16: one edge in eight is followed by a glitch."""
GLITCH_PS = 300_000
"""Width of such a glitch: wide enough for the controller's filter to see."""


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
def begin_at_axis(st: Record, box: Any, t_ps: int, kind: int) -> None:
    """Let a fault of an axis begin; ``box`` is None, or that of `rtec.machine._firmware_kernels`."""
    n = st.node
    if kind == BOX_RESTART or kind == POWER_OFF or kind == PROBE_TRIP:
        if st.powered == 0:
            return  # a dead box has nothing to lose, and latches nothing
    if kind == BOX_RESTART:
        switch_power(st, box, t_ps, 0)
        switch_power(st, box, t_ps, 1)
    elif kind == POWER_OFF:
        switch_power(st, box, t_ps, 0)
    elif kind == SWITCH_THROWN:
        n.box.switch_on = 0
        if box is None:
            injector_enable(st.injector, t_ps, 0)
        else:
            set_inputs(st, box[0], t_ps)
    elif kind == PROBE_TRIP:
        if box is None:
            node_trip(n, st.box_count)
        else:
            st.trip_ps = t_ps
            set_inputs(st, box[0], t_ps)
    elif kind == STALE_WORD or kind == TORN_WORD:
        n.word_kept = st.box_count - n.box.zero
        n.word_fault = WORD_STALE if kind == STALE_WORD else WORD_TORN
    elif kind == CABLE_OPEN or kind == LINES_SWAPPED or kind == LINE_BROKEN:
        st.cable_level = st.lines
        st.cable = OPEN if kind == CABLE_OPEN else SWAPPED if kind == LINES_SWAPPED else BROKEN
    elif kind == GLITCHES:
        st.encoder.glitch_level = GLITCH_LEVEL
        st.encoder.glitch_ps = GLITCH_PS


@helper
def end_at_axis(st: Record, box: Any, t_ps: int, kind: int) -> None:
    """Let a fault of an axis end."""
    if kind == POWER_OFF:
        if st.powered == 0:
            switch_power(st, box, t_ps, 1)
    elif kind == SWITCH_THROWN:
        st.node.box.switch_on = 1
        if box is not None:
            set_inputs(st, box[0], t_ps)
    elif kind == STALE_WORD or kind == TORN_WORD:
        st.node.word_fault = WORD_RIGHT
    elif kind == CABLE_OPEN or kind == LINES_SWAPPED or kind == LINE_BROKEN:
        st.cable = WHOLE
    elif kind == GLITCHES:
        st.encoder.glitch_level = 0


@helper
def switch_power(st: Record, box: Any, t_ps: int, on: int) -> None:
    """Take the power of the box away or give it back; the gates are powered by the controller."""
    if box is None:
        injector_power(st.injector, t_ps, on)
    else:
        power_firmware(st, box[0], t_ps, on)
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
def surprise(st: Record, box: Any, t_ps: int) -> None:
    """Let the fault begin that waited for an insertion to be under way."""
    kind = st.lurking
    st.lurking = NO_FAULT
    st.struck_ps = t_ps
    begin_at_axis(st, box, t_ps, kind)


@helper
def effects_at(st: Record, f: Record) -> int:
    """Return how often faults of this kind have taken effect at an axis."""
    if f.proof == CABLE_STRUCK:
        return int(st.cable_struck)
    if f.proof == GLITCHES_MADE:
        return int(st.encoder.glitches)
    if f.proof == WORD_STRUCK:
        return int(st.node.word_struck)
    return 1 if f.while_inserting == 1 and st.struck_ps > 0 else 0


@helper
def note_effects(st: Record, f: Record, t_ps: int) -> None:
    """Note how often a fault at an axis has taken effect since it began."""
    struck = effects_at(st, f) - f.struck_before
    if struck > f.fired:
        fire(f, st.struck_ps if f.while_inserting == 1 and st.struck_ps > 0 else t_ps)
        f.fired = struck


@helper
def await_insertion(st: Record, kind: int) -> None:
    """Let a fault wait for an insertion to be under way."""
    st.lurking = kind
    st.struck_ps = 0


@step
def comes_due(f: Record, t_ps: int, begins: bool) -> bool:
    """Return whether a fault begins, or ends, at ``t_ps``, and note that it does."""
    if begins and f.kept == 0 and f.from_ps == t_ps:
        f.kept = 1
        return True
    if not begins and f.kept == 1 and f.ended == 0 and f.until_ps == t_ps:
        f.ended = 1
        return True
    return False


@step
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
