"""A learned curve: the readings less all effects, and the curve with its band."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects.curve import axis_label
from rtec.effects.quantities import quantity_of, unit_of
from rtec.inference.results import LearnedCurve
from rtec.readable import rounded
from rtec.report.diagnosis.quantities import shown_in
from rtec.report.diagnosis.readings import figure_text, some_rows
from rtec.report.figures_style import legend_above, new_figure
from rtec.report.palette import FORWARD, GREEN, MEASURED, NEUTRAL, PURPLE, REVERSE
from rtec.units import symbol

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LOUD = 0.25
_ACROSS = (GREEN, NEUTRAL, PURPLE)
_WAYS = {1: ("forward", FORWARD), -1: ("backward", REVERSE), 0: ("both directions", NEUTRAL)}


def curve_figure(dataset: Dataset, curve: LearnedCurve | None) -> Figure | None:
    """Return the curve over its quantity with a band of two standard errors, above the readings less all effects.

    Of a curve over two quantities three cuts at the least, the middle and the largest of the second.
    """
    if curve is None:
        return None
    c, shape = dataset.coordinates, curve.shape
    over = quantity_of(c, shape.over)
    term = next(t for t in curve.model.terms if t.name == "curve")
    part = term.component(dataset)
    left = dataset.observed - curve.model.predict(dataset) + part
    left = left - left.mean()
    shown = shown_in(dataset.units, float(np.ptp(curve.values)))
    figure = new_figure(4.6)
    axes = figure.add_subplot()
    if over is not None:
        rows = some_rows(np.isfinite(over))
        axes.plot(over[rows], left[rows] * shown.factor, ".", color=MEASURED, markersize=3, zorder=1,
                  label="readings less all effects")  # fmt: skip
    level = 0.0 if over is None else float(np.mean(left))
    for k, way in enumerate(curve.ways):
        for j, place in enumerate(curve.across):
            word, colour = _WAYS[way]
            if shape.across:
                unit = unit_of(c, shape.across)
                what = shape.across.replace("_", " ")
                word = f"{what} {rounded(float(place), 3)} {symbol(unit) if unit else ''}".strip()
                word, colour = f"{word}{f', {_WAYS[way][0]}' if way else ''}", _ACROSS[j]
            line = (curve.values[k, j] + level) * shown.factor
            half = 2.0 * curve.errors[k, j] * shown.factor
            dash = "--" if shape.across and way < 0 else "-"
            axes.fill_between(curve.at, line - half, line + half, color=colour, alpha=_LOUD, linewidth=0, zorder=2)
            axes.plot(curve.at, line, dash, color=colour, linewidth=1.8, zorder=3, label=figure_text(word))
    axes.set_xlabel(figure_text(axis_label(c, shape.over)))
    axes.set_ylabel(f"learned curve ({shown.symbol})")
    legend_above(figure, axes, 4)
    return figure
