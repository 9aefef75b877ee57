"""Compiled monitor of a machine with faults: what the controller counts, against what it should, slice by slice.

The reference is independent of box, link and PC: the true count of the encoder, before its cable, and the deviation
that the healthy prediction has where the axis truly is, in the direction in which it truly moves. The monitor reads
the totals of the box only to tell what is late from what is wrong.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, kernel, step
from rtec.machine._cell_kernels import run
from rtec.machine._line_kernels import NO_ALARM
from rtec.machine._station_kernels import is_held
from rtec.predictors._kernels import error_at
from rtec.requester._box_kernels import FATAL, RUNNING
from rtec.signal._kernels import NEVER

NOBODY, BY_CONTROLLER, BY_BOX, BY_PC, BY_HOMING = 0, 1, 2, 3, 4
"""Who stopped the machine; by homing: a box without a home does not let the axis go on."""

MONITOR = np.dtype(
    [
        # parameters
        ("step_counts", np.int64),
        ("count_mm", np.float64),
        ("reversal_counts", np.float64),  # hysteresis of the direction
        ("bound", np.float64),  # counts that rounding to steps may leave
        ("lag", np.float64),  # counts that a correction may lag behind, per count/s of the axis
        ("rest_ps", np.int64),  # standing still for so long, the axis is at rest and everything is settled
        ("frozen", np.int64),  # 1: probing, the total stays what it is
        # state
        ("direction", np.int64),
        ("extreme", np.int64),
        ("count", np.int64),
        ("still_ps", np.int64),  # since when the count stands
        ("ran", np.int64),  # 1: the box has been running since its start
        ("frozen_counts", np.float64),
        ("wrong_since_ps", np.int64),
        ("settled", np.int64),  # 1: at rest, not stopped, everything checked
        # observations
        ("error", np.float64),  # counts at the controller, less the true count and the deviation
        ("worst", np.float64),  # largest until the machine stopped
        ("late_slices", np.int64),  # looks beyond the bound until then
        ("wrong_ps", np.int64),  # longest time in which the counts were wrong and nobody said so
        ("wrong", np.float64),  # by how much, at most
        ("checks", np.int64),  # slices in which an axis at rest was found right
        ("stop_ps", np.int64),
        ("stopped_by", np.int64),
        ("stop_error", np.float64),  # error when it stopped
        ("stop_ahead", np.int64),  # counts by which the controller was ahead of the encoder then
        ("seen_reason", np.int64),  # why the PC held, and what the box said, when the first axis stopped
        ("seen_status", np.int64),
        ("following", np.float64),  # largest difference between command and counts, beyond the lag of the feed
    ],
    align=True,
)


@step
def stopper(st: Record) -> int:
    """Return who stops the axis, the most direct cause first."""
    if st.alarm != NO_ALARM:
        return BY_CONTROLLER
    if st.powered == 0 or st.node.box.state == FATAL:
        return BY_BOX
    return BY_PC


@step
def follow(a: Record, count: int) -> None:
    """Follow the direction of the true motion."""
    back = (a.extreme - count) * a.direction
    if back <= 0:
        a.extreme = count
    elif back > a.reversal_counts:
        a.direction = -a.direction
        a.extreme = count


@step
def is_off(a: Record, st: Record, wanted: float, speed: float) -> float:
    """Return by how many counts the axis is off beyond what rounding, lag and what is still owed explain; 0: right.

    What is owed, and said to be owed, is late: the controller must have exactly the encoder's counts and the steps
    that the box says are completed, and the total that the box has accepted must be the one to be wanted here.
    """
    s = st.injector
    ahead = st.receiver.count - st.encoder.count
    lag = a.lag * abs(speed)
    counted = abs(ahead - a.step_counts * s.completed)
    if a.settled == 0:
        counted -= a.step_counts + 2.0  # an insertion or a filtered edge may be under way
    asked = abs(a.step_counts * st.node.box.accepted - wanted) - a.bound - lag
    return float(max(max(counted, asked), 0.0))


@step
def note_stop(a: Record, st: Record, t_ps: int, ahead: int) -> None:
    """Note that the axis is stopped, and the first time by whom and how far off."""
    a.wrong_since_ps = NEVER
    if a.stop_ps == NEVER:
        a.stop_ps = t_ps
        a.stopped_by = stopper(st) if is_held(st) else BY_HOMING
        a.stop_error = a.error
        a.stop_ahead = ahead


@step
def note_off(a: Record, t_ps: int, off: float) -> None:
    """Note by how much the axis is off at ``t_ps``, and since when."""
    if off <= 1e-6:
        a.wrong_since_ps = NEVER
        a.checks += a.settled
        return
    if a.wrong_since_ps == NEVER:
        a.wrong_since_ps = t_ps
    if t_ps - a.wrong_since_ps > a.wrong_ps:
        a.wrong_ps = t_ps - a.wrong_since_ps
        a.wrong = off


@step
def look(a: Record, st: Record, t_ps: int, deviation_mm: float) -> None:
    """Take a look at an axis at ``t_ps``; ``deviation_mm`` is that of its true position."""
    count = st.encoder.count
    ahead = st.receiver.count - count
    speed = st.servo.v
    running = st.node.box.state == RUNNING and st.powered != 0  # one that hangs holds nothing
    if running:
        a.ran = 1
    stopped = is_held(st) or (a.ran == 1 and not running)
    if a.frozen == 1:
        wanted = a.frozen_counts
    else:
        wanted = deviation_mm / a.count_mm
        a.frozen_counts = float(a.step_counts * st.node.box.accepted)
    if count != a.count:
        a.count = count
        a.still_ps = t_ps
    a.settled = 1 if running and not stopped and t_ps - a.still_ps >= a.rest_ps else 0
    if a.ran == 0:
        return
    a.error = ahead - wanted
    if stopped:
        note_stop(a, st, t_ps, ahead)
        return
    if a.stop_ps != NEVER:
        return
    a.worst = max(a.worst, abs(a.error))
    if abs(a.error) > a.bound + 1.0 + a.lag * abs(speed):
        a.late_slices += 1
    behind = st.servo.command - st.receiver.count - st.lag
    a.following = max(a.following, abs(behind))
    note_off(a, t_ps, is_off(a, st, wanted, speed))


@kernel
def begin(a: NDArray[np.void]) -> None:
    """Begin to monitor axes that stand at home."""
    for i in range(a.size):
        a[i].direction = 1
        a[i].wrong_since_ps = NEVER
        a[i].stop_ps = NEVER


@kernel
def monitor(
    c: Record,
    axes: Any,
    boxes: Any,
    steps: Any,
    pcs: NDArray[np.void],
    faults: NDArray[np.void],
    monitors: NDArray[np.void],
    until_ps: int,
    slice_ps: int,
    stop_after_ps: int,
    models: Any,
    truth: Any,
) -> int:
    """Run the machine to ``until_ps`` and look at every axis each ``slice_ps``; return the time reached.

    It ends early where an axis has been stopped for ``stop_after_ps``. ``models`` are what the PC predicts by,
    ``truth`` what it should.
    """
    stations = axes[0]
    while c.now_ps < until_ps:
        t_ps = min(c.now_ps + slice_ps, until_ps)
        run(c, axes, boxes, steps, pcs, faults, t_ps, models)
        for i in range(stations.size):
            a = monitors[i]
            follow(a, stations[i].encoder.count)
            x_mm = stations[i].encoder.count * a.count_mm
            look(a, stations[i], t_ps, error_at(truth, x_mm, a.direction))
        first_ps = monitors[0].stop_ps
        for i in range(1, stations.size):
            first_ps = min(first_ps, monitors[i].stop_ps)
        if first_ps == t_ps:
            for i in range(stations.size):
                monitors[i].seen_reason = pcs[i].reason
                monitors[i].seen_status = stations[i].node.box.status
        if t_ps - first_ps >= stop_after_ps:
            return int(t_ps)
    return until_ps
