"""Compiled parts of the axis: edges of an encoder solved for from the motion, the servo's tick, the mechanical play.

Positions are in counts from home, float64; count k covers the positions from line k to line k + 1. Line k lies
nominally at k - 1/2, so that the axis at position k counts stands in the middle of count k. Crossing line k upwards
is the transition into count k; its kind (k + home) & 3 says which signal changes: 1 A rises, 2 B rises, 3 A falls,
0 B falls.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper, kernel, step
from rtec.signal._kernels import NEVER, level_of_state
from rtec.units._time_kernels import PS_PER_S

GLITCH_SEED = 0x5DEECE66D
"""Makes the draws of glitches independent of those of jitter."""

ENCODER = np.dtype(
    [
        # parameters
        ("home", np.int64),  # angle state at count 0
        ("shift", np.float64, (4,)),  # displacement of the lines of each kind, counts
        ("counts_per_rev", np.int64),  # 0: a linear scale
        ("eccentric_counts", np.float64),  # amplitude of the once-per-revolution error of the lines
        ("eccentric_rad", np.float64),
        ("index_every", np.int64),  # counts between index pulses (0: none)
        ("jitter_ps", np.int64),  # bound of the triangular jitter of each edge
        ("glitch_level", np.int64),  # a glitch follows an edge if its 16-bit draw is below this (0: never)
        ("glitch_ps", np.int64),  # width of a glitch
        ("seed", np.int64),
        # state
        ("count", np.int64),
        ("serial", np.int64),  # edges made so far
        ("last_ps", np.int64),
        ("glitch_next_ps", np.int64),  # next toggle of a glitch
        ("glitch_mask", np.int64),  # line that it toggles
        ("glitch_on", np.int64),
        # steady motion: time of the nominal crossing, kept as a ratio so that nothing drifts
        ("steady_ps", np.int64),
        ("steady_rest", np.int64),
        ("quarter_ps", np.float64),
        ("quarter_den", np.int64),
        ("quarter_whole_ps", np.int64),
        ("quarter_left", np.int64),
        ("shift_ps", np.int64, (4,)),
        ("step_sign", np.int64),
        # observations
        ("glitches", np.int64),
    ],
    align=True,
)

PIECE = np.dtype(
    [
        ("start_ps", np.int64),
        ("x0", np.float64),  # counts, counts/s, counts/s^2, counts/s^3 at the start
        ("v0", np.float64),
        ("a0", np.float64),
        ("j0", np.float64),
        ("from_s", np.float64),  # within the piece the motion never turns
        ("to_s", np.float64),
        ("sign", np.int64),
    ],
    align=True,
)


@step
def draw(seed: int, serial: int) -> int:
    """Return 63 random bits for the edge number ``serial``: a counter hashed by two multiplications."""
    z = np.uint64(serial) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(seed)
    z = (z ^ (z >> np.uint64(32))) * np.uint64(0xD6E8FEB86659FD93)
    return int((z ^ (z >> np.uint64(32))) >> np.uint64(1))


@step
def jitter(seed: int, serial: int, bound_ps: int) -> int:
    """Return the jitter of edge number ``serial``: the difference of two uniform draws, triangular in its bound."""
    bits = draw(seed, serial)
    return (((bits & 0x7FFFFFFF) - (bits >> 32)) * bound_ps) >> 31


@step
def encoder_level(e: Record) -> int:
    """Return the levels at the encoder's output."""
    level = level_of_state((e.count + e.home) & 3)
    return level ^ e.glitch_mask if e.glitch_on == 1 else level


@step
def line_position(e: Record, k: int) -> float:
    """Return the position of line ``k`` in counts."""
    position = k - 0.5 + e.shift[(k + e.home) & 3]
    if e.eccentric_counts != 0.0:
        angle = 2.0 * math.pi * ((k % e.counts_per_rev) / e.counts_per_rev) + e.eccentric_rad
        position += e.eccentric_counts * math.sin(angle)
    return position


@step
def emit(e: Record, crossing_ps: int, sign: int) -> int:
    """Cross one line at ``crossing_ps`` in the direction ``sign``; return the time of the edge, jitter included.

    Edges keep their order: an encoder's disc carries both tracks, and a line cannot overtake the one before it.
    """
    e.serial += 1
    e.count += sign
    t_ps = crossing_ps
    t_ps += jitter(e.seed, e.serial, e.jitter_ps)
    if e.glitch_level > 0 and e.glitch_next_ps == NEVER and e.last_ps > -NEVER:
        bits = draw(e.seed ^ GLITCH_SEED, e.serial)
        if (bits & 0xFFFF) < e.glitch_level:
            e.glitch_mask = 1 + ((bits >> 60) & 1)
            # somewhere in the next interval, if that is about as long as the last one
            e.glitch_next_ps = t_ps + 1 + (((t_ps - e.last_ps) >> 4) * ((bits >> 56) & 15))
    t_ps = max(t_ps, e.last_ps + 1)
    e.last_ps = t_ps
    return t_ps


