"""The emulated axis at work: a course becomes a program, the closed loop runs it, the laser reads where the axis is.

The hidden error lies between the encoder and the slide. The loop closes on the encoder, so what is hidden there does
not change how the encoder moves: the true position is the encoder's, plus the static error within its play (both
inside the closed loop), plus what changes slowly (added to the readings afterwards, see `rtec.blind.slow_errors`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtec import axis
from rtec.axis import Encoder, Limits, Program, Servo
from rtec.blind.plan import Course, Floats
from rtec.machine import TRACE_COLUMNS, Laser, LoopResult, Machine, MeasuringRun, readings_of, run_machine
from rtec.predictors import Predictor
from rtec.units import PS_PER_S

COUNT_MM = 0.001
"""Of the encoder."""
SERVO = Servo(gain_per_s=25.0, lag_s=0.0106)
"""Just damped enough not to overshoot, which would turn the slide over within its play; switched off half a count
before its target, the axis coasts to the middle of the count."""
LIMITS = Limits(max_speed_mm_s=100.0, max_acceleration_mm_s2=500.0, rapid_mm_s=100.0)
LASER_WINDOW_MM = 0.2
LASER_SHARE = 2.0 / 3.0
"""Of the dwell at a target, that the laser system takes for a reading."""
TRACE_EVERY = 10
"""Servo ticks between two rows of the traced path."""
_EXERCISE_SHARE = 0.4
"""Of the axis's way, that it goes before the first run: else its first pass would follow no reversal."""
_HOME_S, _LAST_S = 0.5, 1.0
_TIME_S = TRACE_COLUMNS.index("time_s")
_ENCODER_MM = TRACE_COLUMNS.index("encoder_mm")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pass:
    """What came out of a measurement."""

    deviation_mm: Floats
    """True position less target as the laser averaged it, without noise and slow errors, shape (n,)."""
    time_s: Floats
    """In the middle of the laser's average, since that of the first reading, shape (n,): there the record begins, and
    with it whatever is slow."""
    path_s: Floats
    path_mm: Floats
    """Position of the encoder over the same time, as far as it moved; empty where none was asked for."""


def measure(course: Course, error: Predictor, *, shift_mm: Floats | None = None, trace: bool = False) -> Pass:
    """Let the axis carry the course out and read it.

    Parameters
    ----------
    course
        What is measured.
    error
        True static error of the axis with its play.
    shift_mm
        By how much the controller is misled at each reading, shape (n,): one that has lost counts sends the axis to
        a place that many counts further on, from the move on in which they went lost.
    trace
        Keep the encoder's path.

    Raises
    ------
    ArgumentError
        An error that no play can have, a reading that could not be taken.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS, draw_course
    >>> from rtec.predictors import NoError
    >>> course = draw_course(PLANS["turned_once"], np.random.default_rng(0))
    >>> bool(np.abs(measure(course, NoError()).deviation_mm).max() < 0.0001)
    True
    """
    shift = np.zeros(course.target_mm.size) if shift_mm is None else shift_mm
    task = schedule(course, shift)
    laser = Laser(window_mm=LASER_WINDOW_MM, dwell_s=course.plan.dwell_s * LASER_SHARE)
    machine = Machine(axis_error=error, encoder=Encoder(count_mm=COUNT_MM), servo=SERVO, laser=laser)
    result = run_machine(machine, task, trace_every=TRACE_EVERY if trace else 0)
    deviation_mm = readings_of(task, result.deviation_mm).deviation_mm
    path_s, path_mm = _path(result)
    # the timer starts as the axis comes within the window, a little before it is commanded to stand
    middle_s = task.begins_ps / PS_PER_S + 0.75 * laser.dwell_s
    time_s = np.round(middle_s - middle_s[0], 2)
    return Pass(deviation_mm=deviation_mm, time_s=time_s, path_s=path_s - middle_s[0], path_mm=path_mm)


def _path(result: LoopResult) -> tuple[Floats, Floats]:
    if result.trace is None:
        return np.empty(0), np.empty(0)
    return result.trace[:, _TIME_S].copy(), result.trace[:, _ENCODER_MM].copy()


def schedule(course: Course, shift_mm: Floats) -> MeasuringRun:
    """Return the motion of a course and when each reading is taken.

    Before the first run the axis is moved there and back. Before the first target of each pass it goes beyond that
    and rests, so that it is approached in the direction of the pass.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS, draw_course
    >>> course = draw_course(PLANS["base"], np.random.default_rng(0))
    >>> schedule(course, np.zeros(210)).begins_ps.size
    210
    """
    plan = course.plan
    blocks: list[axis.Block] = [axis.Dwell(seconds=_HOME_S)]
    exercise_mm = plan.start_mm + _EXERCISE_SHARE * plan.span_mm
    blocks.append(axis.Move(target_mm=exercise_mm, feed_mm_s=float(course.feed_mm_s[0])))
    own = np.empty(course.target_mm.size, dtype=np.int64)
    starts = np.diff(course.passes, prepend=-1) > 0
    for i, (target, way) in enumerate(zip(course.target_mm + shift_mm, course.direction, strict=True)):
        feed = float(course.feed_mm_s[i])
        if starts[i]:
            before = float(target - way * plan.overshoot_mm)
            blocks.append(axis.Move(target_mm=before, feed_mm_s=feed))
            blocks.append(axis.Dwell(seconds=float(course.turn_dwell_s[i])))
        blocks.append(axis.Move(target_mm=float(target), feed_mm_s=feed))
        blocks.append(axis.Dwell(seconds=plan.dwell_s))
        own[i] = len(blocks) - 1
    blocks.append(axis.Dwell(seconds=_LAST_S))
    motion = axis.plan(Program(blocks=tuple(blocks)), LIMITS)
    return MeasuringRun(
        motion=motion,
        target_mm=course.target_mm,
        direction=course.direction,
        run=course.run,
        begins_ps=motion.block_end_ps[own - 1],
        ends_ps=motion.block_end_ps[own],
    )
