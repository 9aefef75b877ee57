"""Measured against model: over position by direction, or over time in a moving log."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.standstill import Ints
from rtec.effects import Conditions, Floats
from rtec.inference.curves import FEW_PLACES, FINE, model_curve
from rtec.inference.model import Model
from rtec.inference.results import NoiseFloor
from rtec.report.diagnosis.quantities import shown_for, shown_in
from rtec.report.diagnosis.readings import (
    ALL,
    Rows,
    Way,
    clock,
    figure_text,
    position_label,
    residual,
    some_rows,
    ways,
)
from rtec.report.figures_style import MOST_POINTS, legend_above, new_figure, outline
from rtec.report.palette import BAND, FORWARD, GUIDE, GUIDE_LINE, MEASURED, NEUTRAL, REVERSE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ZOOM_ROWS, _MOST_ZOOM_ROWS, _ZOOM_SHARE = 600, 20_000, 25
"""Rows of the enlarged stretch of a log: one part in so many, within these limits."""
_TURNS, _ZOOM_PLACES = 8, 100
"""Periods of the enlarged stretch of an axis, or targets where the model has no period."""
_MOST_PASSES = 20
"""Of a direction, that are joined each for itself."""


def measured_figure(dataset: Dataset, model: Model, noise: NoiseFloor) -> Figure:
    """Return readings and model, with two standard deviations of a reading to either side of the model."""
    c = dataset.coordinates
    return (
        _over_time(dataset, c, model, noise)
        if c.moving and c.time_s is not None
        else _over_place(dataset, c, model, noise)
    )


def _over_place(dataset: Dataset, c: Conditions, model: Model, noise: NoiseFloor) -> Figure:
    shown, label, left = shown_for(dataset), position_label(c), residual(dataset, model)
    below = shown_in(dataset.units, max(float(np.std(left)), noise.sigma))
    if c.span == 0.0:  # one place: what there is to see is how readings follow each other
        label, c = clock(c).label, replace(c, position=clock(c).values, whole=None)
    window = _window(c, model)
    figure = new_figure(6.0 if window is None else 7.6)
    heights = [1.5, 1.0] if window is None else [1.3, 1.3, 1.0]
    panels = list(figure.subplots(len(heights), 1, height_ratios=heights))
    upper, lower = panels[0], panels[-1]
    fitted = dataset.observed - left
    half = 2 * noise.sigma * shown.factor
    for way in ways(c):
        at, line = model_curve(dataset, c, model, fitted, way.rows)
        _dots(upper, c.position, dataset.observed * shown.factor, way, some_rows(way.rows))
        _passes(upper, c.position, dataset.observed * shown.factor, way, dataset.passage)
        _model(upper, at, line * shown.factor, half, way)
        if window is not None:
            near = some_rows(way.rows & (c.position >= window[0]) & (c.position <= window[1]))
            inside = (at >= window[0]) & (at <= window[1])
            _dots(panels[1], c.position, dataset.observed * shown.factor, way, near)
            _model(panels[1], at[inside], line[inside] * shown.factor, half, way)
        _dots(lower, c.position, left * below.factor, way, some_rows(way.rows))
    if window is not None:
        upper.axvspan(*window, color=NEUTRAL, alpha=0.15, linewidth=0.0)
    _noise(lower, 2 * noise.sigma * below.factor)
    lower.axhline(0.0, color=GUIDE, linewidth=0.9, zorder=1)
    for axes in panels[:-1]:
        axes.set_ylabel(f"{figure_text(dataset.observe)} ({shown.symbol})")
    lower.set_ylabel(f"measured less\nmodel ({below.symbol})")
    lower.set_xlabel(label)
    legend_above(figure, upper, 6)
    return figure


def _window(c: Conditions, model: Model) -> tuple[float, float] | None:
    """Return the limits of a stretch in the middle to be drawn larger, where there are too many places to see."""
    if c.places.size <= FEW_PLACES:
        return None
    longest = max((term.period or 0.0 for term in model.terms), default=0.0)
    width = _TURNS * longest if 0 < _TURNS * longest < c.span / 3 else c.span * _ZOOM_PLACES / c.places.size
    middle = float(c.places[c.places.size // 2])
    return middle - width / 2, middle + width / 2


def _noise(axes: Axes, half: float) -> None:
    axes.axhspan(-half, half, color=BAND, zorder=0)
    for edge in (-half, half):
        axes.axhline(edge, color=NEUTRAL, linewidth=0.7, linestyle=GUIDE_LINE, zorder=5)


def _dots(axes: Axes, x: Floats, y: Floats, way: Way, rows: Rows) -> None:
    axes.plot(x[rows], y[rows], linestyle="none", marker=way.marker, markersize=3.6, markeredgewidth=0.0,
              color=way.colour, alpha=0.55, label=_label("measured", way), zorder=3)  # fmt: skip


def _passes(axes: Axes, x: Floats, y: Floats, way: Way, passage: Ints) -> None:
    """Join the readings of each pass by a thin line, where they are few: runs that shift or tilt stand out."""
    passes = np.unique(passage[way.rows])
    if not 1 < passes.size <= _MOST_PASSES or x.size > FEW_PLACES:
        return
    for one in passes:
        rows = np.flatnonzero(way.rows & (passage == one))
        rows = rows[np.argsort(x[rows], kind="stable")]
        axes.plot(x[rows], y[rows], color=way.colour, alpha=0.3, linewidth=0.5, zorder=2)


def _label(what: str, way: Way) -> str:
    return f"{what}, {way.label}" if way.label != ALL else what


def _model(axes: Axes, at: Floats, line: Floats, half: float, way: Way) -> None:
    many = at.size >= FINE
    axes.plot(*outline(at, line), color=way.colour, linestyle="-" if many else way.dash,
              linewidth=0.7 if many else 1.1, alpha=0.6 if many else 1.0, zorder=2,
              label=_label("model", way))  # fmt: skip
    if at.size <= 2 * FINE:
        axes.fill_between(at, line - half, line + half, color=way.colour, alpha=0.15, linewidth=0.0, zorder=1,
                          label="± 2σ of a reading" if way.marker != "v" else None)  # fmt: skip


def _over_time(dataset: Dataset, c: Conditions, model: Model, noise: NoiseFloor) -> Figure:
    shown, time = shown_for(dataset), clock(c)
    figure = new_figure(6.4)
    whole, zoom, lower = figure.subplots(3, 1, height_ratios=[1.0, 1.2, 0.8])
    left = residual(dataset, model)
    below = shown_in(dataset.units, max(float(np.std(left)), noise.sigma))
    measured, half = dataset.observed * shown.factor, 2 * noise.sigma * shown.factor
    fit = measured - left * shown.factor
    middle = _stretch(fit)
    for axes, rows in ((whole, slice(None)), (zoom, middle)):
        t, seen, fitted = time.values[rows], measured[rows], fit[rows]
        axes.plot(*outline(t, seen), color=MEASURED, linewidth=1.8, label="measured")
        axes.plot(*outline(t, fitted), color=REVERSE, linewidth=0.9, label="model")
        if axes is zoom:
            thin = slice(None, None, max(1, t.size // MOST_POINTS))
            axes.fill_between(t[thin], fitted[thin] - half, fitted[thin] + half, color=REVERSE, alpha=0.25,
                              linewidth=0.0, zorder=4)  # fmt: skip
            axes.ticklabel_format(axis="x", useOffset=False)
        axes.set_ylabel(f"{figure_text(dataset.observe)} ({shown.symbol})")
    whole.axvspan(time.values[middle][0], time.values[middle][-1], color=FORWARD, alpha=0.15, label="stretch below")
    _noise(lower, 2 * noise.sigma * below.factor)
    lower.plot(*outline(time.values, left * below.factor), color=FORWARD, linewidth=0.7)
    lower.set_ylabel(f"measured less\nmodel ({below.symbol})")
    lower.set_xlabel(time.label)
    legend_above(figure, whole, 4)
    return figure


def _stretch(fitted: Floats) -> slice:
    """Return the rows of a stretch in which the model changes most, of those that can be read in a figure."""
    rows = min(max(fitted.size // _ZOOM_SHARE, _ZOOM_ROWS), _MOST_ZOOM_ROWS, fitted.size)
    starts = np.arange(0, fitted.size - rows + 1, max(rows // 2, 1))
    spread = [float(np.std(fitted[start : start + rows])) for start in starts]
    begin = int(starts[int(np.argmax(spread))])
    return slice(begin, begin + rows)
