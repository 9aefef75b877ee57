"""Compiled box between encoder and controller: what it does at an edge, by itself, and when it is told to.

The box is a processor beside the lines, or one through which they pass (Design B). It has one event of its own at a
time, at ``next_ps``; whoever drives it calls :func:`injector_fire` for that event and :func:`injector_edge` for each
real transition, in the order of their times. Both leave the levels at the controller in ``ab_out``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper, kernel, step
from rtec.injector._insertion_kernels import (
    advance_insertion,
    arm_at_rest,
    begin_sampling,
    cancel,
    drive,
    finish_holding,
    finish_insertion,
    hold,
    sample,
    trigger,
    write,
)
from rtec.injector._monitor_kernels import observe
from rtec.injector._state_kernels import ARMED, HUNG, IDLE, INSERTING, LETTING_GO, SAMPLING, STUCK, WRITING
from rtec.signal._kernels import NEVER


@step
def note_edge(s: Record, t_ps: int, ab: int) -> None:
    """Take the levels of the transition at ``t_ps`` in, and time it as the speed gate does."""
    s.ab_in = ab
    if s.one_state == 0:
        s.interval_ps = t_ps - s.edge_before_ps
        s.edge_before_ps = s.last_edge_ps
    elif ab == 0:
        s.interval_ps = t_ps - s.edge_before_ps
        s.edge_before_ps = t_ps
    s.last_edge_ps = t_ps


@step
def injector_edge(s: Record, t_ps: int, ab: int) -> None:
    """Take a real transition to ``ab`` at ``t_ps``; behind a latch that sticks closed nothing sees one."""
    if s.holds == STUCK:
        return
    note_edge(s, t_ps, ab)
    if s.in_path == 1:
        if s.powered == 1 and (s.phase == IDLE or (s.phase == ARMED and t_ps <= s.recognised_ps)):
            begin_sampling(s, t_ps)
            if s.next_ps <= t_ps:
                sample(s, t_ps)
        return  # the lines end at the processor
    if s.requested != s.completed or s.phase != IDLE:
        if s.phase == ARMED and t_ps <= s.recognised_ps:
            cancel(s)
        elif s.phase == ARMED or s.phase == INSERTING:
            s.real_inside += 1
            if s.phase == ARMED and s.holds == 1:
                hold(s)
        if s.phase == IDLE:
            trigger(s, t_ps)
            arm_at_rest(s, t_ps)
    drive(s)


@step
def injector_fire(s: Record) -> None:
    """Carry out the box's own event at ``next_ps``."""
    t_ps = s.next_ps
    if s.phase == ARMED and s.requested != s.completed:
        s.phase = INSERTING
        s.done = 0
        s.sign = 1 if s.requested > s.completed else -1
        if s.holds == 1 and s.in_path == 0:
            hold(s)
    if s.phase == INSERTING:
        advance_insertion(s)
        drive(s)
        s.next_ps = t_ps + s.step_ps
        if s.done == s.changes:
            finish_insertion(s, t_ps)
    elif s.phase == SAMPLING:
        sample(s, t_ps)
    elif s.phase == WRITING:
        write(s, t_ps)
    elif s.phase == LETTING_GO:
        s.holding = 0
        cancel(s)
        drive(s)
        arm_at_rest(s, t_ps)
    else:  # the request went back before the start
        finish_holding(s, t_ps)
        if s.in_path == 1 and s.ab_in != s.sampled:
            begin_sampling(s, t_ps)


@step
def injector_request(s: Record, t_ps: int, total: int) -> None:
    """Take the total of steps over that the box is to have inserted."""
    s.requested = total
    if total == s.completed and s.phase == ARMED and t_ps <= s.recognised_ps:
        cancel(s)
    arm_at_rest(s, t_ps)


@step
def injector_enable(s: Record, t_ps: int, enabled: int) -> None:
    """Allow or forbid insertions; one that is recognised already is carried to its end."""
    s.enabled = enabled
    if enabled == 0 and s.phase == ARMED and t_ps <= s.recognised_ps:
        cancel(s)
    arm_at_rest(s, t_ps)


