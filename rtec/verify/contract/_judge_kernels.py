"""Compiled judge: both sides of a box and its completed total, taken in the order of time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper, kernel
from rtec.signal._kernels import ILLEGAL, NEVER, count_delta, earlier

SEEN = np.dtype(
    [
        ("encoder_counts", np.int64),
        ("controller_counts", np.int64),
        ("illegal", np.int64),
        ("illegal_ps", np.int64),  # the first one
        ("separation_ps", np.int64),  # shortest time from a change of one line at the controller to one of the other
        ("separation_at_ps", np.int64),
        ("pulse_ps", np.int64),  # shortest time from a change of a line to its next one, the other line quiet
        ("off_counts", np.int64),  # controller less encoder less completed steps, at the end
        ("off_since_ps", np.int64),  # when it left zero for the last time
        ("delay_ps", np.int64),  # longest time that the controller's count was behind what is right
        ("delay_at_ps", np.int64),
        (
            "beyond_counts",
            np.int64,
        ),  # how far it went beyond all that was sent and asked for, at first
        ("beyond_ps", np.int64),
    ],
    align=True,
)


@helper
def beyond(
    inserted: int,
    low: int,
    high: int,
    in_ps: NDArray[np.int64],
    in_levels: NDArray[np.uint8],
    in_initial: int,
    seen: int,
    since_ps: int,
) -> int:
    """Return how far a count lies beyond ``low`` to ``high`` from any encoder count since a time; 0 inside."""
    nearest = min(inserted - low, 0) + max(inserted - high, 0)
    k = seen - 1
    while nearest != 0 and k >= 0 and in_ps[k] > since_ps:  # it may still show what came before this edge
        inserted += count_delta(int(in_levels[k - 1]) if k > 0 else in_initial, int(in_levels[k]))
        outside = min(inserted - low, 0) + max(inserted - high, 0)
        if abs(outside) < abs(nearest):
            nearest = outside
        k -= 1
    return nearest


@helper
def note_delay(s: Record, left_ps: NDArray[np.int64], t_ps: int) -> None:
    """Note for how long the controller's count has been behind at ``t_ps``, where it is."""
    if s.off_counts != 0:
        at = left_ps.size // 2 + s.controller_counts
        since_ps = s.off_since_ps
        if 0 <= at < left_ps.size and left_ps[at] > since_ps:
            since_ps = left_ps[at]
        if t_ps - since_ps > s.delay_ps:
            s.delay_ps = t_ps - since_ps
            s.delay_at_ps = since_ps


@helper
def count_out(s: Record, delta: int, t_ps: int) -> None:
    """Count a change of the lines at the controller."""
    if delta == ILLEGAL:
        s.illegal += 1
        if s.illegal_ps < 0:
            s.illegal_ps = t_ps
    else:
        s.controller_counts += delta


@helper
def note_spacing(s: Record, same_line: bool, since_ps: int, t_ps: int) -> None:
    """Note the time between two changes of one line, or of one and then the other."""
    if same_line:
        s.pulse_ps = min(s.pulse_ps, since_ps)
    elif since_ps < s.separation_ps:
        s.separation_ps = since_ps
        s.separation_at_ps = t_ps


@helper
def note_left(left_ps: NDArray[np.int64], right: int, t_ps: int) -> None:
    """Note that a count that was right has been left."""
    at = left_ps.size // 2 + right
    if 0 <= at < left_ps.size:
        left_ps[at] = t_ps


@helper
def note_beyond(
    s: Record,
    low: int,
    high: int,
    in_ps: NDArray[np.int64],
    in_levels: NDArray[np.uint8],
    in_initial: int,
    seen: int,
    since_ps: int,
    t_ps: int,
) -> None:
    """Note the first time at which the controller's count went beyond all that was sent and asked for."""
    if s.beyond_counts == 0:
        inserted = s.controller_counts - s.encoder_counts
        s.beyond_counts = beyond(inserted, low, high, in_ps, in_levels, in_initial, seen, since_ps)
        if s.beyond_counts != 0:
            s.beyond_ps = t_ps


@kernel
def look(
    s: Record,
    in_ps: NDArray[np.int64],
    in_levels: NDArray[np.uint8],
    in_initial: int,
    out_ps: NDArray[np.int64],
    out_levels: NDArray[np.uint8],
    out_initial: int,
    done_ps: NDArray[np.int64],
    done: NDArray[np.int64],
    asked_ps: NDArray[np.int64],
    asked: NDArray[np.int64],
    step_counts: int,
    delay_ps: int,
    until_ps: int,
    left_ps: NDArray[np.int64],
) -> None:
    """Decode both sides by ideal x4 decoders and compare their counts after each instant.

    ``left_ps`` has room for every count that is right at some time, 0 in its middle, and holds -1. A count of the
    controller is as late as the time since it was right last; one that was not right yet is as old as the difference.
    """
    right = 0
    i, j, k = 0, 0, 0
    before_in, before_out = in_initial, out_initial
    last_ps, last_changed = -NEVER, 0
    total = 0
    q, least_asked, most_asked = 0, 0, 0
    s.separation_ps = NEVER
    s.pulse_ps = NEVER
    s.illegal_ps = -1
    s.separation_at_ps = -1
    s.off_since_ps = -1
    s.delay_at_ps = -1
    s.beyond_ps = -1
    while True:
        t_ps = earlier(earlier(earlier(until_ps, in_ps, i), out_ps, j), done_ps, k)
        note_delay(s, left_ps, t_ps)
        if t_ps >= until_ps:
            break
        if i < in_ps.size and in_ps[i] == t_ps:
            s.encoder_counts += count_delta(before_in, int(in_levels[i]))
            before_in = int(in_levels[i])
            i += 1
        if j < out_ps.size and out_ps[j] == t_ps:
            count_out(s, count_delta(before_out, int(out_levels[j])), t_ps)
            changed = before_out ^ int(out_levels[j])
            before_out = int(out_levels[j])
            note_spacing(s, changed == last_changed, t_ps - last_ps, t_ps)
            last_ps, last_changed = t_ps, changed
            j += 1
            while q < asked_ps.size and asked_ps[q] <= t_ps:
                least_asked, most_asked = min(least_asked, asked[q]), max(most_asked, asked[q])
                q += 1
            low, high = step_counts * least_asked, step_counts * most_asked
            note_beyond(s, low, high, in_ps, in_levels, in_initial, i, t_ps - delay_ps, t_ps)
        if k < done_ps.size and done_ps[k] == t_ps:
            total = done[k]
            k += 1
        now_right = s.encoder_counts + step_counts * total
        if now_right != right:
            note_left(left_ps, right, t_ps)
            right = now_right
        off = s.controller_counts - right
        if off != 0 and s.off_counts == 0:
            s.off_since_ps = t_ps
        s.off_counts = off
