"""Compiled parts of the box between encoder and controller: four insertion designs, their gates, and a monitor.

The box is a processor beside (Original, A, C) or inside (B) the lines. It has one event of its own at a time, at
``next_ps``; whoever drives it calls :func:`injector_fire` for that event and :func:`injector_edge` for each real
transition, in the order of their times. Both leave the levels at the controller in ``ab_out``.

Levels at the gates, with ``held`` the encoder's levels or the copy that the hold latch keeps::

    Original, A    ab_out = (held | pulse_high) & ~pulse_low
    C              ab_out = held ^ inverted
    B              ab_out = levels of (state of the sampled levels + offset)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper, kernel, step
from rtec.injector._firmware_kernels import (
    firmware_edge,
    firmware_fire,
    firmware_off,
    firmware_request,
    firmware_start,
)
from rtec.injector._firmware_pins_kernels import (
    ADVANCE,
    KEEP,
    LATCHING,
    ORIGINAL,
    RELEASING,
    START_UP_CYCLES,
    STEPPING,
    A,
    B,
    C,
)
from rtec.signal._kernels import ILLEGAL, NEVER, count_delta, level_of_state, state_of_level

UNTIMED_PS = NEVER // 2
"""An interval longer than this began before the box was switched on: the speed gate has not timed any yet."""

IDLE, ARMED, INSERTING, LETTING_GO, SAMPLING, WRITING, RUNNING = 0, 1, 2, 3, 4, 5, 6
"""What the next event of the box is: none, start of an insertion, its next change, end of holding, for Design B the
sampling and the writing of the lines, and whatever the timing of the firmware says."""

INJECTOR = np.dtype(
    [
        # parameters
        ("design", np.int64),
        ("poll_ps", np.int64),  # the processor looks at the lines at whole multiples of this (0: always)
        ("poll_offset_ps", np.int64),
        ("decide_ps", np.int64),  # from the look that recognises the moment to the first change
        ("step_ps", np.int64),  # between the changes of one insertion
        ("recover_ps", np.int64),  # after the last change, before the processor looks again
        ("latency_ps", np.int64),  # Design B: from sampling the lines to writing them
        ("gate_ps", np.int64),  # least interval that the speed gate lets through (0: no gate)
        ("rest_ps", np.int64),  # without an edge for so long the axis counts as at rest
        ("holds", np.int64),  # 1: real transitions are held back during an insertion
        ("releases", np.int64),  # Design C, loss of power: 1 drops the inverters, 0 latches them
        # the firmware's own timing (0: the times above)
        ("program", np.int64),
        ("effects", np.int64),
        ("cycle_ps", np.int64),
        ("sample_ps", np.int64),
        ("start_ps", np.int64),  # when a reading begins
        ("gate_counts", np.int64),  # of the gate's timer
        ("fast_counts", np.int64),  # between two readings: beyond them, no search begins
        # state
        ("enabled", np.int64),
        ("powered", np.int64),
        ("closing", np.int64),  # 1: the power goes once nothing is under way
        ("phase", np.int64),
        ("next_ps", np.int64),
        ("recognised_ps", np.int64),
        ("ready_ps", np.int64),
        ("ab_in", np.int64),
        ("held", np.int64),
        ("holding", np.int64),
        ("ab_out", np.int64),
        ("pulse_high", np.int64),
        ("pulse_low", np.int64),
        ("inverted", np.int64),
        ("sampled", np.int64),
        ("offset", np.int64),
        ("origin", np.int64),  # angle state at the start of the insertion
        ("sign", np.int64),
        ("done", np.int64),  # changes made of the insertion under way
        ("last_edge_ps", np.int64),
        ("edge_before_ps", np.int64),  # Original: when both lines went low last
        ("interval_ps", np.int64),  # what the speed gate measures
        ("requested", np.int64),  # totals in steps of the design
        ("completed", np.int64),
        # observations
        ("inserted", np.int64),  # insertions made, of either sign
        ("refused", np.int64),  # moments at which the speed gate refused one
        ("trigger_ps", np.int64),  # what the insertion follows
        ("longest_ps", np.int64),  # longest time from there to the last change
        ("real_inside", np.int64),  # real edges that fell between the look and the last change of an insertion
        ("seen_in", np.int64),  # levels that the monitor has counted on either side
        ("seen_out", np.int64),
        ("angle", np.int64),  # between them, in states
        ("ahead", np.int64),  # counts by which the controller's side went ahead of the encoder's
        ("illegal_out", np.int64),  # changes of both lines at one instant
        # where the firmware is (see `_firmware_kernels`); cycles where no other unit is said
        ("origin_ps", np.int64),
        ("place", np.int64),
        ("begin", np.int64),
        ("at", np.int64),
        ("cuts", np.int64),
        ("turn", np.int64),
        ("awaited", np.int64),
        ("exact", np.int64),
        ("breakable", np.int64),
        ("chores", np.int64),
        ("noting", np.int64),
        ("noted", np.int64),
        ("refusing", np.int64),
        ("event", np.int64),
        ("event_cycle", np.int64),
        ("pin", np.int64),
        ("pin_before", np.int64),
        ("pin_cycle", np.int64),
        ("fell", np.int64),
        ("fell_before", np.int64),
        ("forgotten", np.int64),
        ("over", np.int64),
        ("over_before", np.int64),
        ("alarm", np.int64),
        ("timed", np.int64),
        ("level", np.int64),
        ("half", np.int64),
        ("half_gate", np.int64),
        ("moved", np.int64),
        ("rest", np.int64),
        ("fast", np.int64),
        ("owed", np.int64),
        ("minus", np.int64),
        ("accepted", np.int64),
        ("judging", np.int64),
        ("count", np.int64),
        ("read_count", np.int64),
        ("delta", np.int64),
        ("closing_cycle", np.int64),
        ("piece", np.int64),
        ("running", np.int64),
        ("asked", np.int64),
    ],
    align=True,
)


@step
def changes_of(design: int) -> int:
    """Return the number of level changes of one insertion."""
    return 4 if design <= A else 2 if design == C else 1


@step
def gates(s: Record) -> int:
    """Return the levels at the controller."""
    held = s.held if s.holding == 1 else s.ab_in
    if s.design == C:
        return held ^ s.inverted
    if s.design == B:
        if s.powered == 0:
            return 0
        return level_of_state((state_of_level(s.sampled) + s.offset) & 3)
    return (held | s.pulse_high) & ~s.pulse_low


@step
def drive(s: Record) -> None:
    """Put the levels of the gates out."""
    s.ab_out = gates(s)


@step
def observe(s: Record) -> bool:
    """Let the monitor see both sides of the box; return whether the levels at the controller changed.

    To be called once all events of one instant are carried out: changes at one instant are one change. While the
    angle between the two sides stays, so does their difference in counts.
    """
    angle = (state_of_level(s.ab_out) - state_of_level(s.ab_in)) & 3
    if angle != s.angle:
        count_difference(s)
        s.angle = angle
    s.seen_in = s.ab_in
    if s.ab_out == s.seen_out:
        return False
    s.seen_out = s.ab_out
    return True


@helper
def count_difference(s: Record) -> None:
    """Count how far the controller's side went ahead of the encoder's, by an ideal decoder on each."""
    delta_out = count_delta(s.seen_out, s.ab_out)
    delta_in = count_delta(s.seen_in, s.ab_in)
    if delta_out == ILLEGAL or delta_in == ILLEGAL:
        s.illegal_out += 1
    else:
        s.ahead += delta_out - delta_in


@step
def next_look(s: Record, t_ps: int) -> int:
    """Return the time of the processor's first look at or after ``t_ps``."""
    if s.poll_ps == 0:
        return t_ps
    late = (t_ps - s.poll_offset_ps) % s.poll_ps
    return t_ps if late == 0 else t_ps + s.poll_ps - late


