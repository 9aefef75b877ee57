"""The bidirectional positioning error before and after, as ISO 230-2 draws it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.metrology import PositioningFigures
from rtec.report.appearance import Look, Scale, is_design, look_of
from rtec.report.figures_style import legend_above, new_figure
from rtec.report.palette import GUIDE, INK, PAPER, REVERSE_LINE
from rtec.study.results import Floats, StudyResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ALIKE = 5.0
"""Panels whose ranges differ by no more than this share one scale, so that they can be compared by eye."""


def positioning_figure(result: StudyResult, scale: Scale) -> Figure | None:
    """Return one panel a row: means of both directions with bands of two standard deviations."""
    rows = [(row.name, row.figures) for row in result.rows if row.figures is not None]
    if not rows:
        return None
    heights = [1.0 if is_design(name) or name == "table" else 1.9 for name, _ in rows]
    figure = new_figure(1.35 * sum(heights) + 1.1)
    grid = figure.add_gridspec(len(rows), 1, height_ratios=heights)
    first: Axes | None = None
    for index, (name, figures) in enumerate(rows):
        axes = figure.add_subplot(grid[index], sharex=first)
        first = first or axes
        _panel(axes, look_of(name), figures, scale)
        axes.tick_params(labelbottom=index == len(rows) - 1)
    axes.set_xlabel(f"target position ({scale.position_unit})")
    figure.supylabel(f"deviation, actual − target ({scale.symbol})", fontsize=9.5)
    share_scales([axes for axes, (name, _) in zip(figure.axes, rows, strict=True) if name != "uncompensated"])
    if first is not None:
        legend_above(figure, first, 4)
    return figure


def _panel(axes: Axes, look: Look, figures: PositioningFigures, scale: Scale) -> None:
    at = figures.at_targets
    target = at.target * scale.position_per_mm
    for label, mean, spread, marker, line, face in (
        ("forward", at.mean_forward, at.spread_forward, "^", "-", look.colour),
        ("reverse", at.mean_backward, at.spread_backward, "v", REVERSE_LINE, PAPER),
    ):
        known = np.isfinite(mean)
        if not known.any():
            continue
        middle, half = mean[known] * scale.per_mm, 2.0 * np.nan_to_num(spread[known]) * scale.per_mm
        x = target[known]
        axes.fill_between(x, middle - half, middle + half, color=look.colour, alpha=0.18, linewidth=0,
                          label="mean ± 2s" if label == "forward" else None)  # fmt: skip
        axes.plot(x, middle, color=look.colour, linestyle=line, marker=marker, markersize=3.2, linewidth=1.1,
                  markerfacecolor=face, markeredgewidth=0.8, label=f"{label}, mean of the runs")  # fmt: skip
    axes.axhline(0.0, color=GUIDE, linewidth=0.9, zorder=1)
    axes.margins(x=0.01)
    axes.set_title(look.label, color=look.ink, fontweight="bold")
    axes.set_title(_figures(figures, scale), loc="right", fontsize=8.5, color=INK)


def _figures(figures: PositioningFigures, scale: Scale) -> str:
    return "   ".join(f"{symbol} {scale.text(figures.iso[symbol])}" for symbol in "AREB") + f"  {scale.symbol}"


def share_scales(panels: list[Axes]) -> None:
    """Give panels of like ranges one scale."""
    if not panels:
        return
    limits: Floats = np.array([panel.get_ylim() for panel in panels])
    spans = limits[:, 1] - limits[:, 0]
    alike = spans <= _ALIKE * spans.min()
    low, high = limits[alike, 0].min(), limits[alike, 1].max()
    for panel, joins in zip(panels, alike, strict=True):
        if joins:
            panel.set_ylim(low, high)
