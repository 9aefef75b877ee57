"""The runs behind the report's figures: error against feed, an axis held while it grows, one insertion, limits."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rtec.board import Board, Microcontroller
from rtec.heat.approach import approach
from rtec.injector import Design, Injector, RealEdges
from rtec.machine import TRACE_COLUMNS, Machine, run_machine, straight_pass
from rtec.machine.laser_readings import HOME_DWELL_S
from rtec.predictors import NoError, Predictor, growth
from rtec.signal import EdgeStream
from rtec.study.definition import Study
from rtec.study.results import FeedCurve, HoldCurve, Limit, Waveform
from rtec.units import PS_PER_S

_TIME, _COMMAND, _TRUE, _CONTROLLER = (
    TRACE_COLUMNS.index(name) for name in ("time_s", "command_mm", "true_mm", "controller_mm")
)
_WARM_UP_K = 10.0
"""By which the axis warms up while it is held: it grows in proportion."""
TRACE_ROWS = 200_000
"""Kept of a pass, however slow it is."""
_READING_PS = 1_000_000_000
SETTLE_S = 0.5
"""Left out at both ends of a pass: acceleration, and the slewing of the request after a reversal."""


def feed_curve(study: Study, name: str, machine: Machine, progress: Callable[[float], None]) -> FeedCurve:
    """Run passes at each feed and return the error in motion.

    The error in motion is the true position less the position that the controller counts, so that following error
    has no part in it.
    """
    feeds = np.array([feed for feed in study.feeds_mm_s if feed <= study.limits.max_speed_mm_s])
    columns: list[tuple[float, float, float, float]] = []
    for index, feed in enumerate(feeds):
        progress(index / len(feeds))
        forward, reverse = _moving_errors(study, machine, float(feed))
        columns.append((_spread(forward), _spread(reverse), _rms(forward), _rms(reverse)))
    table = np.array(columns).reshape(-1, 4).T
    return FeedCurve(
        name=name,
        feed_mm_s=feeds,
        forward_pp_mm=table[0],
        reverse_pp_mm=table[1],
        forward_rms_mm=table[2],
        reverse_rms_mm=table[3],
        follows_up_to_mm_s=limit_of(study, Design.named(name)).follows_up_to_mm_s,
    )


def _moving_errors(study: Study, machine: Machine, feed: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    lead = feed * feed / study.limits.max_acceleration_mm_s2 + feed * (SETTLE_S + 10.0 / study.servo.gain_per_s)
    start = study.plan.start_mm
    # a reversal takes the request's slewing as long as the play is wide, in steps of the window
    end = start + 2.0 * lead + study.span_mm
    motion = straight_pass([end, 0.0], feed, study.limits, dwell_s=2.0)
    ticks = motion.total_ps // machine.servo.period_ps
    trace = np.asarray(run_machine(machine, motion, trace_every=max(ticks // TRACE_ROWS, 1)).trace)
    inside = (trace[:, _COMMAND] > start + lead) & (trace[:, _COMMAND] < start + lead + study.span_mm)
    moving = np.gradient(trace[:, _COMMAND]) if trace.shape[0] > 1 else np.zeros(trace.shape[0])
    error = trace[:, _TRUE] - trace[:, _CONTROLLER]
    return error[inside & (moving > 0)], error[inside & (moving < 0)]


def _spread(values: NDArray[np.float64]) -> float:
    return float(np.ptp(values)) if values.size else math.nan


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else math.nan


def hold_curve(study: Study, name: str, machine: Machine, progress: Callable[[float], None]) -> HoldCurve:
    """Hold the axis outside angle state 0 while its error grows, and return what is left of the growth.

    The paper's turning case: an axis with a fixed programmed position that needs correction all the same.
    """
    count_mm = study.encoder.count_mm
    # a few counts from home, in the angle state opposite to state 0, so that hardly any growth passes on the way
    count = (2 - study.encoder.home_state) % 4
    time_constant = study.hold_time_constant_s
    motion = straight_pass([count * count_mm], count_mm * 1000.0, study.limits, dwell_s=5.0 * time_constant)
    heat = approach(time_constant_s=time_constant, shift_mm=study.hold_growth_mm, rise_k={"axis": _WARM_UP_K})
    grown = growth("axis", study.hold_growth_mm / _WARM_UP_K)
    growing = replace(machine, heat=heat, axis_error=NoError(), model=grown)
    result = run_machine(growing, motion, trace_every=max(round(time_constant), 1) * 5, progress=progress)
    trace = np.asarray(result.trace)
    standing = trace[trace[:, _TIME] > HOME_DWELL_S + SETTLE_S]
    return HoldCurve(
        name=name,
        state=2,
        time_s=standing[:, _TIME],
        deviation_mm=standing[:, _TRUE] - count * count_mm,
        inserted=result.insertions.inserted,
        pending_steps=abs(result.pending_steps),
    )


def waveform(study: Study, design: Design) -> Waveform:
    """Insert one step into a steady forward motion, near the fastest that the speed gate lets through."""
    timing = study.timing(design)
    quarter_ps = round(1.2 * timing.worst_ps(design) * (1.0 + (timing.gate_margin or 0.0)))
    if study.firmware is not None:
        return _firmware_waveform(study, design, study.firmware, 2 * quarter_ps)
    states = np.arange(1, 17)
    times = quarter_ps * states.astype(np.int64)
    moving = EdgeStream.from_states(times, states % 4, 0)
    box = Injector(study.injector(design), initial=0)
    # one that waits for state 1 (both lines low); the others are shown in state 3, where it could not insert
    asked = 7 if design.one_state else 9
    before = box.process(moving.part(0, asked), until_ps=int(times[asked]))
    box.request(1, at_ps=int(times[asked]))
    after = box.process(moving.part(asked, 16), until_ps=17 * quarter_ps)
    controller = EdgeStream.concatenate([before, after])
    return _around_insertion(study, design, moving, controller, quarter_ps, box.insertions.ahead_counts)


def _firmware_waveform(study: Study, design: Design, microcontroller: Microcontroller, quarter_ps: int) -> Waveform:
    """Insert one step by the real firmware, which looks for its moment a few readings after it is asked."""
    board = Board(design, microcontroller, hold_latch=study.real_edges is RealEdges.HOLD)
    board.start_up()
    board.begin_counting()
    begun_ps = board.now_ps
    board.ask(1)
    states = np.arange(1, 1 + 6 * _READING_PS // quarter_ps)
    moving = EdgeStream.from_states(begun_ps + quarter_ps * states.astype(np.int64), states % 4, 0)
    controller = board.process(moving, until_ps=int(moving.times_ps[-1]) + 1)
    counts = controller.counts().net - moving.counts().net
    own = _own_changes(moving, controller)
    if own.size:  # sixteen edges are enough to look at
        middle = int(np.searchsorted(moving.times_ps, controller.times_ps[own[0]]))
        from_ps = int(moving.times_ps[max(middle - 8, 0)])
        to_ps = int(moving.times_ps[min(middle + 8, len(moving) - 1)])
        moving, controller = moving.window(from_ps, to_ps), controller.window(from_ps, to_ps)
    return _around_insertion(study, design, moving, controller, quarter_ps, counts)


def _own_changes(moving: EdgeStream, controller: EdgeStream) -> NDArray[np.int64]:
    """Return the box's own changes: what follows the first change behind a real edge, which B copies late."""
    passed = np.searchsorted(moving.times_ps, controller.times_ps, side="right")
    return np.flatnonzero(np.diff(passed, prepend=0) == 0)


