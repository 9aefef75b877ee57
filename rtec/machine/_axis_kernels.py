"""Compiled motion of an axis: a servo tick, and within it the events of its lines in the order of their times.

Within a tick the acceleration is constant, so that the lines' crossing times have a closed form. Whoever owns the
handshake of PC and box (the closed loop, a station on a bus) opens a tick, runs it up to the next turn of either,
lets it take the turn, and runs on; the tick closes itself.
"""

from __future__ import annotations

from typing import Any

from rtec._jit import Record, helper, step
from rtec.axis._kernels import emit, glitch_toggle, jitter, next_crossing, set_piece, turning_points
from rtec.controller._kernels import receiver_index, receiver_settle
from rtec.link._bus_kernels import NO_FAULT
from rtec.machine._box_kernels import box_finish, box_output, box_stop
from rtec.machine._laser_kernels import follow_play
from rtec.machine._line_kernels import retake_lines, run_box, take_lines
from rtec.signal._kernels import NEVER
from rtec.units._time_kernels import PS_PER_S


@step
def next_edge(m: Record) -> int:
    """Return when the next line crossing gives its edge, jitter included, and not before the present time."""
    if m.crossing_ps == NEVER:
        return NEVER
    e = m.encoder
    edge_ps = m.crossing_ps + jitter(e.seed, e.serial + 1, e.jitter_ps)
    return max(edge_ps, max(e.last_ps + 1, m.event_ps))


@helper
def pass_glitch(m: Record, box: Any) -> None:
    """Send an edge of a glitch, the next thing that happens on the lines, through the box."""
    e = m.encoder
    t_ps = max(glitch_toggle(e), e.last_ps + 1)
    e.last_ps = t_ps
    m.event_ps = max(t_ps, m.event_ps)
    run_box(m, box, t_ps)
    take_lines(m, box, t_ps)


@step
def run_lines(m: Record, box: Any, until_ps: int, part_end_ps: int) -> bool:
    """Carry out what the lines do up to ``until_ps`` in this part of the tick; return whether the part is over.

    Every line crossed in a part gives its edge, jitter or not, before the part is over.
    """
    e = m.encoder
    edge_ps = next_edge(m)
    while True:
        t_ps = min(edge_ps, e.glitch_next_ps)
        last_ps = until_ps if edge_ps != NEVER else min(until_ps, part_end_ps - 1)
        begun = run_box(m, box, min(t_ps, last_ps))
        if t_ps > last_ps:
            if begun:
                retake_lines(m, box, last_ps)
            else:
                box_output(m, box, last_ps)
            return edge_ps == NEVER and until_ps >= part_end_ps
        m.event_ps = max(t_ps, m.event_ps)
        if edge_ps <= e.glitch_next_ps:
            emit(e, m.crossing_ps, m.piece.sign)
            e.last_ps = edge_ps
            take_lines(m, box, edge_ps)
            if e.index_every > 0 and e.count % e.index_every == 0:
                receiver_index(m.receiver, edge_ps)
            m.crossing_ps = next_crossing(e, m.piece)
        else:
            pass_glitch(m, box)  # the edge comes behind it
        edge_ps = next_edge(m)


@step
def open_part(m: Record, from_s: float, error: Any) -> None:
    """Begin a part of the tick in which the motion does not turn.

    ``error`` is that of the slide, which follows the encoder through its play; None where the slide is not observed.
    """
    servo = m.servo
    m.part_end_s = m.turn_s if from_s < m.turn_s else servo.period_s
    set_piece(m.piece, from_s, m.part_end_s)
    m.crossing_ps = next_crossing(m.encoder, m.piece)
    if error is not None:
        if m.piece.sign != 0 and m.piece.sign != servo.moving:
            follow_play(m, error)  # the axis turns here
            servo.moving = m.piece.sign


@step
def open_tick(m: Record, acceleration: float, error: Any) -> None:
    """Begin a tick of the servo: its acceleration holds until the next."""
    servo, piece = m.servo, m.piece
    piece.start_ps = servo.now_ps
    piece.x0 = servo.x
    piece.v0 = servo.v
    piece.a0 = acceleration
    piece.j0 = 0.0
    m.turn_s, _ = turning_points(servo.v, acceleration, 0.0, servo.period_s)
    m.tick_open = 1
    open_part(m, 0.0, error)


@step
def run_tick(m: Record, box: Any, until_ps: int, error: Any) -> None:
    """Run the open tick up to ``until_ps``; it is closed where it ends before."""
    servo, p = m.servo, m.piece
    while m.tick_open == 1:
        end_s = m.part_end_s
        if not run_lines(m, box, until_ps, servo.now_ps + int(end_s * PS_PER_S + 0.5)):
            return
        servo.x = p.x0 + end_s * (p.v0 + end_s * p.a0 / 2.0)
        if end_s < servo.period_s:
            open_part(m, end_s, error)
        else:
            servo.v += p.a0 * servo.period_s
            servo.now_ps += servo.period_ps
            servo.ticks += 1
            m.travel_mm += abs(servo.v) * servo.period_s * servo.count_mm
            m.tick_open = 0


@helper
def settle_lines(m: Record, box: Any) -> None:
    """Stop the axis where it is, complete the insertion under way, and let the filter see the last edge.

    After that the counts can be audited, also of an axis that dithers, or that was stopped in the middle of a run.
    """
    rx = m.receiver
    m.pending.kind = NO_FAULT
    t_ps = box_stop(m, box, max(m.servo.now_ps, m.event_ps))
    while m.encoder.glitch_next_ps != NEVER:
        pass_glitch(m, box)
    box_finish(m, box, NEVER - 1)
    t_ps = max(t_ps, m.event_ps)
    receiver_settle(rx, max(t_ps, rx.last_ps) + rx.sure_ps + 4 * rx.unseen_ps + 1)
