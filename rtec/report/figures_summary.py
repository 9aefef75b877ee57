"""Before and after in three figures, side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.report.appearance import Scale, look_of
from rtec.report.figures_style import legend_above, new_figure
from rtec.study.results import StudyResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def summary_figure(result: StudyResult, scale: Scale) -> Figure | None:
    """Return bars of maximum average error, maximum reversal error and peak to peak, on a logarithmic scale."""
    rows = result.rows
    if not rows:
        return None
    figure = new_figure(3.7)
    axes = figure.add_subplot()
    kinds = ("maximum average error (E)", "maximum reversal error (B)", "peak to peak of all readings")
    width = 0.84 / len(rows)
    lengths = [
        (None, None, None)
        if row.figures is None
        else (row.figures.max_average_error, row.figures.max_reversal_error, row.figures.peak_to_peak)
        for row in rows
    ]
    heights = [value * scale.per_mm for row in lengths for value in row if value is not None and value > 0.0]
    floor = 10.0 ** np.floor(np.log10(min(heights) / 1.5)) if heights else 1.0
    for index, (row, values) in enumerate(zip(rows, lengths, strict=True)):
        look = look_of(row.name)
        x = np.arange(len(kinds)) + (index - (len(rows) - 1) / 2) * width
        tops = [max((value or 0.0) * scale.per_mm, floor) for value in values]
        axes.bar(x, [top - floor for top in tops], 0.92 * width, bottom=floor, color=look.colour, label=look.label)
        for place, top, value in zip(x, tops, values, strict=True):
            axes.annotate(scale.text(value), (float(place), top), (0, 2), textcoords="offset points", ha="center",
                va="bottom",
                          fontsize=8.0, rotation=90 if scale.decimals > 2 else 0)  # fmt: skip
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:.10f}".rstrip("0").rstrip("."))
    axes.set_ylim(floor, 2.0 * max(heights, default=10.0) * (3.0 if scale.decimals > 2 else 1.0))
    axes.set_xticks(np.arange(len(kinds)), list(kinds))
    axes.tick_params(axis="x", length=0)
    axes.grid(visible=False, axis="x")
    axes.set_ylabel(f"{scale.symbol}, logarithmic")
    legend_above(figure, axes, len(rows))
    return figure
