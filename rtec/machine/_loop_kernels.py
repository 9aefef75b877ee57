"""The closed loop in one compiled function: program, servo, axis, encoder, box, PC and receiver.

Time advances from one servo tick to the next (`rtec.machine._axis_kernels`), within a tick from one turn of box or PC
to the next. An axis at rest, with nothing left to do for box and PC, is carried to the next time at which anything
can change.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper, kernel, step
from rtec.heat._heat_kernels import read_heat
from rtec.link._bus_kernels import fire
from rtec.link._kernels import deliver, mailbox_reset
from rtec.machine._axis_kernels import open_tick, run_tick, settle_lines
from rtec.machine._box_kernels import box_skips, box_turn, box_valid, instruct
from rtec.machine._fault_kernels import PC_KILLED, PC_PROBING, comes_due, next_of_faults, note_effects
from rtec.machine._laser_kernels import PLAY, READER, follow_play, read_laser, true_mm
from rtec.machine._line_kernels import AXIS, fault_at_axis, stand_at_home
from rtec.machine._rest_kernels import box_rests, carry_to, ticks_at_rest
from rtec.machine._servo_kernels import command_at, servo_tick
from rtec.predictors._kernels import SAID, predicted_mm
from rtec.requester._box_kernels import box_reset, box_tick
from rtec.requester._box_turn_kernels import word_of
from rtec.requester._pc_kernels import (
    HOLD,
    PC,
    fall_back,
    pc_read,
    pc_request,
    pc_reset,
    pc_start,
    schedule_reading,
    sense,
)
from rtec.signal._kernels import NEVER
from rtec.units._time_kernels import PS_PER_S

RUNNING, FINISHED, HELD, FAULTED = 0, 1, 2, 3

MACHINE = np.dtype(
    [
        *AXIS,
        ("play", PLAY),
        ("reader", READER),
        ("pc", PC),
        ("restless", np.int64),  # 1: the PC's prediction may change while the axis stands
        ("correcting", np.int64),  # 0: no PC and no box, the lines pass
        ("fault_ps", np.int64),  # when a fault next begins or ends
        ("skipping", np.int64),  # 0: every tick is computed, for comparison
        ("status", np.int64),
    ],
    align=True,
)


@step
def box_cycle(m: Record, t_ps: int) -> None:
    """Let the box read the PC's words and pass its request on to the injector."""
    if m.powered == 0:
        m.node.box.next_ps += m.node.box.period_ps
        return
    total = box_tick(m.node.box, m.node.down, m.node.up, t_ps, m.box_count, m.injector.completed)
    instruct(m, t_ps, m.node.box.switch_on == 1 and m.node.box.probing == 0, total)


@step
def pc_cycle(m: Record, box: Any, t_ps: int, model: Any, heat: Any) -> None:
    """Let the PC read the box's words and send its next request."""
    if abs(m.encoder.count) <= 1.0 + m.servo.dither:
        pc_start(m.pc, m.node.down, t_ps)  # an axis that stands elsewhere must not be taken as homed
    if not box_valid(m, box, t_ps):
        schedule_reading(m.pc, t_ps, False)
        return
    deliver(m.node.up, t_ps)
    m.node.up.word0 = word_of(m.node, m.node.up.word0)
    if pc_read(m.pc, m.node.up, t_ps):
        read_heat(heat, t_ps, model[SAID])
        sense(m.pc, t_ps, m.node.up.delivered_ps, 1)
        pc_request(m.pc, m.node.down, t_ps, fall_back(m.pc, model, predicted_mm(model, m.pc.sensors)))


@step
def next_turn(m: Record, box: Any) -> int:
    """Return when box or PC takes its next turn, or a fault begins or ends."""
    if m.correcting == 0:
        return int(m.fault_ps)
    return min(min(box_turn(m, box), m.pc.next_ps), m.fault_ps)


@helper
def change_faults(m: Record, box: Any, faults: NDArray[np.void], t_ps: int) -> None:
    """End and begin the faults that are due at ``t_ps``; ends come first, so that one fault may follow another."""
    for begins in (False, True):
        for i in range(faults.size):
            f = faults[i]
            if not comes_due(f, t_ps, begins):
                continue
            if f.kind == PC_PROBING:
                m.pc.probing = 1 if begins else 0
            elif f.kind != PC_KILLED:
                fault_at_axis(m, box, f, t_ps, begins)
            elif begins:
                m.pc.next_ps = NEVER
                fire(f, t_ps)
    m.fault_ps = next_of_faults(faults)