def _around_insertion(
    study: Study, design: Design, moving: EdgeStream, controller: EdgeStream, quarter_ps: int, counts: int
) -> Waveform:
    """Return what is drawn: two edges before the insertion to two after."""
    inserted = tuple(int(t) for t in controller.times_ps[_own_changes(moving, controller)])
    around = inserted or (int(moving.times_ps[len(moving) // 2]),)
    return Waveform(
        name=design.value,
        processor=study.processor.value if study.firmware is None else study.firmware.name,
        encoder=moving,
        controller=controller,
        from_ps=around[0] - 2 * quarter_ps,
        to_ps=around[-1] + 2 * quarter_ps,
        inserted_ps=inserted,
        counts_added=counts,
    )


def steepest_slope(predictor: Predictor, grid_mm: NDArray[np.float64], *, over_mm: float) -> float:
    """Return the steepest slope of a predictor's curves, jumps at single points left out.

    The slope is that of a chord of length ``over_mm``, and the 99.5th percentile of its size.

    Examples
    --------
    >>> from rtec.predictors import BidirectionalTable
    >>> line = BidirectionalTable(
    ...     forward_positions_mm=[0.0, 100.0], forward_errors_mm=[0.0, 1.0],
    ...     reverse_positions_mm=[0.0, 100.0], reverse_errors_mm=[0.0, 2.0])
    >>> round(steepest_slope(line, np.linspace(1.0, 90.0, 50), over_mm=1.0), 6)
    0.02
    """
    slopes = [
        np.abs(predictor.error_mm(grid_mm + over_mm, direction) - predictor.error_mm(grid_mm, direction)) / over_mm
        for direction in (1, -1)
    ]
    return float(np.quantile(np.concatenate(slopes), 0.995))


def limit_of(study: Study, design: Design) -> Limit:
    """Return what limits a design: window and update rate, speed gate, word width."""
    start, end = study.plan.start_mm, study.plan.end_mm
    grid = np.linspace(start, end, 20_001)
    step_mm = design.step_counts * study.encoder.count_mm
    slope = steepest_slope(study.model, grid, over_mm=0.05)
    rate_mm_s = study.handshake.window_steps * step_mm / (study.handshake.pc_period_ps / PS_PER_S)
    gate_ps = study.timing(design).gate_ps(design)
    # the firmware has a gate of its own, in its own cycles: what it refuses, `rtec envelope` measures
    gate_mm_s = math.nan if study.firmware is not None else math.inf
    if gate_ps and study.firmware is None:
        gate_mm_s = design.gate_quarters * study.encoder.count_mm / (gate_ps / PS_PER_S)
    model = np.concatenate([study.model.error_mm(grid, 1), study.model.error_mm(grid, -1)])
    return Limit(
        name=design.value,
        follows_up_to_mm_s=rate_mm_s / slope if slope > 0.0 else float("inf"),
        gate_refuses_above_mm_s=gate_mm_s,
        word_holds_mm=design.word_limit * step_mm,
        largest_error_mm=float(np.abs(model).max()),
    )