@helper
def glitch_toggle(e: Record) -> int:
    """Begin or end the glitch that is due; return its time."""
    t_ps = e.glitch_next_ps
    e.glitch_on = 1 - e.glitch_on
    if e.glitch_on == 1:
        e.glitch_next_ps = t_ps + e.glitch_ps
        e.glitches += 1
    else:
        e.glitch_next_ps = NEVER
    return t_ps


@step
def steady_crossing(e: Record) -> int:
    """Return the time of the next line at constant speed, and step on to the one after it."""
    e.steady_ps += e.quarter_whole_ps
    e.steady_rest += e.quarter_left
    if e.steady_rest >= e.quarter_den:
        e.steady_rest -= e.quarter_den
        e.steady_ps += 1
    k = e.count + 1 if e.step_sign > 0 else e.count
    t_ps = e.steady_ps + e.shift_ps[(k + e.home) & 3]
    if e.eccentric_counts != 0.0:
        angle = 2.0 * math.pi * ((k % e.counts_per_rev) / e.counts_per_rev) + e.eccentric_rad
        shift = e.eccentric_counts * math.sin(angle) * e.step_sign
        t_ps += int(math.floor(shift * e.quarter_ps + 0.5))
    return t_ps


@step
def place(p: Record, s: float) -> float:
    """Return the position ``s`` seconds after the start of the piece."""
    return p.x0 + s * (p.v0 + s * (p.a0 / 2.0 + s * p.j0 / 6.0))


@step
def speed(p: Record, s: float) -> float:
    """Return the velocity ``s`` seconds after the start of the piece."""
    return p.v0 + s * (p.a0 + s * p.j0 / 2.0)


@step
def solve_crossing(p: Record, goal: float) -> float:
    """Return when the motion of the piece passes ``goal``, which lies between its ends.

    Closed form for constant acceleration; with jerk, Newton's method kept inside a shrinking bracket.
    """
    low, high = p.from_s, p.to_s
    if p.j0 == 0.0:
        rise = goal - p.x0
        root = math.sqrt(max(p.v0 * p.v0 + 2.0 * p.a0 * rise, 0.0))
        # the root at which the velocity has the sign of the piece, in the form that loses no digits
        if p.v0 * p.sign > 0.0:
            s = 2.0 * rise / (p.v0 + p.sign * root)
        elif p.a0 != 0.0:
            s = (p.sign * root - p.v0) / p.a0
        else:
            s = low
        return min(max(s, low), high)
    s = 0.5 * (low + high)
    for _ in range(80):
        off = (place(p, s) - goal) * p.sign
        if off > 0.0:
            high = s
        else:
            low = s
        slope = speed(p, s) * p.sign
        trial = s - off / slope if slope > 0.0 else low
        if not low < trial < high:
            trial = 0.5 * (low + high)
        if abs(trial - s) <= 1e-14:
            return trial
        s = trial
    return s


@step
def next_crossing(e: Record, p: Record) -> int:
    """Return when the piece crosses its next line, or NEVER."""
    if p.sign == 0:
        return NEVER
    goal = line_position(e, e.count + 1 if p.sign > 0 else e.count)
    if (goal - place(p, p.to_s)) * p.sign > 0.0:
        return NEVER
    return p.start_ps + int(math.floor(solve_crossing(p, goal) * PS_PER_S + 0.5))


@step
def set_piece(p: Record, from_s: float, to_s: float) -> None:
    """Limit the piece to ``from_s``..``to_s``, between which the motion does not turn."""
    p.from_s = from_s
    p.to_s = to_s
    way = place(p, to_s) - place(p, from_s)
    p.sign = 1 if way > 0.0 else -1 if way < 0.0 else 0


@step
def turning_points(v0: float, a0: float, j0: float, end_s: float) -> tuple[float, float]:
    """Return the times in 0..end_s at which the velocity changes sign, ascending; ``end_s`` stands for none."""
    first, second = end_s, end_s
    if j0 == 0.0:
        if v0 * a0 < 0.0:
            first = min(-v0 / a0, end_s)
        return first, second
    inside = a0 * a0 - 2.0 * j0 * v0
    if inside <= 0.0:
        return first, second
    # the form of the quadratic's roots that loses no digits
    q = -0.5 * (a0 + math.copysign(math.sqrt(inside), a0)) * 2.0
    root_1 = q / j0
    root_2 = 2.0 * v0 / q if q != 0.0 else end_s
    low, high = min(root_1, root_2), max(root_1, root_2)
    if 0.0 < low < end_s:
        first = low
        if high < end_s:
            second = high
    elif 0.0 < high < end_s:
        first = high
    return first, second


