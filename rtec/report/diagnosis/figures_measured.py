"""Measured against model: over position by direction, or over time in a moving log."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.effects import Conditions, Floats
from rtec.report.diagnosis.quantities import shown_of
from rtec.report.diagnosis.readings import (
    BAND,
    FORWARD,
    NEUTRAL,
    REVERSE,
    Way,
    clock,
    figure_text,
    outline,
    period_of,
    position_label,
    residual,
    smoothed_places,
    some_rows,
    ways,
)
from rtec.report.figures_style import GUIDE, legend_above, new_figure
from rtec.twin.dataset import Dataset
from rtec.twin.model import Model
from rtec.twin.results import NoiseFloor

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ZOOM_ROWS = 600
_FEW_PLACES = 400
_PERIOD_GAPS = 6.0
"""Periods below so many distances between targets are drawn between the targets, too."""
_FINE = 2000


def measured_figure(dataset: Dataset, model: Model, noise: NoiseFloor) -> Figure:
    """Return readings and model, with two standard deviations of a reading to either side of the model."""
    c = dataset.coordinates
    return (
        _over_time(dataset, c, model, noise)
        if c.moving and c.time_s is not None
        else _over_place(dataset, c, model, noise)
    )


def _over_place(dataset: Dataset, c: Conditions, model: Model, noise: NoiseFloor) -> Figure:
    shown = shown_of(dataset.units)
    figure = new_figure(6.0)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[1.5, 1.0])
    left = residual(dataset, model)
    fitted = dataset.observed - left
    for way in ways(c):
        _dots(upper, c.position, dataset.observed * shown.factor, way)
        at, line = _model_line(dataset, c, model, fitted, way)
        _model(upper, at, line * shown.factor, 2 * noise.sigma * shown.factor, way)
        _dots(lower, c.position, left * shown.factor, way)
    lower.axhspan(-2 * noise.sigma * shown.factor, 2 * noise.sigma * shown.factor, color=BAND, zorder=0)
    lower.axhline(0.0, color=GUIDE, linewidth=0.9, zorder=1)
    upper.set_ylabel(f"{figure_text(dataset.observe)} ({shown.symbol})")
    lower.set_ylabel(f"measured less model ({shown.symbol})")
    lower.set_xlabel(position_label(c))
    legend_above(figure, upper, 6)
    return figure


def _dots(axes: Axes, x: Floats, y: Floats, way: Way) -> None:
    rows = some_rows(way.rows)
    axes.plot(x[rows], y[rows], linestyle="none", marker=way.marker, markersize=3.6, markeredgewidth=0.0,
              color=way.colour, alpha=0.55, label=f"measured, {way.label}", zorder=3)  # fmt: skip


def _model(axes: Axes, at: Floats, line: Floats, half: float, way: Way) -> None:
    many = at.size >= _FINE
    axes.plot(*outline(at, line), color=way.colour, linestyle="-" if many else way.dash,
              linewidth=0.7 if many else 1.1, alpha=0.6 if many else 1.0, zorder=2,
              label=f"model, {way.label}")  # fmt: skip
    if at.size <= 2 * _FINE:
        axes.fill_between(at, line - half, line + half, color=way.colour, alpha=0.15, linewidth=0.0, zorder=1,
                          label="± 2σ of a reading" if way.marker != "v" else None)  # fmt: skip


def _model_line(dataset: Dataset, c: Conditions, model: Model, fitted: Floats, way: Way) -> tuple[Floats, Floats]:
    """Return the model over places, mean of all runs; what is periodic also between targets that stand far apart."""
    means = smoothed_places(c.position[way.rows], fitted[way.rows])
    reach = _reach(means.at)
    periodic = [term for term in model.terms if term.fitted and (period_of(term) or reach) < reach]
    # nothing filtered: the conditions are those of the readings
    if not periodic or means.at.size > _FEW_PLACES or dataset.conditions.rows != dataset.rows:
        return means.at, means.mean
    fine = np.union1d(means.at, np.linspace(means.at[0], means.at[-1], _FINE))
    direction = None if c.direction is None else np.full(fine.size, float(np.sign(c.direction[way.rows].mean())))
    between = Conditions(
        position=fine, position_unit=c.position_unit, run=np.ones(fine.size, dtype=np.int64), direction=direction,
        screw_pitch=c.screw_pitch, signal_period=c.signal_period, revolution=c.revolution,
    )  # fmt: skip
    waves = np.sum([term.contribution(between) for term in periodic], axis=0)
    slow = means.mean - np.interp(means.at, fine, waves)
    return fine, np.interp(fine, means.at, slow) + waves


def _reach(places: Floats) -> float:
    return _PERIOD_GAPS * float(np.median(np.diff(places))) if places.size > 1 else 0.0


def _over_time(dataset: Dataset, c: Conditions, model: Model, noise: NoiseFloor) -> Figure:
    shown, time = shown_of(dataset.units), clock(c)
    figure = new_figure(6.4)
    whole, zoom, lower = figure.subplots(3, 1, height_ratios=[1.0, 1.2, 0.8])
    left = residual(dataset, model) * shown.factor
    measured, half = dataset.observed * shown.factor, 2 * noise.sigma * shown.factor
    middle = _stretch(measured - left)
    for axes, rows in ((whole, slice(None)), (zoom, middle)):
        t, seen, fitted = time.values[rows], measured[rows], (measured - left)[rows]
        axes.plot(*outline(t, seen), color=NEUTRAL, linewidth=0.8, label="measured")
        axes.plot(*outline(t, fitted), color=REVERSE, linewidth=1.0, label="model")
        if axes is zoom:
            axes.fill_between(t, fitted - half, fitted + half, color=REVERSE, alpha=0.22, linewidth=0.0,
                              label="noise band")  # fmt: skip
        axes.set_ylabel(f"{figure_text(dataset.observe)} ({shown.symbol})")
    whole.axvspan(time.values[middle][0], time.values[middle][-1], color=FORWARD, alpha=0.15, label="stretch below")
    lower.axhspan(-half, half, color=BAND, zorder=0)
    lower.plot(*outline(time.values, left), color=FORWARD, linewidth=0.7)
    lower.set_ylabel(f"measured less\nmodel ({shown.symbol})")
    lower.set_xlabel(time.label)
    legend_above(figure, whole, 4)
    return figure


def _stretch(fitted: Floats) -> slice:
    """Return the rows of a stretch in which the model changes most, of those that can be read in a figure."""
    if fitted.size <= _ZOOM_ROWS:
        return slice(0, fitted.size)
    starts = np.arange(0, fitted.size - _ZOOM_ROWS + 1, _ZOOM_ROWS // 2)
    spread = [float(np.std(fitted[start : start + _ZOOM_ROWS])) for start in starts]
    begin = int(starts[int(np.argmax(spread))])
    return slice(begin, begin + _ZOOM_ROWS)
