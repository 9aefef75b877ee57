"""Compiled state of encoder and box at a point of a grid of time, as two words.

The box is the record that every bench drives, always at the time ``NOW_PS``. Times are kept relative to now, and
clamped where all that is longer is the same; what the box will not look at again is left out, and so is what is owed,
which the PC can change until the box looks at it. States that differ only in where the encoder's cycle begins, or in
which way is forward, are one state.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper
from rtec.injector._insertion_kernels import UNTIMED_PS
from rtec.injector._state_kernels import ARMED, INSERTING, SAMPLING, WRITING
from rtec.signal._kernels import NEVER, level_of_state, state_of_level

NOW_PS = 1_000_000_000_000_000
"""Time of an unpacked state: a whole number of seconds, and of all periods of looks that divide one."""

MODEL = np.dtype(
    [
        # parameters; times are points of the grid
        ("grid_ps", np.int64),
        ("gate", np.int64),  # from here on no time tells the speed gate anything
        ("step_counts", np.int64),
        ("classes", np.int64),  # of motion, see `rtec.verify.contract.exhaustive.encoder`
        ("begins", np.int64, (64,)),  # interval from which on an edge is of a class
        ("least_same", np.int64, (64,)),  # from an edge of a class to one in its direction
        ("least_turn", np.int64, (64,)),  # and to one that takes it back
        ("longest", np.int64),  # up to here the time since the last edge is kept
        ("separation", np.int64),
        ("delay", np.int64),
        ("looks", np.int64),  # of a polling processor: from one to the next; 1 where it looks always
        # state beside the box
        ("looked", np.int64),  # the last look of the processor
        ("direction", np.int64),  # of the last edge; 0: none yet
        ("motion", np.int64),  # its class
        ("fresh", np.int64),  # 1: it was the first one, and may be taken back at once
        ("since", np.int64),  # the last edge, or power-up
        ("off", np.int64),  # controller less encoder less completed steps
        ("off_for", np.int64),
        ("out_line", np.int64),  # that changed last at the controller, 1 or 2; 0: none, or long ago
        ("out_since", np.int64),
        # of the last event
        ("booked", np.int64),  # steps completed
        ("by", np.int64),  # states by which the cycle was turned back, and whether ahead became behind (-1)
        ("sense", np.int64),
        ("first", np.int64),  # the state behind it
        ("second", np.int64),
        ("wide", np.int64),  # 1: a value does not fit its bits
    ],
    align=True,
)


@helper
def points_after(t_ps: int, now_ps: int, grid_ps: int) -> int:
    """Return the points of the grid from now to a time, which may lie a picosecond beside one."""
    return (t_ps - now_ps + grid_ps // 2) // grid_ps


@helper
def turned(level: int, by: int, sense: int) -> int:
    """Return levels with the cycle turned back by some states, and seen in a mirror where ``sense`` is -1."""
    return level_of_state((sense * (state_of_level(level) - by)) & 3)


@helper
def turn_alike(s: Record, m: Record) -> None:
    """Turn a state so that the encoder is in state 0, unless the box tells states apart, and the axis moves up."""
    by = 0 if s.one_state == 1 else state_of_level(s.ab_in)
    sense = -1 if m.direction < 0 else 1
    m.by = by
    m.sense = sense
    s.ab_in = turned(s.ab_in, by, sense)
    s.ab_out = turned(s.ab_out, by, sense)
    s.held = turned(s.held, by, sense)
    s.sampled = turned(s.sampled, by, sense)
    s.origin = (sense * (s.origin - by)) & 3
    s.sign *= sense
    s.offset = (sense * s.offset) & 3
    m.off *= sense
    m.direction *= sense
    if (by & 1) ^ (sense < 0):  # A is now B
        s.inverted = (s.inverted & 1) << 1 | s.inverted >> 1
        m.out_line = (m.out_line & 1) << 1 | m.out_line >> 1


@helper
def put(word: int, width: int, value: int, m: Record) -> int:
    """Return a word with one more value of so many bits."""
    if value < 0 or value >> width != 0:
        m.wide = 1
    return (word << width) | value


@helper
def pack(s: Record, m: Record, now_ps: int) -> None:
    """Write the state at ``now_ps`` into two words."""
    grid_ps = m.grid_ps
    turn_alike(s, m)
    inserting = s.phase == INSERTING
    w = put(0, 3, s.phase, m)
    w = put(w, 7, m.looked, m)
    w = put(w, 15, 0 if s.next_ps >= NEVER else 1 + points_after(s.next_ps, now_ps, grid_ps), m)
    w = put(w, 12, max(1 + points_after(max(s.ready_ps, now_ps - grid_ps), now_ps, grid_ps), 0), m)
    w = put(w, 2, s.ab_in, m)
    w = put(w, 3, 4 + s.held if s.holding == 1 else 0, m)
    w = put(w, 2, s.ab_out, m)
    w = put(w, 2, s.inverted, m)
    w = put(w, 2, s.sampled if s.in_path == 1 else 0, m)
    w = put(w, 2, s.offset, m)
    w = put(w, 2, s.origin if s.in_path == 0 and (inserting or s.phase == ARMED) else 0, m)
    w = put(w, 1, 1 if inserting and s.sign > 0 else 0, m)
    m.first = put(w, 4, s.done if inserting else 0, m)
    before, timed = 0, 0
    if s.gate_ps > 0:
        before = min(m.gate, -points_after(max(s.edge_before_ps, now_ps - UNTIMED_PS), now_ps, grid_ps))
        if now_ps - s.edge_before_ps > UNTIMED_PS:
            before = m.gate + 1
        copies = s.phase == SAMPLING or s.phase == WRITING or s.ab_in != s.sampled
        if s.in_path == 1 and copies:  # else the interval is looked at only behind the edge that ends it
            timed = 2 if s.interval_ps >= UNTIMED_PS else 1 if s.interval_ps >= s.gate_ps else 0
    w = put(0, 1, m.fresh, m)
    w = put(w, 12, m.since, m)
    w = put(w, 12, before, m)
    w = put(w, 2, timed, m)
    w = put(w, 2, m.direction + 1, m)
    w = put(w, 6, m.motion, m)
    w = put(w, 5, m.off + 16, m)
    w = put(w, 2, m.out_line, m)
    w = put(w, 6, m.out_since, m)
    m.second = put(w, 14, m.off_for, m)


@helper
def unpack(first: int, second: int, s: Record, m: Record) -> None:
    """Set both records to a state."""
    grid_ps = m.grid_ps
    now_ps = NOW_PS
    w = first
    s.done = w & 15
    s.sign = 1 if (w >> 4) & 1 else -1
    s.origin = (w >> 5) & 3
    s.offset = (w >> 7) & 3
    s.sampled = (w >> 9) & 3
    s.inverted = (w >> 11) & 3
    s.ab_out = (w >> 13) & 3
    s.held = (w >> 15) & 3
    s.holding = (w >> 17) & 1
    s.ab_in = (w >> 18) & 3
    s.ready_ps = now_ps + (((w >> 20) & 4095) - 1) * grid_ps
    after = (w >> 32) & 32767
    s.next_ps = NEVER if after == 0 else now_ps + (after - 1) * grid_ps
    m.looked = (w >> 47) & 127
    s.phase = w >> 54
    s.recognised_ps = s.next_ps - s.decide_ps
    seen = s.sampled if s.in_path == 1 else level_of_state(s.origin)
    if s.holding == 1 or s.ab_in != seen:  # an edge came since: where it came now, it came after the look
        s.recognised_ps -= 1
    s.trigger_ps = now_ps
    s.pulse_high, s.pulse_low = 0, 0
    if s.phase == INSERTING and s.in_path == 0 and s.inverts == 0:
        start, goal = level_of_state(s.origin), level_of_state((s.origin + s.sign * s.done) & 3)
        s.pulse_high, s.pulse_low = goal & ~start, start & ~goal
    w = second
    m.off_for = w & 16383
    m.out_since = (w >> 14) & 63
    m.out_line = (w >> 20) & 3
    m.off = ((w >> 22) & 31) - 16
    m.motion = (w >> 27) & 63
    m.direction = ((w >> 33) & 3) - 1
    timed = (w >> 35) & 3
    s.interval_ps = NEVER if timed == 2 else s.gate_ps if timed == 1 else 0
    before = (w >> 37) & 4095
    s.edge_before_ps = -NEVER if before > m.gate else now_ps - before * grid_ps
    m.since = (w >> 49) & 4095
    m.fresh = w >> 61
    s.last_edge_ps = now_ps - m.since * grid_ps
    s.completed = 0


def fields_of(first: NDArray[np.int64], second: NDArray[np.int64]) -> dict[str, NDArray[np.int64]]:
    """Return what Python looks at in states, shape (n,), one value for each of them."""
    return {
        "phase": first >> 54,
        "after": ((first >> 32) & 32767) - 1,
        "ready": ((first >> 20) & 4095) - 1,
        "levels": (first >> 13) & 3,
        "before": (second >> 37) & 4095,
        "off": ((second >> 22) & 31) - 16,
        "off_for": second & 16383,
        "out_line": (second >> 20) & 3,
        "since": (second >> 49) & 4095,
        "sign": 2 * ((first >> 4) & 1) - 1,
    }
