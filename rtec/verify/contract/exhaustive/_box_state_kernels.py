"""Compiled state of encoder and box at a point of a grid of time, as two words.

The box is the record that every bench drives, always at the time ``NOW_PS``. Times are kept relative to now, and
clamped where all that is longer is the same; what the box will not look at again is left out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper, kernel
from rtec.injector._insertion_kernels import UNTIMED_PS
from rtec.injector._state_kernels import ARMED, INSERTING, SAMPLING, WRITING
from rtec.signal._kernels import NEVER

NOW_PS = 1_000_000_000_000_000
"""Time of an unpacked state: a whole number of seconds, and of all periods of looks that divide one."""

MODEL = np.dtype(
    [
        # parameters; times are points of the grid
        ("grid_ps", np.int64),
        ("window", np.int64),  # steps that can be owed, either way
        ("step_counts", np.int64),
        ("classes", np.int64),  # of motion, see `rtec.verify.contract.exhaustive.encoder`
        ("begins", np.int64, (8,)),  # interval from which on an edge is of a class
        ("least_same", np.int64, (8,)),  # from an edge of a class to one in its direction
        ("least_turn", np.int64, (8,)),  # and to one that takes it back
        ("longest", np.int64),  # up to here the time since the last edge is kept
        ("separation", np.int64),
        ("delay", np.int64),
        ("looks", np.int64),  # places of an instant between two looks of the processor; 1 where it looks always
        # state beside the box
        ("direction", np.int64),  # of the last edge; 0: none yet
        ("motion", np.int64),  # its class
        ("since", np.int64),  # the last edge, or power-up
        ("off", np.int64),  # controller less encoder less completed steps
        ("off_for", np.int64),
        ("out_line", np.int64),  # that changed last at the controller, 1 or 2; 0: none, or long ago
        ("out_since", np.int64),
        # of the last instant
        ("booked", np.int64),  # steps completed
        ("wide", np.int64),  # 1: a value does not fit its bits
    ],
    align=True,
)


@helper
def points_after(t_ps: int, now_ps: int, grid_ps: int) -> int:
    """Return the points of the grid from now to a time, which may lie a picosecond beside one."""
    return (t_ps - now_ps + grid_ps // 2) // grid_ps


@helper
def put(word: int, width: int, value: int, m: Record) -> int:
    """Return a word with one more value of so many bits."""
    if value < 0 or value >> width != 0:
        m.wide = 1
    return (word << width) | value


@helper
def pack(s: Record, m: Record, now_ps: int, words: NDArray[np.int64]) -> None:
    """Write the state at ``now_ps`` into two words."""
    grid_ps = m.grid_ps
    inserting = s.phase == INSERTING
    after = 0 if s.next_ps >= NEVER else points_after(s.next_ps, now_ps, grid_ps)
    if after <= 0 and s.next_ps < NEVER:
        m.wide = 1  # the instant is not over
    w = put(0, 3, s.phase, m)
    w = put(w, 15, after, m)
    w = put(w, 12, points_after(max(s.ready_ps, now_ps), now_ps, grid_ps), m)
    w = put(w, 2, s.ab_in, m)
    w = put(w, 3, 4 + s.held if s.holding == 1 else 0, m)
    w = put(w, 2, s.ab_out, m)
    w = put(w, 2, s.pulse_high, m)
    w = put(w, 2, s.pulse_low, m)
    w = put(w, 2, s.inverted, m)
    w = put(w, 2, s.sampled if s.in_path == 1 else 0, m)
    w = put(w, 2, s.offset, m)
    w = put(w, 2, s.origin if inserting or s.phase == ARMED else 0, m)
    w = put(w, 1, 1 if inserting and s.sign > 0 else 0, m)
    words[0] = put(w, 4, s.done if inserting else 0, m)
    before, timed = 0, 0
    if s.gate_ps > 0:
        gate = s.gate_ps // grid_ps
        before = min(gate, -points_after(s.edge_before_ps, now_ps, grid_ps))
        if now_ps - s.edge_before_ps > UNTIMED_PS:
            before = gate + 1
        copies = s.phase == SAMPLING or s.phase == WRITING or s.ab_in != s.sampled
        if s.in_path == 1 and copies:  # else the interval is looked at only behind the edge that ends it
            timed = 2 if s.interval_ps >= UNTIMED_PS else 1 if s.interval_ps >= s.gate_ps else 0
    w = put(0, 12, m.since, m)
    w = put(w, 12, before, m)
    w = put(w, 2, timed, m)
    w = put(w, 4, s.requested - s.completed + m.window + 1, m)
    w = put(w, 2, m.direction + 1, m)
    w = put(w, 3, m.motion, m)
    w = put(w, 5, m.off + 16, m)
    w = put(w, 2, m.out_line, m)
    w = put(w, 6, m.out_since, m)
    words[1] = put(w, 14, m.off_for, m)


@helper
def unpack(words: NDArray[np.int64], s: Record, m: Record) -> int:
    """Set both records to a state; return its time."""
    grid_ps = m.grid_ps
    w = words[0]
    now_ps = NOW_PS
    s.done = w & 15
    s.sign = 1 if (w >> 4) & 1 else -1
    s.origin = (w >> 5) & 3
    s.offset = (w >> 7) & 3
    s.sampled = (w >> 9) & 3
    s.inverted = (w >> 11) & 3
    s.pulse_low = (w >> 13) & 3
    s.pulse_high = (w >> 15) & 3
    s.ab_out = (w >> 17) & 3
    s.held = (w >> 19) & 3
    s.holding = (w >> 21) & 1
    s.ab_in = (w >> 22) & 3
    s.ready_ps = now_ps + ((w >> 24) & 4095) * grid_ps
    after = (w >> 36) & 32767
    s.next_ps = NEVER if after == 0 else now_ps + after * grid_ps
    s.phase = w >> 51
    s.recognised_ps = s.next_ps - s.decide_ps
    s.trigger_ps = now_ps
    w = words[1]
    m.off_for = w & 16383
    m.out_since = (w >> 14) & 63
    m.out_line = (w >> 20) & 3
    m.off = ((w >> 22) & 31) - 16
    m.motion = (w >> 27) & 7
    m.direction = ((w >> 30) & 3) - 1
    s.completed = 0
    s.requested = ((w >> 32) & 15) - m.window - 1
    timed = (w >> 36) & 3
    s.interval_ps = NEVER if timed == 2 else s.gate_ps if timed == 1 else 0
    before = (w >> 38) & 4095
    s.edge_before_ps = -NEVER if before * grid_ps > s.gate_ps else now_ps - before * grid_ps
    m.since = w >> 50
    s.last_edge_ps = now_ps - m.since * grid_ps
    m.booked = 0
    return now_ps


@kernel
def pack_state(s: Record, m: Record, now_ps: int, words: NDArray[np.int64]) -> None:
    """Write a state down for Python."""
    pack(s, m, now_ps, words)


def unpack_state(states: NDArray[np.int64]) -> dict[str, NDArray[np.int64]]:
    """Return what a check of whole sets of states looks at, one value for each of them."""
    first, second = states[:, 0], states[:, 1]
    return {
        "phase": first >> 51,
        "after": (first >> 36) & 32767,
        "ready": (first >> 24) & 4095,
        "before": (second >> 38) & 4095,
        "off": ((second >> 22) & 31) - 16,
        "out_line": (second >> 20) & 3,
    }
