"""All readings after correction: where they lie and how often."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from rtec.metrology import PositioningFigures
from rtec.report.appearance import Look, Scale, look_of
from rtec.report.figures_style import new_figure
from rtec.report.palette import GUIDE, INK
from rtec.study.results import Floats, StudyResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_Measured: TypeAlias = tuple[Look, Floats, PositioningFigures]
"""A row that has readings: its look, their deviations in mm, its figures."""
_BINS = 60
_HIGH = 0.8
"""Height of the highest bin; rows stand one unit apart."""
_FAR = 5.0
"""Rows with a range so many times the smallest are left to the table: they would squeeze the others."""


def residual_figure(result: StudyResult, scale: Scale) -> Figure | None:
    """Return a histogram a row over one axis, with range and RMS; the row without correction is left out."""
    measured = [
        (look_of(row.name), row.readings.deviation_mm, row.figures)
        for row in result.rows
        if row.name != "uncompensated" and row.readings is not None and row.figures is not None
    ]
    rows = _comparable(measured)
    if not rows:
        return None
    figure = new_figure(0.72 * len(rows) + 1.0)
    axes = figure.add_subplot()
    values = np.concatenate([deviation for _, deviation, _ in rows]) * scale.per_mm
    edges = np.linspace(values.min(), values.max(), _BINS + 1)
    if edges[0] == edges[-1]:
        edges = np.linspace(edges[0] - 1.0, edges[0] + 1.0, _BINS + 1)
    highest = max(np.histogram(of * scale.per_mm, edges)[0].max() / of.size for _, of, _ in rows)
    for index, row in enumerate(reversed(rows)):
        _row(axes, row, index, edges, float(highest), scale)
    axes.axvline(0.0, color=GUIDE, linewidth=0.9, zorder=1)
    axes.set_yticks(np.arange(len(rows)) + 0.3, [look.label for look, _, _ in reversed(rows)])
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.spines["left"].set_visible(False)
    axes.set_ylim(-0.25, len(rows))
    axes.set_xlabel(f"deviation of each reading ({scale.symbol})")
    return figure


def _comparable(rows: list[_Measured]) -> list[_Measured]:
    spans = [figures.peak_to_peak for _, _, figures in rows]
    return [row for row, span in zip(rows, spans, strict=True) if span <= _FAR * max(min(spans), 1e-9)]


def _row(axes: Axes, row: _Measured, base: int, edges: np.ndarray, highest: float, scale: Scale) -> None:
    look, deviation_mm, figures = row
    values = deviation_mm * scale.per_mm
    share = np.histogram(values, edges)[0] / values.size
    axes.stairs(base + _HIGH * share / highest, edges, baseline=base, fill=True, color=look.colour, alpha=0.55)
    axes.plot([values.min(), values.max()], [base - 0.08] * 2, color=look.colour, linewidth=1.6, marker="|",
              markersize=7)  # fmt: skip
    words = f"p-p {scale.text(figures.peak_to_peak)}   RMS {scale.text(figures.rms)}  {scale.symbol}"
    axes.annotate(words, (1.0, base + 0.3), (6, 0), xycoords=("axes fraction", "data"), textcoords="offset points",
                  va="center", color=INK, fontsize=8.5, annotation_clip=False)  # fmt: skip
