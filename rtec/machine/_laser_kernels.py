"""Compiled true position of the axis, behind its play and its thermal growth, and the laser system that reads it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, step
from rtec.heat._heat_kernels import grown_mm
from rtec.predictors._kernels import error_at
from rtec.signal._kernels import NEVER

PLAY = np.dtype(
    [
        ("y_mm", np.float64),  # true position without heat
    ],
    align=True,
)

READER = np.dtype(
    [
        ("window_mm", np.float64),  # the laser's timer starts once the axis is so close to the target
        ("half_ps", np.int64),  # its reading begins here
        ("full_ps", np.int64),  # and ends here
        ("next", np.int64),
        ("begun_ps", np.int64),
        ("first_mm", np.float64),  # of what it sees; the sum is of what differs from it, so that rest adds nothing
        ("sum_mm", np.float64),
        ("weight", np.int64),
    ],
    align=True,
)


@step
def true_mm(m: Record, t_ps: int, heat: Any) -> float:
    """Return where the slide stands at ``t_ps``, behind play, heat and what gives way beyond the encoder."""
    return float(m.play.y_mm + grown_mm(heat, t_ps, m.servo.x * m.servo.count_mm) + m.servo.beyond_mm)


@step
def follow_play(m: Record, error: Any) -> None:
    """Let the true position follow the encoder's within the play between the forward and the reverse curve."""
    x_mm = m.servo.x * m.servo.count_mm
    low = x_mm + error_at(error, x_mm, 1)
    high = x_mm + error_at(error, x_mm, -1)
    m.play.y_mm = min(max(m.play.y_mm, low), high)


@step
def near_target(m: Record, targets_mm: NDArray[np.float64], error: Any, heat: Any) -> bool:
    """Return whether the axis is within the laser's window about the next target.

    By the controller's position, which arrives whatever the error, or by the true one, where a table of the
    controller's own leads it elsewhere.
    """
    target_mm = targets_mm[m.reader.next]
    if abs(m.receiver.count * m.servo.counts_per_unit * m.servo.count_mm - target_mm) <= m.reader.window_mm:
        return True
    if abs(m.servo.command * m.servo.count_mm - target_mm) > m.reader.window_mm:
        return False
    follow_play(m, error)
    return abs(true_mm(m, m.servo.now_ps, heat) - target_mm) <= m.reader.window_mm


@step
def read_laser(m: Record, ticks: int, laser: Any, error: Any, heat: Any) -> None:
    """Let the laser system look at the axis for ``ticks`` servo ticks from now on, during which nothing moves.

    Heat that goes on a straight line meanwhile is seen as in their middle.
    """
    targets_mm, begins_ps, ends_ps, readings_mm = laser
    r = m.reader
    t_ps = m.servo.now_ps
    if r.next >= targets_mm.size or t_ps < begins_ps[r.next]:
        return
    if r.begun_ps == NEVER and near_target(m, targets_mm, error, heat):
        r.begun_ps = t_ps
    if r.begun_ps < NEVER and t_ps >= r.begun_ps + r.half_ps and t_ps < r.begun_ps + r.full_ps:
        follow_play(m, error)
        seen_mm = true_mm(m, t_ps + (ticks - 1) * m.servo.period_ps // 2, heat)
        if r.weight == 0:
            r.first_mm = seen_mm
        r.sum_mm += (seen_mm - r.first_mm) * ticks
        r.weight += ticks
    if t_ps >= ends_ps[r.next] or (r.begun_ps < NEVER and t_ps >= r.begun_ps + r.full_ps):
        readings_mm[r.next] = r.first_mm + r.sum_mm / r.weight if r.weight > 0 else np.nan
        r.next += 1
        r.begun_ps = NEVER
        r.sum_mm = 0.0
        r.weight = 0
