"""Compiled seam to an algorithm of a user's in the place of a design's steps: the same calls, the same record.

The algorithm is a function in machine code, called by its address with the address of the `OWN` part of the
injector's record and that of its memory. It knows its own times and totals only: power-up is time 0 with a total
of 0. What the switch in front of it, homing and the circuits around it add stands here.
"""

from __future__ import annotations

from rtec._jit import Record, call_at, helper, step
from rtec.injector._kernels import (
    injector_edge,
    injector_enable,
    injector_fire,
    injector_power,
    injector_request,
    injector_reset,
)
from rtec.injector._state_kernels import ARMED, IDLE, INSERTING
from rtec.signal._kernels import NEVER, state_of_level

_SWITCH_PS = 1_000_000
"""After a step that is completed with the switch open the algorithm is shown the new total so much later."""
_IDLE_CALLS = 100_000
"""So often an algorithm is called by its own wish between two changes of its inputs while it may not insert: one that
polls would never come to its end."""


@helper
def own_call(s: Record, t_ps: int, by_itself: bool) -> None:
    """Let the algorithm see its inputs at ``t_ps``, and put out what it says."""
    o = s.own
    done, code = o.completed, o.refused
    turned = (state_of_level(s.ab_out) - state_of_level(s.ab_in)) & 3
    # its switch shows it the total that it has; its totals go on where those of the machine are zeroed at home
    asked = s.requested if s.enabled == 1 else s.completed
    if o.broken == 0:
        o.t_ps = t_ps - o.since_ps
        o.ab = s.ab_in
        o.requested = done + asked - s.completed
        o.calls = 0 if not by_itself else o.calls + 1
        call_at(o.function, o, o.memory)
    made = o.completed - done
    s.completed += made
    s.inserted += abs(made)
    if o.refused != 0 and o.refused != code:
        s.refused += 1
    s.ab_out = o.levels ^ s.inverted
    s.next_ps = NEVER if o.wake_ps == 0 else o.since_ps + o.wake_ps
    if s.enabled == 0:
        if made != 0:
            s.next_ps = min(s.next_ps, t_ps + _SWITCH_PS)
        if o.calls > _IDLE_CALLS:
            s.next_ps = NEVER
    owes = asked != s.completed and s.enabled == 1
    if made != 0 or not owes:
        s.phase = IDLE
    elif by_itself and (state_of_level(s.ab_out) - state_of_level(s.ab_in)) & 3 != turned:
        s.phase = INSERTING
    if s.phase != INSERTING:
        s.phase = ARMED if owes and s.next_ps != NEVER else IDLE


@helper
def own_power_up(s: Record, t_ps: int) -> None:
    """Switch the algorithm on at ``t_ps``: it begins anew, with a first call then."""
    o = s.own
    o.fresh = 1
    o.completed = 0
    o.refused = 0
    o.since_ps = t_ps
    s.next_ps = t_ps


@helper
def own_pass(s: Record) -> None:
    """Put out what circuits without a processor say: gates and inverters are powered by the controller."""
    s.ab_out = 0 if s.in_path == 1 else s.ab_in ^ s.inverted


@helper
def own_edge(s: Record, t_ps: int, ab: int) -> None:
    """As `injector_edge`."""
    s.ab_in = ab
    s.last_edge_ps = t_ps
    if s.phase == INSERTING:
        s.real_inside += 1
    if s.powered == 1:
        own_call(s, t_ps, False)
    else:
        own_pass(s)


@helper
def own_asks(s: Record, t_ps: int) -> None:
    """Let the algorithm see at ``t_ps`` what it may insert now."""
    s.own.calls = 0
    if s.powered == 1:
        s.next_ps = min(s.next_ps, t_ps)
        if s.phase == IDLE and s.enabled == 1 and s.requested != s.completed:
            s.phase = ARMED


@helper
def own_power(s: Record, t_ps: int, powered: int) -> None:
    """As `injector_power`."""
    if powered == 0:
        if s.inverts == 1 and s.releases == 0:
            s.inverted = s.ab_in ^ s.ab_out
        else:
            s.inverted = 0
        s.next_ps = NEVER
    else:
        s.requested = 0
        s.completed = 0
        own_power_up(s, t_ps)
    s.powered = powered
    s.phase = IDLE
    own_pass(s)


@step
def works_edge(s: Record, t_ps: int, ab: int) -> None:
    """Take a real transition to ``ab`` at ``t_ps``, whatever works in the box."""
    if s.own.function == 0:
        injector_edge(s, t_ps, ab)
    else:
        own_edge(s, t_ps, ab)


@step
def works_fire(s: Record) -> None:
    """Carry out the box's own event at ``next_ps``, whatever works in it."""
    if s.own.function == 0:
        injector_fire(s)
    else:
        own_call(s, s.next_ps, True)


@step
def works_request(s: Record, t_ps: int, total: int) -> None:
    """Take the total of steps over that the box is to have inserted, whatever works in it."""
    if s.own.function == 0:
        injector_request(s, t_ps, total)
    else:
        s.requested = total
        own_asks(s, t_ps)


@step
def works_enable(s: Record, t_ps: int, enabled: int) -> None:
    """Allow or forbid insertions, whatever works in the box."""
    if s.own.function == 0:
        injector_enable(s, t_ps, enabled)
    else:
        s.enabled = enabled
        own_asks(s, t_ps)


@helper
def works_power(s: Record, t_ps: int, powered: int) -> None:
    """Take the box's power away or give it back, whatever works in it."""
    if s.own.function == 0:
        injector_power(s, t_ps, powered)
    else:
        own_power(s, t_ps, powered)


@helper
def works_reset(s: Record, ab: int) -> None:
    """Start at rest with the levels ``ab``, powered and enabled, nothing requested, whatever works in the box."""
    injector_reset(s, ab)
    if s.own.function != 0:
        s.own.levels = ab
        own_power_up(s, 0)