@helper
def injector_power(s: Record, t_ps: int, powered: int) -> None:
    """Take the box's power away or give it back.

    Without power the OR and AND circuits, fed by the controller, pass A and B through; the inverters keep or drop
    their state; a processor in the lines leaves them dead. With power back the processor starts with empty totals.
    """
    cancel(s)
    s.powered = powered
    s.pulse_high = 0
    s.pulse_low = 0
    s.holding = 0
    if powered == 0:
        if s.releases == 1:
            s.inverted = 0
    else:
        s.sampled = s.ab_in
        s.offset = 0
        s.requested = 0
        s.completed = 0
        s.ready_ps = t_ps + s.recover_ps
        s.last_edge_ps = t_ps  # whether the axis rests, and how fast it moves, is still to be seen
        s.edge_before_ps = -NEVER
    drive(s)


@helper
def injector_hang(s: Record) -> None:
    """Let the processor stand still: its outputs stay, and it reads and begins nothing."""
    cancel(s)
    s.powered = HUNG


@helper
def injector_latch(s: Record, t_ps: int, level: int, sticks: int, closed: int) -> None:
    """Let the hold latch stick, open or closed, or work again; ``level`` is that of the lines before it."""
    if closed == 1:
        s.ab_in = s.held if s.holding == 1 else s.ab_in
        s.holds = STUCK
        return
    s.holds = 1 - sticks
    s.holding = 0
    if level != s.ab_in:
        injector_edge(s, t_ps, level)
    drive(s)


@helper
def injector_reset(s: Record, ab: int) -> None:
    """Start at rest with the levels ``ab``, powered and enabled, nothing requested."""
    s.enabled = 1
    s.powered = 1
    s.phase = IDLE
    s.next_ps = NEVER
    s.ready_ps = -NEVER
    s.ab_in = ab
    s.sampled = ab
    s.ab_out = ab
    s.seen_in = ab
    s.seen_out = ab
    s.last_edge_ps = -NEVER
    s.edge_before_ps = -NEVER


@kernel
def inject(
    s: Record,
    times_ps: NDArray[np.int64],
    levels: NDArray[np.uint8],
    from_ps: int,
    until_ps: int,
    out_ps: NDArray[np.int64],
    out_levels: NDArray[np.uint8],
) -> int:
    """Run the box over a chunk of real edges and on to just before ``until_ps``; return the number of edges written.

    What a switch has changed at ``from_ps``, the end of the last run, is seen at that instant. ``out_ps`` and
    ``out_levels`` need room for six changes an edge, five for each insertion at rest, and eight more.
    """
    n = 0
    i = 0
    while True:
        edge_ps = times_ps[i] if i < times_ps.size else until_ps
        t_ps = min(s.next_ps, edge_ps)
        if t_ps > from_ps and observe(s):
            out_ps[n] = from_ps
            out_levels[n] = s.ab_out
            n += 1
        if t_ps >= until_ps:
            return n
        while s.next_ps <= t_ps:
            injector_fire(s)
        if edge_ps == t_ps:
            injector_edge(s, t_ps, int(levels[i]))
            i += 1
        if observe(s):
            out_ps[n] = t_ps
            out_levels[n] = s.ab_out
            n += 1


@kernel
def request(s: Record, t_ps: int, total: int) -> None:
    """Request a total from outside."""
    injector_request(s, t_ps, total)


@kernel
def switch(s: Record, t_ps: int, enabled: int, powered: int) -> None:
    """Set the switch and the power from outside."""
    if enabled != s.enabled:
        injector_enable(s, t_ps, enabled)
    if powered != s.powered:
        injector_power(s, t_ps, powered)


@kernel
def reset(s: Record, ab: int) -> None:
    """Start at rest with the levels ``ab``."""
    injector_reset(s, ab)
