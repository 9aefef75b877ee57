"""Compiled look at an axis at rest: for how long nothing can change, and what box and PC repeat meanwhile."""

from __future__ import annotations

from typing import Any

from rtec._jit import Record, helper, step
from rtec.heat._heat_kernels import bends_ps
from rtec.link._kernels import SLOTS
from rtec.machine._box_kernels import box_idle, box_turn
from rtec.machine._laser_kernels import near_target
from rtec.requester._box_kernels import RUNNING, box_tick
from rtec.requester._box_node_kernels import WORD_RIGHT
from rtec.requester._pc_kernels import ACTIVE, schedule_reading
from rtec.signal._kernels import NEVER


@step
def box_rests(m: Record, box: Any) -> bool:
    """Return whether box and PC do nothing but repeat themselves, at least up to the PC's next turn."""
    if not box_idle(m, box):
        return False
    if m.correcting == 0:
        return True
    n = m.node
    if m.powered == 0 or n.box.state != RUNNING or n.word_fault != WORD_RIGHT:
        return False
    if m.pc.probing == 1 or n.box.probing == 1 or m.pc.status != n.box.status:
        return False
    s = m.injector
    settled = m.pc.state == ACTIVE and m.pc.sent == m.node.box.accepted and m.node.box.accepted == s.requested
    goal = min(max(m.pc.target, -m.pc.word_limit), m.pc.word_limit)
    reported = m.pc.position == m.box_count - m.node.box.zero and m.pc.completed == s.completed
    return bool(settled and goal == m.pc.sent and reported and (m.restless == 0 or box is None))


@step
def ticks_at_rest(m: Record, box: Any, laser: Any, command: Any, until_ps: int, error: Any, heat: Any) -> int:
    """Return for how many ticks from now on nothing can change; at least 1."""
    targets_mm, begins_ps, ends_ps, _ = laser
    start_ps, duration_ps, motion = command
    servo, r = m.servo, m.reader
    i = servo.segment
    if m.skipping == 0 or servo.rigid == 0 or servo.dither != 0.0:
        return 1
    if motion[1, i] != 0.0 or motion[2, i] != 0.0 or motion[3, i] != 0.0:
        return 1
    if not box_rests(m, box) or m.encoder.glitch_next_ps != NEVER or m.receiver.raw != m.receiver.accepted:
        return 1
    # one period of margin: what is due at a boundary is computed tick by tick
    bound_ps = min(min(start_ps[i] + duration_ps[i], until_ps), m.fault_ps)
    if m.restless == 1 and m.correcting == 1:
        bound_ps = min(bound_ps, m.pc.next_ps)
    if r.next < begins_ps.size:
        if servo.now_ps < begins_ps[r.next]:
            bound_ps = min(bound_ps, begins_ps[r.next])
        elif r.begun_ps == NEVER and near_target(m, targets_mm, error, heat):
            return 1  # the laser's timer starts now
        else:
            bound_ps = min(bound_ps, ends_ps[r.next])
            if r.begun_ps < NEVER:
                half_ps = r.begun_ps + r.half_ps
                bound_ps = min(bound_ps, half_ps if servo.now_ps < half_ps else r.begun_ps + r.full_ps)
                bound_ps = min(bound_ps, max(bends_ps(heat, servo.now_ps), servo.now_ps + servo.period_ps))
    return max((bound_ps - servo.now_ps) // servo.period_ps, 1)


@helper
def carry_to(m: Record, box: Any, t_ps: int) -> None:
    """Let box and PC repeat themselves before ``t_ps``: the words stand, only when they come has to be known."""
    if m.correcting == 0:
        return
    b, pc = m.node.box, m.pc
    while pc.next_ps < t_ps:
        look_ps = pc.next_ps
        since_ps = (look_ps - b.next_ps - m.node.up.latency_ps) % b.period_ps  # the last words have arrived
        if schedule_reading(pc, look_ps, since_ps >= pc.valid_after_ps):
            pc.requests += 1
    if box_turn(m, box) < t_ps:
        turns = (t_ps - b.next_ps + b.period_ps - 1) // b.period_ps - SLOTS
        if turns > 0:
            b.next_ps += turns * b.period_ps
            b.readings += turns
        while b.next_ps < t_ps:
            box_tick(b, m.node.down, m.node.up, b.next_ps, m.box_count, m.injector.completed)
