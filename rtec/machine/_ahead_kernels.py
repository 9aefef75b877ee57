"""The open signal path at constant speed, with its edges computed ahead.

It is compiled apart from the loop of `rtec.machine._open_kernels`, which computes each edge when it is due.
"""

from __future__ import annotations

import numpy as np

from rtec._jit import Record, array_kernel, step
from rtec.axis._ahead_kernels import AHEAD, edge_block, shift_lines
from rtec.injector._insertion_kernels import cancel
from rtec.injector._kernels import injector_edge
from rtec.injector._state_kernels import ARMED
from rtec.machine._open_kernels import ask, run_box_until, see_gates
from rtec.machine._quiet_kernels import edge_ps, insert_quietly, passes_on, passthrough_block
from rtec.signal._kernels import level_of_state


@step
def quiet_until(m: Record, t_ps: int, i: int, n: int, state: int, closest_ps: int) -> int:
    """Return up to which of ``n`` edges from ``i`` on the box only passes them on and nothing is asked for.

    ``state`` is the encoder's before edge number 0, ``closest_ps`` the least time between two edges.
    """
    s, sign = m.injector, m.encoder.step_sign
    until = n
    if s.requested != s.completed:  # it waits for both lines low, or is about to insert
        until = min(n, i + (-sign * (state + sign * (i + 1)) & 3)) if s.one_state == 1 else i
    if s.in_path == 1:  # the writing of an edge comes before the next edge
        until = min(until, n - 1) if closest_ps > s.latency_ps else i
    if until <= i or not passes_on(s, t_ps):
        return i
    return min(until, i + 1 + (m.edges - 1 - m.due) // m.corrections) if m.corrections > 0 else until


@array_kernel
def run_ahead(m: Record, edges: int) -> None:
    """Move over the next ``edges`` lines at constant speed, with an encoder that `crosses_evenly`."""
    e, s, sign = m.encoder, m.injector, m.encoder.step_sign
    times_ps = np.empty(AHEAD, np.int64)
    shifts_ps = np.empty(AHEAD, np.int64)
    shift_lines(e, shifts_ps)
    left = edges
    while left > 0:
        state = e.count + e.home
        n = min(left, AHEAD)
        closest_ps = edge_block(e, n, shifts_ps, times_ps)
        i = int(np.int64(0))  # for a literal 0 the compiler would make all that is called with it once more
        while i < n:
            t_ps = edge_ps(times_ps, i)
            if s.next_ps < t_ps:
                insert_quietly(m, t_ps)
            run_box_until(m, None, t_ps, None)
            m.due += m.corrections
            while m.due >= m.edges:
                m.due -= m.edges
                ask(m, None, t_ps)
            if s.phase == ARMED and s.in_path == 0 and t_ps <= s.recognised_ps:
                cancel(s)  # as it would with the edge: the axis moves
            until = quiet_until(m, t_ps, i, n, state, closest_ps)
            if until > i:
                passthrough_block(m, times_ps, i, until, state, closest_ps)
                m.due += (until - 1 - i) * m.corrections
                i = until
            else:
                i += 1
                injector_edge(s, t_ps, level_of_state((state + sign * i) & 3))
                see_gates(m, s, t_ps)
        left -= n
