"""Compiled box at an axis, whatever works in it: it takes an edge, goes on to a time, and drives the controller.

``box`` is None where the injector of the axis' record models it, else the pair of `rtec.machine._firmware_kernels`:
the parts of a board, and the step that runs its firmware. Which of the two is known when a loop is compiled.
"""

from __future__ import annotations

from typing import Any

from rtec._jit import Record, helper, step
from rtec.axis._kernels import encoder_level, encoder_reset
from rtec.controller._kernels import receiver_edge, receiver_reset
from rtec.injector._monitor_kernels import observe
from rtec.injector._own_kernels import (
    works_edge,
    works_enable,
    works_fire,
    works_power,
    works_request,
    works_reset,
)
from rtec.injector._state_kernels import ARMED, INSERTING
from rtec.link._bus_kernels import NO_FAULT
from rtec.link._kernels import deliver
from rtec.machine._firmware_kernels import (
    deliver_board,
    firmware_edge,
    power_firmware,
    reset_idle_loop,
    set_inputs,
    skip_rounds,
    stop_firmware,
    turn_firmware,
    words_valid,
    zero_firmware,
)
from rtec.machine._recorder_kernels import keep, keep_own
from rtec.requester._box_kernels import RUNNING, box_trip
from rtec.requester._box_turn_kernels import box_sample
from rtec.signal._kernels import NEVER


@helper
def stand_still(m: Record) -> int:
    """Let encoder, injector and receiver stand at home, everything switched on; return the levels there."""
    encoder_reset(m.encoder, 0)
    level = encoder_level(m.encoder)
    works_reset(m.injector, level)
    receiver_reset(m.receiver, level)
    return int(level)


@step
def box_edge(st: Record, box: Any, t_ps: int, level: int) -> None:
    """Send a transition of the lines at ``t_ps``, up to which the box has been advanced, into it."""
    if box is None:
        works_edge(st.injector, t_ps, level)
    else:
        firmware_edge(box[0], t_ps, level)


@step
def box_output(st: Record, box: Any, t_ps: int) -> None:
    """Let the controller see what the box drives, once all events of this instant are carried out."""
    if box is not None:
        deliver_board(st, box[0], t_ps)
    elif observe(st.injector):
        receiver_edge(st.receiver, t_ps, st.injector.ab_out)


@step
def box_advance(st: Record, box: Any, t_ps: int) -> bool:
    """Let the box do what it does by itself up to ``t_ps``; what it does then joins what comes next there.

    Returns True, at ``event_ps``, where an insertion is under way for which a fault waits.
    """
    if box is None:
        return bool(st.injector.next_ps <= t_ps and advance_injector(st, t_ps))  # seldom is there anything to do
    parts, run = box
    return bool(run(st, parts, t_ps))


@helper
def advance_injector(st: Record, t_ps: int) -> bool:
    """Carry out the injector's own events up to ``t_ps``, as :func:`box_advance`."""
    s = st.injector
    while s.next_ps <= t_ps:
        own_ps = s.next_ps
        waits = st.pending.kind != NO_FAULT
        st.event_ps = max(own_ps, st.event_ps)
        if waits and s.in_path == 1 and s.phase == ARMED:
            return True  # its insertion is one change: the last moment before it
        works_fire(s)
        if waits and s.phase == INSERTING and s.next_ps > own_ps:
            return True
        if s.next_ps > own_ps and own_ps < t_ps:
            box_output(st, None, own_ps)
            box_keep(st, None, own_ps)
    return False


@helper
def box_power(st: Record, box: Any, t_ps: int, on: int) -> None:
    """Take the power of the box away or give it back; the gates are powered by the controller."""
    if box is None:
        works_power(st.injector, t_ps, on)
    else:
        power_firmware(st, box[0], t_ps, on)


@helper
def box_switch(st: Record, box: Any, t_ps: int, on: int) -> None:
    """Throw the hardware switch that allows corrections; a modelled box looks at its next reading whether it may."""
    st.node.box.switch_on = on
    if box is not None:
        set_inputs(st, box[0], t_ps)
    elif on == 0:
        works_enable(st.injector, t_ps, 0)


