"""From the measuring program's blocks to a motion and a schedule of laser readings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.axis import Block, Dwell, Limits, MotionSegments, Move, ProfileShape, Program, plan
from rtec.checks import number_within
from rtec.errors import ArgumentError
from rtec.metrology.measuring_plan import MeasuringPlan
from rtec.units import PS_PER_S

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
        number_within("window_mm", self.window_mm, 1e-6, 1e3, unit="mm")
        number_within("dwell_s", self.dwell_s, 1e-3, 1e4, unit="s")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasuringRun:
    """A motion and the readings taken on it."""

    motion: MotionSegments
    """The commanded motion, from home to rest."""
    target_mm: NDArray[np.float64]
    direction: NDArray[np.int8]
    run: NDArray[np.int64]
    """``target_mm``, ``direction``, ``run``: of each reading, shape (n,)."""
    begins_ps: NDArray[np.int64]
    ends_ps: NDArray[np.int64]
    """``begins_ps``, ``ends_ps``: between which the axis is commanded to stand at the target."""


def measuring_run(
    plan_: MeasuringPlan,
    limits: Limits,
    *,
    stop_s: float | None = None,
    shape: ProfileShape = ProfileShape.TRAPEZOIDAL,
) -> MeasuringRun:
    """Let the axis carry out a measuring plan, at its millimetres, in the order of the thesis's program (Appendix B).

    A run is: overshoot below the start, the targets forward, overshoot beyond the end, the targets back. Every dwell
    at a target is a reading; the first is the program stop at which the laser is zeroed, and lasts ``stop_s``
    (default: the dwell of the plan).

    Raises
    ------
    ArgumentError
        A feed beyond the axis's limits.

    Examples
    --------
    The program that the thesis prints takes 42 readings:

    >>> figure_4_3 = MeasuringPlan(
    ...     start_mm=25.4, end_mm=177.8, increment_mm=25.4, dwell_s=2, runs=3, feed_mm_s=20, overshoot_mm=2.54)
    >>> limits = Limits(max_speed_mm_s=100.0, max_acceleration_mm_s2=500.0, rapid_mm_s=100.0)
    >>> measuring_run(figure_4_3, limits).target_mm.size
    42
    """
    program = _Program(plan_)
    program.rest(HOME_DWELL_S)
    program.move(program.targets[0])
    for _ in range(plan_.runs):
        program.measure(stop_s)
    program.rest(LAST_DWELL_S)
    return program.scheduled(limits, shape)


def repeated_run(
    plan_: MeasuringPlan,
    limits: Limits,
    *,
    every_s: float,
    times: int,
    shape: ProfileShape = ProfileShape.TRAPEZOIDAL,
) -> MeasuringRun:
    """Let the axis carry out one run of a measuring plan again and again, standing at home in between.

    Parameters
    ----------
    plan_
        What is measured; its runs do not count.
    every_s
        From the beginning of one to that of the next.
    times
        How often; the runs of the readings are numbered in their order.

    Raises
    ------
    ArgumentError
        A run that takes longer than ``every_s``, or a feed beyond the axis's limits.

    Examples
    --------
    >>> few = MeasuringPlan(
    ...     start_mm=25.4, end_mm=177.8, increment_mm=76.2, dwell_s=2, runs=1, feed_mm_s=20, overshoot_mm=2.54)
    >>> limits = Limits(max_speed_mm_s=100.0, max_acceleration_mm_s2=500.0, rapid_mm_s=100.0)
    >>> task = repeated_run(few, limits, every_s=600.0, times=3)
    >>> task.target_mm.size, np.diff(task.begins_ps[::6] / 1e12).tolist()
    (18, [600.0, 600.0])
    """
    one = _Program(plan_)
    one.measure_from_home()
    took_s = one.scheduled(limits, shape).motion.total_ps / PS_PER_S
    if took_s > every_s:
        raise ArgumentError("every_s", f"{every_s:g} s", f"at least {took_s:.0f} s, which a run takes")
    program = _Program(plan_)
    program.rest(HOME_DWELL_S)
    for _ in range(times):
        program.measure_from_home()
        if every_s > took_s:
            program.rest(every_s - took_s)
    program.rest(LAST_DWELL_S)
    return program.scheduled(limits, shape)


class _Program:
    """The blocks of a measuring program, and which of them are readings."""

    def __init__(self, plan_: MeasuringPlan) -> None:
        self.targets, self._turns = plan_.targets_mm.tolist(), plan_.turns_mm.tolist()
        self._feed_mm_s, self._dwell_s = plan_.programmed_feed_mm_s, plan_.dwell_s
        self._blocks: list[Block] = []
        self._readings: list[tuple[int, float, int, int]] = []
        self._run = 0

    def rest(self, seconds: float) -> None:
        """Stand still."""
        self._blocks.append(Dwell(seconds=seconds))

    def move(self, target_mm: float) -> None:
        """Go somewhere at the plan's feed."""
        self._blocks.append(Move(target_mm=target_mm, feed_mm_s=self._feed_mm_s))

    def measure(self, stop_s: float | None = None) -> None:
        """Read at the targets forward and back; at the very first one the program stops for ``stop_s``."""
        self._run += 1
        below, beyond = self._turns
        for direction, turn_mm, passed in ((1, below, self.targets), (-1, beyond, self.targets[::-1])):
            self.move(turn_mm)
            self.rest(self._dwell_s)
            for target_mm in passed:
                self.move(target_mm)
                self.rest(self._dwell_s if self._readings or stop_s is None else stop_s)
                self._readings.append((len(self._blocks) - 1, target_mm, direction, self._run))

    def measure_from_home(self) -> None:
        """Read at the targets, and go home."""
        self.measure()
        self.move(0.0)

    def scheduled(self, limits: Limits, shape: ProfileShape) -> MeasuringRun:
        """Return motion and readings."""
        return _schedule(plan(Program(blocks=tuple(self._blocks)), limits, shape), self._readings)


def _schedule(motion: MotionSegments, readings: Sequence[tuple[int, float, int, int]]) -> MeasuringRun:
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
    >>> float(straight_pass([10.0, 0.0], 20.0, limits).x0_mm.max())
    10.0
    """
    blocks: list[Block] = [Dwell(seconds=HOME_DWELL_S)]
    for position in positions_mm:
        blocks += [Move(target_mm=position, feed_mm_s=feed_mm_s), Dwell(seconds=dwell_s)]
    return plan(Program(blocks=tuple(blocks)), limits)
