"""From the measuring program's blocks to a motion and a schedule of laser readings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec import axis, metrology
from rtec.axis import Limits, MotionSegments, ProfileShape, plan
from rtec.checks import number_within
from rtec.errors import ArgumentError
from rtec.units import PS_PER_S

_SAME_MM = 1e-8
HOME_DWELL_S = 0.5
"""At home, before the program: box and PC start up and agree on the home position."""
LAST_DWELL_S = 1.0
"""After the program, until everything has come to rest for the audit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Laser:
    """When the laser system reads (thesis section 2.3.3, Table 2-1).

    Parameters
    ----------
    window_mm
        The dwell timer starts once the axis is so close to the target.
    dwell_s
        Its length; the reading is the mean of its second half.

    Raises
    ------
    ArgumentError
        A value outside its range.
    """

    window_mm: float = 0.254
    dwell_s: float = 4.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        number_within("window_mm", self.window_mm, 1e-6, 1e3, unit="mm")
        number_within("dwell_s", self.dwell_s, 1e-3, 1e4, unit="s")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasuringRun:
    """A motion and the readings taken on it.

    Parameters
    ----------
    motion
        The commanded motion, from home to rest.
    target_mm, direction, run
        Of each reading, shape (n,).
    begins_ps, ends_ps
        Between which the axis is commanded to stand at the target.
    """

    motion: MotionSegments
    target_mm: NDArray[np.float64]
    direction: NDArray[np.int8]
    run: NDArray[np.int64]
    begins_ps: NDArray[np.int64]
    ends_ps: NDArray[np.int64]


def measuring_run(
    plan_: metrology.MeasuringPlan,
    limits: Limits,
    *,
    stop_s: float | None = None,
    shape: ProfileShape = ProfileShape.TRAPEZOIDAL,
) -> MeasuringRun:
    """Let the axis carry out the measuring program of the thesis (Appendix B).

    The program is written and read back as the control would; every dwell at a target that is not an overshoot is a
    reading, and so is the program stop at which the laser is zeroed, which is continued after ``stop_s`` (default:
    the dwell of the plan).

    Raises
    ------
    ArgumentError
        A feed beyond the axis's limits.

    Examples
    --------
    The program that the thesis prints takes 42 readings:

    >>> figure_4_3 = metrology.MeasuringPlan(
    ...     start_mm=25.4, end_mm=177.8, increment_mm=25.4, dwell_s=2, runs=3, feed_mm_s=20, overshoot_mm=2.54)
    >>> limits = Limits(max_speed_mm_s=100.0, max_acceleration_mm_s2=500.0, rapid_mm_s=100.0)
    >>> measuring_run(figure_4_3, limits).target_mm.size
    42
    """
    blocks = metrology.parse_program(metrology.measuring_program(plan_))
    moves: list[axis.Block] = [axis.Dwell(seconds=HOME_DWELL_S)]
    readings: list[tuple[int, float, int, int]] = []
    position, direction, run = 0.0, 1, 1
    seen: set[tuple[float, int]] = set()
    for block in blocks:
        if isinstance(block, metrology.Move):
            target = block.position_mm
            direction = 1 if target > position else -1 if target < position else direction
            position = target
            moves.append(axis.Move(target_mm=target, feed_mm_s=block.feed_mm_s))
        elif isinstance(block, metrology.Dwell) or _is_reading_stop(block):
            if isinstance(block, metrology.Dwell):
                seconds = block.duration_s
            else:
                seconds = plan_.dwell_s if stop_s is None else stop_s
            moves.append(axis.Dwell(seconds=seconds))
            if plan_.start_mm - _SAME_MM <= position <= plan_.end_mm + _SAME_MM:
                if (position, direction) in seen:
                    seen.clear()
                    run += 1
                seen.add((position, direction))
                readings.append((len(moves) - 1, position, direction, run))
    moves.append(axis.Dwell(seconds=LAST_DWELL_S))
    motion = plan(axis.Program(blocks=tuple(moves)), limits, shape)
    if not readings:
        raise ArgumentError("plan", "no reading", "a plan with at least one target")
    return _schedule(motion, readings)


def _is_reading_stop(block: metrology.Block) -> bool:
    return isinstance(block, metrology.Stop) and block.kind is metrology.StopKind.PROGRAM


def _schedule(motion: MotionSegments, readings: Sequence[tuple[int, float, int, int]]) -> MeasuringRun:
    """Find when each block of a reading begins and ends."""
    block, target, direction, run = (np.array(column) for column in zip(*readings, strict=True))
    ends = motion.block_end_ps[block]
    begins = motion.block_end_ps[block - 1]
    return MeasuringRun(
        motion=motion,
        target_mm=target.astype(np.float64),
        direction=direction.astype(np.int8),
        run=run.astype(np.int64),
        begins_ps=begins.astype(np.int64),
        ends_ps=ends.astype(np.int64),
    )


def straight_pass(
    positions_mm: Sequence[float], feed_mm_s: float, limits: Limits, *, dwell_s: float = 1.0
) -> MotionSegments:
    """Return a motion from home through ``positions_mm``, standing still for a while at each.

    Examples
    --------
    >>> limits = Limits(max_speed_mm_s=100.0, max_acceleration_mm_s2=500.0, rapid_mm_s=100.0)
    >>> straight_pass([10.0, 0.0], 20.0, limits).extremes().max_mm
    10.0
    """
    blocks: list[axis.Block] = [axis.Dwell(seconds=HOME_DWELL_S)]
    for position in positions_mm:
        blocks += [axis.Move(target_mm=position, feed_mm_s=feed_mm_s), axis.Dwell(seconds=dwell_s)]
    return plan(axis.Program(blocks=tuple(blocks)), limits)


def end_ps(motion: MotionSegments) -> int:
    """Return when a motion ends, in picoseconds."""
    return int(motion.start_ps[-1] + motion.duration_ps[-1]) if motion.start_ps.size else PS_PER_S