@step
def arm(s: Record, t_ps: int) -> None:
    """Recognise the moment at the next look after ``t_ps`` and plan the first change."""
    s.recognised_ps = next_look(s, t_ps)
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
    if s.phase == IDLE and wanted(s) and (s.design != ORIGINAL or s.ab_in == 0):
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
    if wanted(s) and (s.design != ORIGINAL or s.ab_in == 0):
        if s.gate_ps > 0 and not s.gate_ps <= s.interval_ps < UNTIMED_PS:
            s.refused += 1
        elif t_ps >= s.ready_ps:  # a busy processor would look too late after the transition
            arm(s, t_ps)


@step
def begin_sampling(s: Record, t_ps: int) -> None:
    """Plan Design B's next look at the lines."""
    s.next_ps = next_look(s, max(t_ps, s.ready_ps))
    s.phase = SAMPLING


@step
def note_edge(s: Record, t_ps: int, ab: int) -> None:
    """Take the levels of the transition at ``t_ps`` in, and time it as the speed gate does."""
    s.ab_in = ab
    if s.design != ORIGINAL:
        s.interval_ps = t_ps - s.edge_before_ps
        s.edge_before_ps = s.last_edge_ps
    elif ab == 0:
        s.interval_ps = t_ps - s.edge_before_ps
        s.edge_before_ps = t_ps
    s.last_edge_ps = t_ps


@step
def injector_edge(s: Record, t_ps: int, ab: int) -> None:
    """Take a real transition to ``ab`` at ``t_ps``."""
    before = s.ab_in
    note_edge(s, t_ps, ab)
    if s.program == 1:
        firmware_edge(s, t_ps, before)
        if s.design != B:
            drive(s)
        return
    if s.design == B:
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
def sample(s: Record, t_ps: int) -> None:
    """Let Design B's processor read the lines and plan their writing."""
    s.sampled = s.ab_in
    s.next_ps = t_ps + s.latency_ps
    s.phase = WRITING


