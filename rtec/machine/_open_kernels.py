"""The open signal path in one compiled loop: encoder, box, receiver, one edge after the other.

All state stands in one record: the compiler then knows that the parts do not overlap.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rtec._jit import Record, kernel, step
from rtec.axis._kernels import ENCODER, emit, encoder_level, encoder_reset, glitch_toggle, steady_crossing
from rtec.controller._kernels import RECEIVER, receiver_edge, receiver_reset, receiver_settle
from rtec.injector._kernels import (
    INJECTOR,
    injector_edge,
    injector_fire,
    injector_request,
    injector_reset,
    observe,
)

OPEN_PATH = np.dtype(
    [
        ("encoder", ENCODER),
        ("injector", INJECTOR),
        ("receiver", RECEIVER),
        # corrections asked for, spread evenly over the edges: one is due whenever the sum passes `edges`
        ("edges", np.int64),
        ("corrections", np.int64),
        ("sign", np.int64),
        ("due", np.int64),
    ],
    align=True,
)


@step
def keep(tape: Any, side: int, t_ps: int, ab: int) -> None:
    """Write an edge of the encoder's (0) or the controller's (1) side on the tape, if there is one."""
    if tape is not None:
        times_ps, levels, used = tape
        n = used[side]
        times_ps[side, n] = t_ps
        levels[side, n] = ab
        used[side] = n + 1


@step
def run_box_until(m: Record, t_ps: int, tape: Any) -> None:
    """Carry out the box's own events up to and at ``t_ps``; those at ``t_ps`` itself join what comes next there."""
    s = m.injector
    while s.next_ps <= t_ps:
        own_ps = s.next_ps
        while s.next_ps <= own_ps:
            injector_fire(s)
        if own_ps < t_ps and observe(s):
            receiver_edge(m.receiver, own_ps, s.ab_out)
            keep(tape, 1, own_ps, s.ab_out)


@step
def pass_edge(m: Record, t_ps: int, tape: Any) -> None:
    """Send the encoder's levels at ``t_ps`` through box and receiver."""
    s = m.injector
    ab = encoder_level(m.encoder)
    keep(tape, 0, t_ps, ab)
    injector_edge(s, t_ps, ab)
    if observe(s):
        receiver_edge(m.receiver, t_ps, s.ab_out)
        keep(tape, 1, t_ps, s.ab_out)


@kernel
def start(m: Record, count: int) -> None:
    """Stand still at ``count``."""
    encoder_reset(m.encoder, count)
    injector_reset(m.injector, encoder_level(m.encoder))
    receiver_reset(m.receiver, encoder_level(m.encoder))
    m.due = m.edges - 1


@kernel
def run(m: Record, edges: int, tape: Any) -> None:
    """Move over the next ``edges`` lines at constant speed."""
    e = m.encoder
    for _ in range(edges):
        crossing_ps = steady_crossing(e)
        while e.glitch_next_ps < crossing_ps:
            t_ps = max(glitch_toggle(e), e.last_ps + 1)
            e.last_ps = t_ps
            run_box_until(m, t_ps, tape)
            pass_edge(m, t_ps, tape)
        t_ps = emit(e, crossing_ps, e.step_sign)
        run_box_until(m, t_ps, tape)
        m.due += m.corrections
        while m.due >= m.edges:
            m.due -= m.edges
            injector_request(m.injector, t_ps, m.injector.requested + m.sign)
        pass_edge(m, t_ps, tape)


@kernel
def finish(m: Record, settle_ps: int, tape: Any) -> int:
    """Stop: end what is under way, but begin nothing at rest; return the time at which all is settled."""
    e, s = m.encoder, m.injector
    while e.glitch_next_ps < e.last_ps + s.rest_ps:
        t_ps = max(glitch_toggle(e), e.last_ps + 1)
        e.last_ps = t_ps
        run_box_until(m, t_ps, tape)
        pass_edge(m, t_ps, tape)
    end_ps = e.last_ps
    while s.next_ps < e.last_ps + s.rest_ps:
        end_ps = s.next_ps
        run_box_until(m, end_ps, tape)
        if observe(s):
            receiver_edge(m.receiver, end_ps, s.ab_out)
            keep(tape, 1, end_ps, s.ab_out)
    end_ps += settle_ps
    receiver_settle(m.receiver, end_ps)
    return end_ps
