"""What an experiment plan comes to: its readings one by one as CSV, and a program of G-code through them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtec.metrology.experiment_plan import ExperimentPlan, Passes, Spacing, Strokes

_STROKE_S, _SHORTEST_MM = (0.4, 0.8), 3.0
"""How long a short stroke takes, and its least length."""


class PlannedReading(NamedTuple):
    """One reading of a plan at rest, or the end of one stroke of a plan in motion."""

    run: int
    direction: int
    target_mm: float
    feed_mm_s: float
    first: bool
    """Whether a pass begins with it, so that the axis turns before."""


def targets_of(plan: ExperimentPlan) -> NDArray[np.float64]:
    """Return the targets of a pass of a plan at rest, without its shifts, shape (targets,), in mm or deg.

    Examples
    --------
    >>> targets_of(ExperimentPlan(targets=3, start_mm=0.0, span_mm=10.0)).tolist()
    [0.0, 5.0, 10.0]
    """
    share = np.linspace(0.0, 1.0, plan.targets)
    if plan.spacing is Spacing.DENSE_AT_ENDS:
        share = (1.0 - np.cos(np.pi * share)) / 2.0
    found: NDArray[np.float64] = plan.start_mm + plan.span_mm * share
    return found


def readings_of_plan(plan: ExperimentPlan) -> Iterator[PlannedReading]:
    """Yield the readings of a plan at rest, or the strokes of a plan in motion, in their order.

    Examples
    --------
    >>> [r.target_mm for r in readings_of_plan(ExperimentPlan(runs=1, targets=3, start_mm=0.0, span_mm=10.0))]
    [0.0, 5.0, 10.0, 10.0, 5.0, 0.0]
    """
    if plan.in_motion:
        yield from _strokes(plan)
        return
    there = targets_of(plan)
    passes = [(1, there)] if plan.passes is Passes.FORWARD else [(1, there), (-1, there[::-1])]
    for run in range(1, plan.runs + 1):
        feed = plan.feeds_mm_s[(run - 1) % len(plan.feeds_mm_s)]
        shift = plan.shifts_mm[(run - 1) % len(plan.shifts_mm)]
        for way, targets in passes:
            for k, target in enumerate((targets + shift).tolist()):
                yield PlannedReading(run, way, target, feed, k == 0)


def _strokes(plan: ExperimentPlan) -> Iterator[PlannedReading]:
    begin, end = plan.start_mm, plan.end_mm
    lasts = np.random.default_rng(0).uniform(*_STROKE_S, plan.targets)
    for run in range(1, plan.runs + 1):
        at = begin
        if plan.strokes is Strokes.FULL:
            ways = [(feed, target) for feed in plan.feeds_mm_s for target in (end, begin)]
        else:
            ways = list(_short(plan, lasts))
        for feed, target in ways:
            if target != at and (plan.passes is Passes.BOTH or target > at):
                yield PlannedReading(run, 1 if target > at else -1, target, feed, True)
                at = target


def _short(plan: ExperimentPlan, lasts: NDArray[np.float64]) -> Iterator[tuple[float, float]]:
    """Yield feed and end of strokes to and fro that take about as long, the feeds in turn."""
    at, way = plan.start_mm, 1
    for k, seconds in enumerate(lasts.tolist()):
        feed = plan.feeds_mm_s[k % len(plan.feeds_mm_s)]
        length = min(max(feed * seconds, _SHORTEST_MM), plan.span_mm)
        way = way if plan.start_mm <= at + way * length <= plan.end_mm else -way
        at = min(max(at + way * length, plan.start_mm), plan.end_mm)
        yield feed, at
        way = -way if k % 3 else way


def plan_csv(plan: ExperimentPlan) -> Iterator[str]:
    """Yield the readings of a plan as lines of CSV, with an empty column for each quantity that is to be read.

    Examples
    --------
    >>> list(plan_csv(ExperimentPlan(runs=1, targets=2, start_mm=0.0, span_mm=10.0)))[:2]
    ['run,direction,target_mm,feed_mm_s,actual_mm,time_s', '1,1,0,40,,']
    """
    unit = "deg" if plan.rotary else "mm"
    known = ("direction", "feed", "velocity", "dwell")
    read = [f"actual_{unit}", *(f"{name}_{_UNITS.get(name, unit)}" for name in plan.columns if name not in known)]
    yield ",".join(["run", "direction", f"target_{unit}", f"feed_{unit}_s", *read])
    for one in readings_of_plan(plan):
        numbers = f"{one.run},{one.direction},{one.target_mm:.6g},{one.feed_mm_s:.6g}"
        yield numbers + "," * len(read)


_UNITS = {"time": "s", "temperature": "degc", "pressure": "hpa", "humidity": "percent", "load": "kg", "force": "n",
          "torque": "nm", "current": "a", "voltage": "v"}  # fmt: skip


def plan_program(plan: ExperimentPlan, letter: str = "X") -> Iterator[str]:
    """Yield a program of G-code for a plan: to each target, and a rest there; feeds in mm/min, rests in seconds.

    Before the first target of a pass it goes beyond that, and rests.

    Examples
    --------
    >>> program = list(plan_program(ExperimentPlan(runs=1, targets=2, start_mm=0.0, span_mm=10.0)))
    >>> program[3:8]
    ['(run 1)', 'G1 X-1 F2400', 'G4 P60', 'G1 X0 F2400', 'G4 P6']
    """
    yield f"(rtec: {plan.readings} {'moves' if plan.in_motion else 'readings'}, {plan.duration_s / 60.0:.0f} min)"
    yield "(rests in seconds, as LinuxCNC has them; angles as lengths)" if plan.rotary else "(rests in seconds)"
    yield "G21 G90 G94"
    run = 0
    for one in readings_of_plan(plan):
        if one.run != run:
            run = one.run
            yield f"(run {run})"
        feed = f"F{60.0 * one.feed_mm_s:.6g}"
        if one.first and not plan.in_motion:
            yield f"G1 {letter}{one.target_mm - one.direction * plan.overshoot_mm:.6g} {feed}"
            yield f"G4 P{max(plan.turn_dwells_s):.6g}"
        yield f"G1 {letter}{one.target_mm:.6g} {feed}"
        if not plan.in_motion:
            yield f"G4 P{plan.dwell_s:.6g}"
    yield "M30"