@step
def write(s: Record, t_ps: int) -> None:
    """Let Design B's processor write what it read, and insert right after it if it owes a count."""
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
    if s.design == C:
        # forward, the state goes 0 -A-> 1 -B-> 2 -A-> 3 -B-> 0: from an even state A changes first, backward B
        a_first = (s.origin & 1 == 0) == (s.sign > 0)
        s.inverted ^= 1 if a_first == (s.done == 1) else 2
    elif s.design == B:
        s.offset = (s.offset + s.sign) & 3
    else:
        start = level_of_state(s.origin)
        goal = level_of_state((s.origin + s.sign * s.done) & 3)
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
    if s.design == B and s.ab_in != s.sampled:
        begin_sampling(s, t_ps)
    else:
        arm_at_rest(s, t_ps)


@helper
def fire_firmware(s: Record, t_ps: int) -> None:
    """Carry out an event of the firmware's timing."""
    order = firmware_fire(s)
    if order == ADVANCE:
        advance_insertion(s)
    if order != KEEP:
        drive(s)
    if s.closing == 1:
        close_firmware(s, t_ps)


@step
def close_firmware(s: Record, t_ps: int) -> None:
    """Take the power away unless an insertion is under way."""
    if not (LATCHING <= s.place <= RELEASING or s.place == STEPPING):
        injector_power(s, t_ps, 0)


@step
def injector_fire(s: Record) -> None:
    """Carry out the box's own event at ``next_ps``."""
    t_ps = s.next_ps
    if s.phase == RUNNING:
        fire_firmware(s, t_ps)
    elif s.phase == SAMPLING:
        sample(s, t_ps)
    elif s.phase == WRITING:
        write(s, t_ps)
    elif s.phase == LETTING_GO:
        s.holding = 0
        cancel(s)
        drive(s)
        arm_at_rest(s, t_ps)
    elif s.requested == s.completed and s.phase == ARMED:
        finish_holding(s, t_ps)  # the request went back before the start
        if s.design == B and s.ab_in != s.sampled:
            begin_sampling(s, t_ps)
    else:
        if s.phase == ARMED:
            s.phase = INSERTING
            s.done = 0
            s.sign = 1 if s.requested > s.completed else -1
            if s.holds == 1 and s.design != B:
                hold(s)
        advance_insertion(s)
        drive(s)
        s.next_ps = t_ps + s.step_ps
        if s.done == changes_of(s.design):
            finish_insertion(s, t_ps)
    if s.closing == 1 and s.phase == IDLE:
        injector_power(s, t_ps, 0)


@step
def injector_request(s: Record, t_ps: int, total: int) -> None:
    """Take the total of steps over that the box is to have inserted."""
    s.requested = total
    if s.program == 1:
        firmware_request(s, t_ps)
        return
    if total == s.completed and s.phase == ARMED and t_ps <= s.recognised_ps:
        cancel(s)
    arm_at_rest(s, t_ps)


@step
def injector_enable(s: Record, t_ps: int, enabled: int) -> None:
    """Allow or forbid insertions; one that is recognised already is carried to its end."""
    s.enabled = enabled
    if s.program == 1:
        return
    if enabled == 0 and s.phase == ARMED and t_ps <= s.recognised_ps:
        cancel(s)
    arm_at_rest(s, t_ps)


@step
def injector_shutdown(s: Record, t_ps: int) -> None:
    """Switch the box off in good order: what is under way is carried to its end, then the power goes."""
    injector_enable(s, t_ps, 0)
    s.closing = 1
    if s.program == 1:
        close_firmware(s, t_ps)
    elif s.phase == IDLE:
        injector_power(s, t_ps, 0)


@step
def injector_power(s: Record, t_ps: int, powered: int) -> None:
    """Take the box's power away or give it back.

    Without power the OR and AND circuits, fed by the controller, pass A and B through; the inverters keep or drop
    their state; Design B's outputs are dead. With power back the processor starts with empty totals.
    """
    cancel(s)
    s.powered = powered
    s.closing = 0
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
    if s.program == 1:
        s.phase = RUNNING
        if powered == 0:
            firmware_off(s)
        else:
            s.origin_ps = t_ps + START_UP_CYCLES * s.cycle_ps
            firmware_start(s)
    drive(s)


@step
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
    if s.program == 1:
        s.phase = RUNNING
        s.origin_ps = s.start_ps
        firmware_start(s)


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
def shut_down(s: Record, t_ps: int) -> None:
    """Switch the box off in good order from outside."""
    injector_shutdown(s, t_ps)


@kernel
def reset(s: Record, ab: int) -> None:
    """Start at rest with the levels ``ab``."""
    injector_reset(s, ab)
