"""Compiled steps of an insertion: the gates, the moment for it, its changes, its end.

Levels at the gates, with ``held`` the encoder's levels or the copy that the hold latch keeps::

    beside the processor    ab_out = ((held ^ inverted) | pulse_high) & ~pulse_low
    through it              ab_out = levels of (state of the sampled levels + offset)

An insertion walks from state to state: it inverts one line after the other, forces levels by pulses, or moves the
offset. A design says which, how far, and from where (`rtec.injector.design`).
"""

from __future__ import annotations

from rtec._jit import Record, helper, step
from rtec.injector._state_kernels import ARMED, IDLE, LETTING_GO, SAMPLING, WRITING
from rtec.signal._kernels import NEVER, level_of_state, state_of_level

UNTIMED_PS = NEVER // 2
"""An interval longer than this began before the box was switched on: the speed gate has not timed any yet."""


@step
def gates(s: Record) -> int:
    """Return the levels at the controller."""
    if s.in_path == 1:
        if s.powered == 0:
            return 0
        return level_of_state((state_of_level(s.sampled) + s.offset) & 3)
    held = s.held if s.holding == 1 else s.ab_in
    return ((held ^ s.inverted) | s.pulse_high) & ~s.pulse_low


@step
def drive(s: Record) -> None:
    """Put the levels of the gates out."""
    s.ab_out = gates(s)


@step
def next_poll(s: Record, t_ps: int) -> int:
    """Return the time of the processor's first look at or after ``t_ps``."""
    if s.poll_ps == 0:
        return t_ps
    late = (t_ps - s.poll_offset_ps) % s.poll_ps
    return t_ps if late == 0 else t_ps + s.poll_ps - late


@step
def arm(s: Record, t_ps: int) -> None:
    """Recognise the moment at the next look after ``t_ps`` and plan the first change."""
    s.recognised_ps = next_poll(s, t_ps)
    s.trigger_ps = t_ps
    s.next_ps = s.recognised_ps + s.decide_ps
    s.phase = ARMED
    # an edge up to the look plans anew, so the state now is the state that the look sees
    s.origin = state_of_level(s.ab_in)


@step
def wanted(s: Record) -> bool:
    """Return whether an insertion is owed and allowed."""
    return s.requested != s.completed and s.enabled == 1 and s.powered == 1


@step
def arm_at_rest(s: Record, t_ps: int) -> None:
    """Plan an insertion for the time at which the axis will have been at rest long enough."""
    if s.phase == IDLE and wanted(s) and (s.one_state == 0 or s.ab_in == 0):
        arm(s, max(max(s.last_edge_ps + s.rest_ps, t_ps), s.ready_ps))


@step
def cancel(s: Record) -> None:
    """Drop a planned insertion."""
    s.phase = IDLE
    s.next_ps = NEVER


@step
def trigger(s: Record, t_ps: int) -> None:
    """Plan an insertion right after the transition at ``t_ps``, if the axis is slow enough for it.

    The gate times what the report's circuits offer: the interval between A&B-low signals (Original), else the period
    of the exclusive OR, two edges.
    """
    if wanted(s) and (s.one_state == 0 or s.ab_in == 0):
        if s.gate_ps > 0 and not s.gate_ps <= s.interval_ps < UNTIMED_PS:
            s.refused += 1
        elif t_ps >= s.ready_ps:  # a busy processor would look too late after the transition
            arm(s, t_ps)


@step
def begin_sampling(s: Record, t_ps: int) -> None:
    """Plan the next look at lines that pass through the processor."""
    s.next_ps = next_poll(s, max(t_ps, s.ready_ps))
    s.phase = SAMPLING


@step
def sample(s: Record, t_ps: int) -> None:
    """Let the processor read the lines that pass through it, and plan their writing."""
    s.sampled = s.ab_in
    s.next_ps = t_ps + s.latency_ps
    s.phase = WRITING


@helper
def write(s: Record, t_ps: int) -> None:
    """Let the processor write what it read, and insert right after it if it owes a count."""
    drive(s)
    cancel(s)
    if s.ab_in != s.sampled:
        begin_sampling(s, t_ps)
    elif s.requested != s.completed:
        trigger(s, t_ps)
        if s.phase == ARMED:  # the processor is at it already: no further look
            s.trigger_ps = s.last_edge_ps
            s.recognised_ps = t_ps
            s.next_ps = t_ps + s.decide_ps
        arm_at_rest(s, t_ps)


@step
def advance_insertion(s: Record) -> None:
    """Set the gates for the next change of the insertion under way."""
    s.done += 1
    goal = level_of_state((s.origin + s.sign * s.done) & 3)
    if s.in_path == 1:
        s.offset = (s.offset + s.sign) & 3
    elif s.inverts == 1:
        s.inverted ^= goal ^ level_of_state((s.origin + s.sign * (s.done - 1)) & 3)
    else:
        start = level_of_state(s.origin)
        s.pulse_high = goal & ~start
        s.pulse_low = start & ~goal


@step
def hold(s: Record) -> None:
    """Keep the levels that the processor recognised: the latch closes before it reads them."""
    s.holding = 1
    s.held = level_of_state(s.origin)


@step
def finish_holding(s: Record, t_ps: int) -> None:
    """End with what is under way; real transitions held back go through one step later."""
    cancel(s)
    if s.holding == 1:
        s.next_ps = t_ps + s.step_ps
        s.phase = LETTING_GO


@step
def finish_insertion(s: Record, t_ps: int) -> None:
    """Book the insertion whose last change was at ``t_ps``."""
    s.completed += s.sign
    s.inserted += 1
    s.longest_ps = max(s.longest_ps, t_ps - s.trigger_ps)
    s.ready_ps = t_ps + s.recover_ps
    finish_holding(s, t_ps)
    if s.in_path == 1 and s.ab_in != s.sampled:
        begin_sampling(s, t_ps)
    else:
        arm_at_rest(s, t_ps)
