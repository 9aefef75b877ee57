"""A zoom on the cyclic error, and what the designs leave of it within one turn of the screw."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.metrology.figures import TargetFigures
from rtec.report.appearance import Look, Scale, look_of
from rtec.report.figures_style import new_figure
from rtec.report.palette import DOTTED, GUIDE, PAPER, REVERSE_LINE
from rtec.study.results import StudyResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_TURNS = 10
"""Turns of the screw that the zoom shows."""
_MIDDLE = 0.5
"""Share of the travel at which the zoom begins."""


def cyclic_figure(result: StudyResult, scale: Scale) -> Figure | None:
    """Return the zoom on the true curves, and the residuals folded on one turn; None where no period is known."""
    period = result.study.period_mm
    if period is None or not period > 0 or result.position_mm.size < 2:
        return None
    after = [
        (look_of(row.name), row.figures.at_targets)
        for row in result.rows
        if row.name != "uncompensated" and row.figures is not None
    ]
    figure = new_figure(6.2 if after else 3.6)
    grid = figure.add_gridspec(2 if after else 1, max(len(after), 1), height_ratios=[1.25, 1.0] if after else None)
    _zoom(figure.add_subplot(grid[0, :]), result, period, scale)
    first: Axes | None = None
    for index, (look, at) in enumerate(after):
        axes = figure.add_subplot(grid[1, index], sharey=first)
        _folded(axes, look, at, period, scale)
        axes.tick_params(labelleft=first is None)
        if first is None:
            axes.set_ylabel(f"mean residual ({scale.symbol})")
        if index == len(after) // 2:
            axes.set_xlabel("share of a turn of the screw")
        first = first or axes
    return figure


def _zoom(axes: Axes, result: StudyResult, period: float, scale: Scale) -> None:
    """Draw the true error of both directions over some turns, with the readings of the axis as it is."""
    position = result.position_mm
    span = min(_TURNS * period, float(np.ptp(position)))
    begin = position[0] + _MIDDLE * max(float(np.ptp(position)) - span, 0.0)
    begin = np.floor(begin / period) * period if np.ptp(position) > span else begin
    inside = (position >= begin - 1e-9) & (position <= begin + span + 1e-9)
    look = look_of("uncompensated")
    lines = (("forward", result.forward_error_mm, "-"), ("reverse", result.reverse_error_mm, REVERSE_LINE))
    for label, error, line in lines:
        axes.plot(position[inside] * scale.position_per_mm, error[inside] * scale.per_mm, color=look.colour,
                  linestyle=line)  # fmt: skip
        axes.annotate(label, (position[inside][-1] * scale.position_per_mm, error[inside][-1] * scale.per_mm), (4, 0),
                      textcoords="offset points", va="center", color=look.colour)  # fmt: skip
    for turn in np.arange(np.ceil(begin / period), np.floor((begin + span) / period) + 0.5) * period:
        axes.axvline(turn * scale.position_per_mm, color=GUIDE, linewidth=0.8, linestyle=DOTTED, zorder=1)
    for row in result.rows:
        if row.name == "uncompensated" and row.readings is not None:
            reading = row.readings
            near = (reading.target_mm >= begin) & (reading.target_mm <= begin + span)
            axes.plot(reading.target_mm[near] * scale.position_per_mm, reading.deviation_mm[near] * scale.per_mm,
                      linestyle="none", marker="o", markersize=3.0, color=look.colour, alpha=0.6)  # fmt: skip
    axes.grid(visible=False, axis="x")
    axes.set_xlim(begin * scale.position_per_mm, (begin + span) * scale.position_per_mm)
    axes.set_ylabel(f"error ({scale.symbol})")
    axes.set_xlabel(f"position ({scale.position_unit})")
    axes.set_title(f"Before: true error (lines) and readings (dots); dotted: each turn of the screw, "
                   f"{period * scale.position_per_mm:g} {scale.position_unit}")  # fmt: skip


def _folded(axes: Axes, look: Look, at: TargetFigures, period: float, scale: Scale) -> None:
    phase = np.mod(at.target + 1e-9, period) / period
    for mean, marker, face in ((at.mean_forward, "^", look.colour), (at.mean_backward, "v", PAPER)):
        axes.plot(
            phase, mean * scale.per_mm, color=look.colour, linestyle="none", marker=marker, markersize=3.4,
            markerfacecolor=face, markeredgewidth=0.8,
        )  # fmt: skip
    axes.axhline(0.0, color=GUIDE, linewidth=0.9, zorder=1)
    axes.set_xlim(-0.04, 1.04)
    axes.set_xticks([0.0, 0.5, 1.0], ["0", "½", "1"])
    axes.set_title(look.label, color=look.ink, fontweight="bold")