@step
def take_turn(m: Record, box: Any, t_ps: int, model: Any, heat: Any, faults: NDArray[np.void]) -> None:
    """Let box or PC take the turn that is due at ``t_ps``, or a fault begin or end."""
    m.event_ps = max(t_ps, m.event_ps)
    if m.fault_ps == t_ps:
        change_faults(m, box, faults, t_ps)
    elif box_turn(m, box) == t_ps:
        box_cycle(m, t_ps)
    else:
        pc_cycle(m, box, t_ps, model, heat)


@kernel
def start(m: Record, box_first_ps: int, pc_first_ps: int) -> None:
    """Stand still at home at time 0, everything switched on."""
    stand_at_home(m)
    box_reset(m.node.box, box_first_ps)
    pc_reset(m.pc, pc_first_ps)
    mailbox_reset(m.node.down)
    mailbox_reset(m.node.up)
    m.reader.begun_ps = NEVER
    m.fault_ps = NEVER


@step
def trace_tick(m: Record, trace: Any, error: Any, plant: Any, heat: Any) -> None:
    """Write down how things stand, if this tick is one of those that are kept."""
    servo = m.servo
    rows, every, used = trace
    if used[0] < rows.shape[0] and servo.ticks % every == 0:
        follow_play(m, error)
        row = rows[used[0]]
        row[0] = servo.now_ps / PS_PER_S
        row[1] = servo.command * servo.count_mm
        row[2] = servo.x * servo.count_mm
        row[3] = true_mm(m, servo.now_ps, heat)
        row[4] = m.receiver.count * servo.counts_per_unit * servo.count_mm
        row[5] = m.pc.target
        row[6] = m.injector.completed
        row[7] = m.encoder.count
        for k in range(8, row.size):  # what the plant says of itself
            row[k] = plant[3][0, k - 7]
        used[0] += 1


@step
def pass_ticks(m: Record, box: Any, ticks: int) -> None:
    """Let so many ticks pass at rest."""
    servo = m.servo
    servo.now_ps += ticks * servo.period_ps
    servo.skipped += ticks
    servo.ticks += ticks
    carry_to(m, box, servo.now_ps)


@kernel
def run(
    m: Record, until_ps: int, command: Any, laser: Any, models: Any, trace: Any, box: Any, faults: NDArray[np.void]
) -> None:
    """Run the machine up to ``until_ps``.

    ``command`` is start and duration of each segment, and its motion: x, v, a, j in counts and seconds, shape
    (4, segments); ``laser`` the schedule of readings, as targets, when each begins and ends, and room for them.
    ``models`` are the axis' true curve, the PC's model and the controller's own table, as `rtec.predictors.binding`
    makes them, what the servo moves (`rtec.axis.plant`), and the course of heat (`rtec.heat._heat_kernels`).
    ``trace`` is (array (n, 8 + outputs of the plant), every so many ticks, [rows used]); ``box`` as of
    `rtec.machine._box_kernels`.
    """
    error, model, own, plant, heat = models
    servo = m.servo
    traces = trace[0].shape[0] > 0
    m.fault_ps = next_of_faults(faults)
    while servo.now_ps < until_ps:
        speed = command_at(servo, servo.now_ps, command)
        acceleration = servo_tick(m, speed, own, plant, 0)
        trace_tick(m, trace, error, plant, heat)
        resting = servo.v == 0.0 and acceleration == 0.0
        ticks = ticks_at_rest(m, box, laser, command, until_ps, error, heat) if resting else 1
        if traces and (m.restless == 1 or heat[0].size > 1):
            ticks = min(ticks, trace[1] - servo.ticks % trace[1])
        ticks = box_skips(m, box, resting and box_rests(m, box), ticks)
        read_laser(m, ticks, laser, error, heat)
        if ticks > 1:
            pass_ticks(m, box, ticks)
            continue
        open_tick(m, acceleration, error)
        while m.tick_open == 1:
            turn_ps = next_turn(m, box)
            run_tick(m, box, turn_ps, error)
            if m.tick_open == 1:
                take_turn(m, box, turn_ps, model, heat, faults)
        if m.correcting == 1 and m.pc.state == HOLD:
            m.status = HELD
            return
        if m.receiver.fault == 1 or servo.failed == 1:
            m.status = FAULTED
            return
    m.status = FINISHED


@kernel
def come_to_rest(m: Record, box: Any, faults: NDArray[np.void]) -> None:
    """Bring everything under way to its end, and note what faults have done that last."""
    for i in range(faults.size):
        f = faults[i]
        if f.kept == 1 and f.ended == 0 and f.kind < PC_KILLED:
            note_effects(m, f, m.servo.now_ps)
    settle_lines(m, box)
