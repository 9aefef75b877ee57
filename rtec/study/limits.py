"""What limits a design in a study: window and update rate, speed gate, word width."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rtec.injector import Design
from rtec.predictors import Predictor
from rtec.study.definition import Study
from rtec.study.results import Limit
from rtec.units import PS_PER_S


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