@helper
def box_probe(st: Record, box: Any, t_ps: int) -> None:
    """Let the probe trip."""
    if box is None:
        box_trip(st.node.box, st.box_count)
    else:
        st.trip_ps = t_ps
        set_inputs(st, box[0], t_ps)


@step
def instruct(st: Record, t_ps: int, allowed: bool, total: int) -> None:
    """Tell the injector whether it may insert, and the total that it is to reach."""
    s = st.injector
    if s.enabled != allowed:
        works_enable(s, t_ps, 1 if allowed else 0)
    if total != s.requested:
        works_request(s, t_ps, total)


@step
def box_reading(st: Record, box: Any, t_ps: int) -> int:
    """Let a box on a bus take its reading of the request; return the count that it reports."""
    n = st.node
    if box is None:
        box_sample(n, t_ps, st.box_count, st.injector.completed)
        return int(st.box_count)
    turn_firmware(st, box[0], t_ps)
    box_output(st, box, t_ps)
    deliver(n.up, t_ps)
    return int(n.box.zero + n.up.word0)


@step
def box_zero(st: Record, box: Any, t_ps: int) -> None:
    """Zero the counters of the box: the axis stands at home."""
    s = st.injector
    if box is None:
        works_request(s, t_ps, 0)
    else:
        zero_firmware(box[0])
    s.completed = 0
    s.requested = 0
    s.ahead = 0
    st.illegal_in = 0


@step
def box_obey(st: Record, box: Any, t_ps: int) -> None:
    """Let the injector of a box on a bus do what its node has accepted; a firmware does so by itself."""
    b = st.node.box
    if box is None:
        running = b.state == RUNNING
        allowed = running and b.switch_on == 1 and b.probing == 0
        instruct(st, t_ps, allowed, b.accepted if running else st.injector.requested)


@step
def box_turn(st: Record, box: Any) -> int:
    """Return when a box that is modelled next reads the PC's words; a running firmware takes its own turns."""
    return int(st.node.box.next_ps) if box is None else NEVER


@step
def box_valid(st: Record, box: Any, t_ps: int) -> bool:
    """Return whether the PC may read the box's words at ``t_ps``, once switch and probe are as they are now."""
    if box is None:
        return bool(st.powered == 1)
    set_inputs(st, box[0], t_ps)
    return words_valid(box[0])


@step
def box_idle(st: Record, box: Any) -> bool:
    """Return whether the box has nothing under way; of a firmware its words say so."""
    return True if box is not None else bool(st.injector.next_ps == NEVER)


@step
def box_skips(st: Record, box: Any, rests: bool, ticks: int) -> int:
    """Return how many of the next ``ticks`` the box lets pass at rest: a firmware whole rounds, a model all."""
    if box is not None:
        if not rests:
            reset_idle_loop(box[0])
        elif ticks > 1 and not skip_rounds(st, box[0], st.servo.now_ps + ticks * st.servo.period_ps):
            return 1
    return ticks


@helper
def box_stop(st: Record, box: Any, t_ps: int) -> int:
    """Forbid further insertions at ``t_ps``; return the time up to which a firmware has ended what it had begun."""
    if box is not None:
        stop_firmware(st, box, t_ps)
        box_output(st, box, st.event_ps)
        return int(st.event_ps)
    if st.injector.enabled == 1:
        works_enable(st.injector, t_ps, 0)
    return t_ps


@helper
def box_finish(st: Record, box: Any, t_ps: int) -> None:
    """Let an injector end what it has begun up to ``t_ps``; a firmware has."""
    if box is None:
        advance_injector(st, t_ps)


@step
def box_keep(st: Record, box: Any, t_ps: int) -> None:
    """Keep the lines for a picture, where that is wanted; what a firmware ends it keeps itself."""
    if st.keeps == 1:
        if box is None:
            keep_own(st, t_ps)
        else:
            keep(st, t_ps, False)
