"""Compiled machine on a bus: several axes with their boxes, one PC, the bus between them, and every fault.

Events are taken in the order of their times: deliveries of the bus, faults, readings of the boxes, turns of the PC.
The stations run on their own between their readings. A fault beyond the bus has its place at an axis or at the PC;
one of the bus affects frames on their way.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, kernel, step
from rtec.heat._heat_kernels import read_heat
from rtec.link._bus_kernels import BUS, LAST_OF_BUS, bus_next, bus_reset, bus_step, bus_submit, fire, is_off
from rtec.link._frame_kernels import AXIS_BITS, EXPECTED, HOLD, REQUEST
from rtec.machine._fault_kernels import (
    CLOCK_JUMP_FORWARD,
    PC_KILLED,
    PC_PLACE,
    comes_due,
    next_of_faults,
    note_effects,
)
from rtec.machine._station_kernels import is_held
from rtec.predictors._kernels import AXES, SAID
from rtec.requester._box_kernels import RUNNING
from rtec.requester._box_node_kernels import box_receive
from rtec.requester._pc_kernels import HOLD as HOLDING
from rtec.requester._pc_node_kernels import BUS_OFF, OTHER_AXIS, pc_hold, pc_node_start, pc_receive
from rtec.requester._pc_turn_kernels import pc_predict, pc_prepare
from rtec.signal._kernels import NEVER

CELL = np.dtype(
    [
        ("bus", BUS),
        ("now_ps", np.int64),
        ("pc_runs", np.int64),
        ("pc_offset_ps", np.int64),  # of the PC's clock
        # observations
        ("turns", np.int64),
        ("readings", np.int64),
        ("late_steps", np.int64, (16,)),  # largest difference between what is wanted and what is inserted, by axis
        ("held_at_once_ps", np.int64),  # when the first axis was held
    ],
    align=True,
)


@step
def begin_at_pc(c: Record, f: Record, t_ps: int) -> None:
    """Let a fault of the PC begin."""
    if f.kind == PC_KILLED:
        c.pc_runs = 0
    elif f.kind == CLOCK_JUMP_FORWARD:
        c.pc_offset_ps += f.delay_ps
    else:
        c.pc_offset_ps -= f.delay_ps
    fire(f, t_ps)


@step
def deliver_frame(
    c: Record, stations: NDArray[np.void], pcs: NDArray[np.void], faults: NDArray[np.void], t_ps: int
) -> None:
    """Deliver the frame that has just left the bus to every other node."""
    bus = c.bus
    axis = bus.identifier & AXIS_BITS
    if is_off(faults, bus.node, t_ps):
        return
    if bus.identifier == HOLD or bus.identifier & ~AXIS_BITS in (EXPECTED, REQUEST):
        for i in range(stations.size):
            reached = bus.identifier == HOLD or axis == i + 1
            if reached and stations[i].powered == 1 and not is_off(faults, i + 1, t_ps):
                box_receive(stations[i].node, t_ps, bus.identifier, bus.payload)
    elif 1 <= axis <= pcs.size and bus.node != PC_PLACE and c.pc_runs == 1 and not is_off(faults, PC_PLACE, t_ps):
        pc_receive(pcs[axis - 1], t_ps + c.pc_offset_ps, bus.identifier, bus.payload)


@step
def turn_pc(
    c: Record,
    stations: NDArray[np.void],
    pcs: NDArray[np.void],
    faults: NDArray[np.void],
    i: int,
    t_ps: int,
    models: Any,
) -> None:
    """Let the PC take its turn for axis ``i + 1``, by the model of that axis and what its thermometers say."""
    n = pcs[i]
    pc_ps = t_ps + c.pc_offset_ps
    if is_off(faults, PC_PLACE, t_ps):
        pc_hold(n, pc_ps, BUS_OFF)
    if pc_prepare(n, pc_ps):
        for j in range(pcs.size):
            other = pcs[j]
            known = other.has_position == 1 and other.valid == 1
            n.pc.sensors[AXES + j] = other.pc.home_mm + other.position * other.pc.count_mm if known else math.nan
        model, heat = models[i]
        read_heat(heat, t_ps, model[SAID])
        pc_predict(n, pc_ps, model)
        late = abs(n.pc.target - stations[i].injector.completed)
        c.late_steps[i] = max(c.late_steps[i], late)
    for k in range(n.out.waiting):
        bus_submit(c.bus, faults, PC_PLACE, t_ps, n.out.identifier[k], n.out.payload[k])
    n.out.waiting = 0
    c.turns += 1
    if n.pc.state == HOLDING:
        for j in range(pcs.size):
            pc_hold(pcs[j], pc_ps, OTHER_AXIS)
            stations[j].pc_holds = 1


@step
def turn_box(c: Record, axes: Any, boxes: Any, steps: Any, faults: NDArray[np.void], i: int, t_ps: int) -> None:
    """Run an axis to the reading of its box, and let the box take it."""
    advance, _ = steps
    stations = axes[0]
    st = stations[i]
    advance(axes, boxes, i, t_ps, True)
    out = st.node.out
    for k in range(out.waiting):
        bus_submit(c.bus, faults, i + 1, t_ps, out.identifier[k], out.payload[k])
    out.waiting = 0
    c.readings += 1
    if c.held_at_once_ps == NEVER and is_held(st):
        c.held_at_once_ps = t_ps
        for j in range(stations.size):
            stations[j].pc_holds = 1  # the hold contacts of the boxes are in series


@step
def watch_lines(c: Record, axes: Any, boxes: Any, steps: Any, t_ps: int) -> None:
    """Start axes that follow lines together once all are ready, and stop all as soon as one is not."""
    advance, _ = steps
    stations = axes[0]
    ready = 1
    for i in range(stations.size):
        if is_held(stations[i]) or stations[i].node.box.state != RUNNING:
            ready = 0
    if ready != stations[0].lines_run:
        for i in range(stations.size):
            advance(axes, boxes, i, t_ps, False)
            stations[i].lines_run = ready


@kernel
def start(c: Record, pcs: NDArray[np.void], bit_ps: int, pc_first_ps: int, pc_gap_ps: int) -> None:
    """Switch bus and PC on; the stations are started on their own."""
    bus_reset(c.bus, bit_ps)
    c.pc_runs = 1
    c.held_at_once_ps = NEVER
    for i in range(pcs.size):
        pc_node_start(pcs[i], pc_first_ps + i * pc_gap_ps, 17 * (i + 1))


@kernel
def run(  # noqa: C901 - the order of events in a cell is one table
    c: Record,
    axes: Any,
    boxes: Any,
    steps: Any,
    pcs: NDArray[np.void],
    faults: NDArray[np.void],
    until_ps: int,
    models: Any,
) -> None:
    """Run the cell to ``until_ps``; ``axes``, ``boxes`` and ``steps`` as in `rtec.machine._station_kernels`.

    ``models`` are the PC's model and the course of heat of as many axes as a cell may have, so that it is compiled
    once for all cells.
    """
    advance, change_fault = steps
    stations = axes[0]
    bus = c.bus
    fault_ps = next_of_faults(faults)
    while True:
        bus_ps = bus_next(bus)
        box_ps = NEVER
        due = 0
        for i in range(stations.size):
            if stations[i].node.box.next_ps < box_ps:
                box_ps = stations[i].node.box.next_ps
                due = i
        pc_ps = NEVER
        pc = 0
        if c.pc_runs == 1:
            for i in range(pcs.size):
                due_ps = pcs[i].pc.next_ps - c.pc_offset_ps
                if due_ps < pc_ps:
                    pc_ps = max(due_ps, c.now_ps)
                    pc = i
        t_ps = min(min(bus_ps, fault_ps), min(box_ps, pc_ps))
        if t_ps >= until_ps:
            c.now_ps = until_ps
            break
        c.now_ps = t_ps
        if bus_ps == t_ps:
            if bus_step(bus, faults):
                deliver_frame(c, stations, pcs, faults, t_ps)
        elif fault_ps == t_ps:
            for begins in (False, True):  # first the ends, so that one may follow the other
                for i in range(faults.size):
                    f = faults[i]
                    if f.kind <= LAST_OF_BUS or not comes_due(f, t_ps, begins):
                        continue
                    if f.place > PC_PLACE:
                        advance(axes, boxes, f.place - 1, t_ps, False)
                        change_fault(axes, boxes, f.place - 1, f, t_ps, begins)
                    elif begins:
                        begin_at_pc(c, f, t_ps)
            fault_ps = next_of_faults(faults)
        elif box_ps == t_ps:
            turn_box(c, axes, boxes, steps, faults, due, t_ps)
        else:
            turn_pc(c, stations, pcs, faults, pc, t_ps, models)
        if stations[0].line_acceleration > 0.0:
            watch_lines(c, axes, boxes, steps, t_ps)
    for i in range(stations.size):
        advance(axes, boxes, i, until_ps, False)
    for i in range(faults.size):
        f = faults[i]
        if f.kind > LAST_OF_BUS and f.place > PC_PLACE and f.kept == 1 and f.ended == 0:
            note_effects(stations[f.place - 1], f, until_ps)
