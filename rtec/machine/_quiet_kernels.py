"""Compiled passing of edges through a box that only passes them on: each is counted, and that is all.

What `injector_edge` asks of each edge, whether anything is owed or under way, is asked here once for a run of edges.
One by one they go on through `receiver_edge`; at once where filter and decoder have nothing to decide, either.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper, written_out
from rtec.axis._ahead_kernels import AHEAD
from rtec.controller._kernels import X4, receiver_edge, stood_long, take_over
from rtec.injector._insertion_kernels import advance_insertion, drive, finish_insertion, hold
from rtec.injector._kernels import note_edge
from rtec.injector._state_kernels import ARMED, IDLE
from rtec.signal._kernels import level_of_state, state_of_level


@helper
def passes_on(s: Record, t_ps: int) -> bool:
    """Return whether a box, run up to ``t_ps``, passes edges on from then as long as it has nothing else to do.

    Between the two sides lies an angle that stays, then: a half turn where both inverters are on, and where the lines
    pass through the processor what it has inserted.
    """
    idle = s.phase == IDLE and s.holding == 0 and s.ab_out == s.seen_out
    if s.in_path == 1:
        return idle and s.powered == 1 and s.poll_ps == 0 and s.ready_ps <= t_ps and s.ab_in == s.sampled
    return idle and s.pulse_high | s.pulse_low == 0 and (s.inverted == 0 or s.inverted == 3)


@helper
def edge_ps(times_ps: NDArray[np.int64], i: int) -> int:
    """Return when edge number ``i`` comes; so the compiler sees that the index lies inside."""
    return int(times_ps[i & (AHEAD - 1)])


@helper
def pass_on(s: Record, t_ps: int, state: int) -> None:
    """Pass an edge to an encoder's state on and do nothing else; the processor in the lines writes it, too."""
    note_edge(s, t_ps, level_of_state(state & 3))
    s.ab_out = level_of_state((state + s.angle) & 3)


@helper
def settles(rx: Record, t_ps: int, ab: int, more: bool) -> bool:
    """Return whether `take_over` may take an edge to ``ab``; with more to come surely apart, it may count early.

    Where a tick has seen the change before it alone, both count in their order, at the latest before the next edge.
    """
    pending = rx.raw ^ rx.accepted
    since_ps = t_ps - rx.last_ps
    single = pending == 1 or pending == 2
    return single and (since_ps > rx.sure_ps or (more and since_ps >= rx.unseen_ps and rx.raw ^ ab != pending))


@written_out
def pass_singly(m: Record, times_ps: NDArray[np.int64], first: int, stop: int, state: int, closest_ps: int) -> None:
    """Pass edges from number ``first`` to before ``stop`` one by one; ``state`` is the encoder's before number 0."""
    s, rx, sign = m.injector, m.receiver, m.encoder.step_sign
    delay_ps = s.latency_ps if s.in_path == 1 else 0
    apart = rx.samples > 0 and closest_ps > rx.sure_ps
    i = first
    # a loop that calls nothing keeps what it works on in registers: so the edges at the start have their own
    while i < stop:
        t_ps = edge_ps(times_ps, i)
        ab = level_of_state((state + sign * (i + 1) + s.angle) & 3)
        if apart and settles(rx, t_ps + delay_ps, ab, i + 1 < stop):
            break
        i += 1
        pass_on(s, t_ps, state + sign * i)
        receiver_edge(rx, t_ps + delay_ps, ab)
    while i < stop:
        t_ps = edge_ps(times_ps, i)
        i += 1
        pass_on(s, t_ps, state + sign * i)
        take_over(rx, t_ps + delay_ps, s.ab_out)


@written_out
def pass_together(m: Record, times_ps: NDArray[np.int64], first: int, stop: int, state: int, closest_ps: int) -> None:
    """Pass edges from number ``first`` to before ``stop`` at once; the one before them has passed just so.

    They come at least ``closest_ps`` after each other, which is more than filter and processor need: each of them
    makes the one before it count.
    """
    s, rx, sign = m.injector, m.receiver, m.encoder.step_sign
    delay_ps = s.latency_ps if s.in_path == 1 else 0
    if closest_ps < rx.min_separation_ps:
        for i in range(first, stop):
            separation_ps = edge_ps(times_ps, i) - edge_ps(times_ps, i - 1)
            rx.min_separation_ps = min(rx.min_separation_ps, separation_ps)
    rx.count += sign * (stop - first)
    rx.direction = sign
    # so far back goes what the speed gate times
    for i in range(max(first, stop - (8 if s.one_state == 1 else 3)), stop):
        rx.accepted = s.ab_out
        pass_on(s, edge_ps(times_ps, i), state + sign * (i + 1))
    rx.raw = s.ab_out
    rx.last_ps = edge_ps(times_ps, stop - 1) + delay_ps
    before_ps = edge_ps(times_ps, stop - 2) + delay_ps
    a_is_last = rx.raw ^ rx.accepted == 1
    rx.changed_a_ps = rx.last_ps if a_is_last else before_ps
    rx.changed_b_ps = before_ps if a_is_last else rx.last_ps


@helper
def passthrough_block(
    m: Record, times_ps: NDArray[np.int64], first: int, stop: int, state: int, closest_ps: int
) -> None:
    """Pass edges from number ``first`` to before ``stop`` through a box that only passes them on.

    ``state`` is the encoder's before edge number 0, ``closest_ps`` the least time between two edges.
    """
    s, rx = m.injector, m.receiver
    single = stop
    if m.in_blocks == 1 and rx.samples > 0 and rx.multiplication == X4 and closest_ps > rx.sure_ps:
        # what came before the first of them may not be through the filter; before the second one all is
        out_ps = edge_ps(times_ps, first) + (s.latency_ps if s.in_path == 1 else 0)
        single = min(stop, first + (1 if out_ps - rx.last_ps > rx.sure_ps else 2))
    pass_singly(m, times_ps, first, single, state, closest_ps)
    if single < stop:
        pass_together(m, times_ps, single, stop, state, closest_ps)
    s.seen_in = s.ab_in
    s.seen_out = s.ab_out
    if s.in_path == 1:
        s.sampled = s.ab_in


@helper
def insert_quietly(m: Record, t_ps: int) -> None:
    """Make the whole insertion that is planned, if it ends before ``t_ps`` and its changes surely pass the filter.

    Each change goes through the gates and `take_over`, the monitor sees what they come to.
    """
    s, rx = m.injector, m.receiver
    changes, step_ps, first_ps = s.changes, s.step_ps, s.next_ps
    if (
        s.phase == ARMED
        and s.requested != s.completed
        and s.in_path == 0
        and first_ps + (changes - 1) * step_ps < t_ps
        and rx.samples > 0
        and step_ps > rx.sure_ps
        and stood_long(rx, first_ps)
        and s.ab_in == level_of_state(s.origin & 3)
        and s.ab_in == s.seen_in
        and s.ab_out == s.seen_out
    ):
        s.sign = 1 if s.requested > s.completed else -1
        if s.holds == 1:
            hold(s)
        s.done = 0
        own_ps = first_ps - step_ps
        while s.done < changes:
            own_ps += step_ps
            advance_insertion(s)
            drive(s)
            take_over(rx, own_ps, s.ab_out)
        s.ahead += s.sign * changes
        s.angle = (state_of_level(s.ab_out) - state_of_level(s.ab_in)) & 3
        s.seen_out = s.ab_out
        s.next_ps = own_ps + step_ps
        finish_insertion(s, own_ps)
