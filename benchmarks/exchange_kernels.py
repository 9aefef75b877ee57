"""Compiled handshakes without a machine: a given number of exchanges, each of one step more or less.

The box stands at home and inserts at once. Everything else is the whole way of a request: packed, sealed, sent,
checked, judged, answered by status, corrections and position, and checked again.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record
from rtec.link._bus_kernels import bus_next, bus_reset, bus_step, bus_submit
from rtec.link._frame_kernels import AXIS_BITS, HOLD, REQUEST
from rtec.requester._box_kernels import box_tick
from rtec.requester._box_node_kernels import box_receive, box_start
from rtec.requester._box_turn_kernels import box_check_watchdog, box_sample, box_say
from rtec.requester._pc_kernels import pc_read, pc_request, pc_start
from rtec.requester._pc_node_kernels import pc_node_start, pc_receive
from rtec.requester._pc_turn_kernels import pc_finish, pc_prepare

PC_PLACE, BOX_PLACE = 0, 1


@numba.njit(error_model="numpy", nogil=True)
def start(bus: Record, box: Record, pc: Record, bit_ps: int, first_ps: int) -> None:
    """Switch all on; the box's first reading is at ``first_ps``, the PC's first turn at zero."""
    bus_reset(bus, bit_ps)
    box_start(box, 0, 1)
    box.box.framed = 1
    box.box.next_ps = first_ps
    box.cycle_next_ps = first_ps
    pc_node_start(pc, 0, 0)


@numba.njit(error_model="numpy", nogil=True)
def exchange_frames(
    bus: Record,
    faults: NDArray[np.void],
    box: Record,
    pc: Record,
    exchanges: int,
    turn: int,
    until_ps: int,
) -> int:
    """Let PC and box make a number of exchanges, up to ``until_ps`` at most; return the time of the last.

    The total that the PC wants goes up and down between 0 and ``turn``, by one step for every exchange.
    """
    completed = 0
    t_ps = 0
    while pc.answered < exchanges:
        bus_ps = bus_next(bus)
        t_ps = min(bus_ps, min(box.box.next_ps, pc.pc.next_ps))
        if t_ps >= until_ps:
            break
        if bus_ps == t_ps:
            if bus_step(bus, faults):
                if bus.identifier == HOLD or bus.identifier & ~AXIS_BITS == REQUEST:
                    box_receive(box, t_ps, bus.identifier, bus.payload)
                else:
                    pc_receive(pc, t_ps, bus.identifier, bus.payload)
        elif box.box.next_ps == t_ps:
            box_check_watchdog(box, t_ps, 0, False)
            box_sample(box, t_ps, 0, completed)
            box_say(box, t_ps, 0, completed, 0)
            completed = box.box.accepted
            out = box.out
            for k in range(out.waiting):
                bus_submit(bus, faults, BOX_PLACE, t_ps, out.identifier[k], out.payload[k])
            out.waiting = 0
        else:
            if pc_prepare(pc, t_ps):
                phase = (pc.answered + 1) % (2 * turn)
                wanted = phase if phase <= turn else 2 * turn - phase
                pc_finish(pc, t_ps, wanted * pc.pc.step_mm)
            out = pc.out
            for k in range(out.waiting):
                bus_submit(bus, faults, PC_PLACE, t_ps, out.identifier[k], out.payload[k])
            out.waiting = 0
    return t_ps


@numba.njit(error_model="numpy", nogil=True)
def exchange(m: Record, exchanges: int, turn: int) -> int:
    """Let PC and box exchange requests, each at its own period; return the steps accepted, of either sign.

    The axis goes back and forth: with each exchange the deviation grows by one step of the box, ``turn`` times, then
    shrinks as often, and so on. An exchange is a reading of valid words by the PC, its next request, and the box's
    samples up to the PC's next reading; what the box accepts counts as inserted at once. The last request is sampled,
    too.
    """
    made = 0
    place = 0
    steps = 0
    completed = 0
    while made < exchanges or m.node.down.waiting > 0:
        if made == exchanges or m.node.box.next_ps <= m.pc.next_ps:
            total = box_tick(m.node.box, m.node.down, m.node.up, m.node.box.next_ps, place * 100, completed)
            steps += abs(total - completed)
            completed = total
        else:
            t_ps = m.pc.next_ps
            pc_start(m.pc, m.node.down, t_ps)
            if pc_read(m.pc, m.node.up, t_ps):
                made += 1
                phase = made % (2 * turn)
                place = min(phase, 2 * turn - phase)
                pc_request(m.pc, m.node.down, t_ps, place * m.pc.step_mm)
    return steps