@helper
def encoder_reset(e: Record, count: int) -> None:
    """Stand still at ``count`` at time 0."""
    e.count = count
    e.serial = 0
    e.last_ps = -NEVER
    e.glitch_next_ps = NEVER
    e.glitch_on = 0


@kernel
def trace_edges(
    e: Record,
    p: Record,
    start_ps: NDArray[np.int64],
    duration_ps: NDArray[np.int64],
    x0: NDArray[np.float64],
    v0: NDArray[np.float64],
    a0: NDArray[np.float64],
    j0: NDArray[np.float64],
    first: int,
    edges_a_count: float,
    out_ps: NDArray[np.int64],
    out_levels: NDArray[np.uint8],
) -> tuple[int, int]:
    """Write the edges of the motion segments from number ``first`` on; return (edges written, next segment).

    Stops before a segment that might not fit into the arrays: with room for ``edges_a_count``, those of glitches
    included, for each count of travel and eight counts more, every segment fits.
    """
    n = 0
    for i in range(first, start_ps.size):
        end_s = duration_ps[i] / PS_PER_S
        travel = abs(v0[i]) * end_s + abs(a0[i]) * end_s**2 / 2 + abs(j0[i]) * end_s**3 / 6
        if n + edges_a_count * (travel + 8) > out_ps.size:
            return n, i
        p.start_ps = start_ps[i]
        p.x0 = x0[i]
        p.v0 = v0[i]
        p.a0 = a0[i]
        p.j0 = j0[i]
        turn_1, turn_2 = turning_points(v0[i], a0[i], j0[i], end_s)
        for part in range(3):
            from_s = 0.0 if part == 0 else turn_1 if part == 1 else turn_2
            to_s = turn_1 if part == 0 else turn_2 if part == 1 else end_s
            if to_s <= from_s:
                continue
            set_piece(p, from_s, to_s)
            while True:
                crossing_ps = next_crossing(e, p)
                if e.glitch_next_ps <= crossing_ps and e.glitch_next_ps < p.start_ps + int(to_s * PS_PER_S):
                    out_ps[n] = max(glitch_toggle(e), e.last_ps + 1)
                    e.last_ps = out_ps[n]
                elif crossing_ps < NEVER:
                    out_ps[n] = emit(e, crossing_ps, p.sign)
                else:
                    break
                out_levels[n] = encoder_level(e)
                n += 1
    while e.glitch_next_ps < NEVER:  # after the motion
        out_ps[n] = max(glitch_toggle(e), e.last_ps + 1)
        e.last_ps = out_ps[n]
        out_levels[n] = encoder_level(e)
        n += 1
    return n, start_ps.size


@kernel
def trace_steady(
    e: Record,
    edges: int,
    rest_ps: int,
    out_ps: NDArray[np.int64],
    out_levels: NDArray[np.uint8],
    out_real: NDArray[np.uint8],
) -> int:
    """Write the next ``edges`` edges at constant speed and the toggles of glitches between them; return their number.

    After the last of all edges ``rest_ps`` is for how long glitches still come, else 0. ``out_real`` is 1 for an edge
    and 0 for a toggle. An edge has at most two toggles.
    """
    n = 0
    for i in range(edges + 1):
        crossing_ps = steady_crossing(e) if i < edges else e.last_ps + rest_ps
        while e.glitch_next_ps < crossing_ps:
            out_ps[n] = max(glitch_toggle(e), e.last_ps + 1)
            e.last_ps = out_ps[n]
            out_levels[n] = encoder_level(e)
            out_real[n] = 0
            n += 1
            if i == edges:
                crossing_ps = e.last_ps + rest_ps
        if i < edges:
            out_ps[n] = emit(e, crossing_ps, e.step_sign)
            out_levels[n] = encoder_level(e)
            out_real[n] = 1
            n += 1
    return n


@kernel
def level_now(e: Record) -> int:
    """Return the levels at the encoder's output."""
    return encoder_level(e)


@kernel
def reset_at(e: Record, x: float) -> None:
    """Stand still at position ``x``, in counts, between the two lines around it."""
    count = int(math.floor(x + 0.5))
    while line_position(e, count) > x:
        count -= 1
    while line_position(e, count + 1) <= x:
        count += 1
    encoder_reset(e, count)
