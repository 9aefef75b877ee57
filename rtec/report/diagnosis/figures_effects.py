"""Each effect in the data: readings less everything else, the model's curve, and what is left."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Floats
from rtec.inference.curves import at_places, contribution_curve
from rtec.inference.fit import values_of
from rtec.inference.local_means import Sequence, neighbour_means, sequence_of
from rtec.inference.model import Model
from rtec.inference.results import NoiseFloor
from rtec.report.diagnosis.effect_panels import Panel, effect_panels
from rtec.report.diagnosis.quantities import named_texts, shown_in
from rtec.report.diagnosis.readings import (
    ALL,
    AT_REST,
    BACKWARD,
    FEWEST_FOR_MEANS,
    Rows,
    Way,
    figure_text,
    residual,
    some_rows,
)
from rtec.report.diagnosis.sentence import spoken, term_words
from rtec.report.figures_style import new_figure
from rtec.report.palette import BAND, GUIDE, INK, NEUTRAL, PAPER

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_FINE = 400
_MOST_DOTS = 500
"""Of a direction in a panel."""
_MOST_OF_PATH = 3000
_WITHIN = (0.5, 99.5)
"""Percentiles of the readings that a panel shows at least."""
_FAR = 1.5
"""Times the span of these, over which the few readings beyond would leave too little room for the rest."""
_MARGIN = 0.06
"""Of the span of an axis, that is left free at its ends."""
_MOST_LETTERS = {1: 130, 2: 60}
"""Of a title, by the number of columns."""


def components_figure(dataset: Dataset, model: Model, noise: NoiseFloor) -> Figure | None:
    """Return for each effect the readings less all other effects with the model's curve, and what is left below.

    Returns
    -------
    Figure
        An upper and a lower one for each panel, in this order; None where the model has no effect.
    """
    panels = effect_panels(dataset, model)
    if not panels:
        return None
    columns = 1 if len(panels) == 1 else 2
    rows = math.ceil(len(panels) / columns)
    lines = max(2, *(len(panel.terms) for panel in panels))
    figure = new_figure((3.1 + 0.15 * (lines - 1)) * rows + 0.5)
    grid = figure.add_gridspec(2 * rows, columns, height_ratios=[2.3, 1.0] * rows)
    left = residual(dataset, model)
    words = "without the others" if len(panels) > 1 else dataset.observe
    for k, panel in enumerate(panels):
        row, column = divmod(k, columns)
        upper = figure.add_subplot(grid[2 * row, column])
        lower = figure.add_subplot(grid[2 * row + 1, column], sharex=upper)
        _upper(upper, dataset, panel, left, noise, words)
        _lower(lower, dataset, panel, left, noise)
        upper.set_title(_title(panel, model, _MOST_LETTERS[columns]), fontsize=9.0, linespacing=1.25)
    shown = {
        label: handle for axes in figure.axes for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(shown.values(), shown.keys(), loc="outside upper left", ncols=6)
    return figure


def _title(panel: Panel, model: Model, most: int) -> str:
    """Return the effects with as many of their numbers as there is room for, as cards and tables have them."""
    room = 2 if len(panel.terms) == 1 else 1
    lines: list[str] = []
    for term in panel.terms:
        name = spoken(term.name)
        measured = tuple(value for value in values_of(term, model) if value.unit)
        texts = [text if number == name else f"{number} {text}" for number, text in named_texts(measured)]
        lines += _filled(f"{term_words(term)}:", texts, most)[:room]
    return "\n".join(figure_text(line, most) for line in lines)


def _filled(head: str, texts: list[str], most: int) -> list[str]:
    """Return texts behind a head, as many to a line as it holds.

    Examples
    --------
    >>> _filled("map:", ["mean 8 µm", "least 7 µm", "largest 9 µm"], 26)
    ['map: mean 8 µm, least 7 µm', 'largest 9 µm']
    """
    lines = [head]
    for text in texts:
        mark = " " if lines == [head] else ", "
        if len(lines[-1] + mark + text) <= most:
            lines[-1] += mark + text
        else:
            lines.append(text)
    return lines if texts else [head.removesuffix(":")]


def _upper(axes: Axes, dataset: Dataset, panel: Panel, left: Floats, noise: NoiseFloor, words: str) -> None:
    """Draw the readings without all other effects, and the model."""
    shown = shown_in(dataset.units, float(np.std((panel.part + left)[panel.rows])))
    part, whole = panel.part * shown.factor, (panel.part + left) * shown.factor
    axes.axhline(0.0, color=GUIDE, linewidth=0.9, zorder=1)
    if panel.is_path:
        _path(axes, panel, part, whole)
    for way in panel.groups:
        label = "data" if way.label == ALL else way.label
        _readings(axes, panel, whole, way, sequence_of(dataset, noise), label)
    everything = Way(label=ALL, colour=NEUTRAL, marker="o", dash="-", rows=panel.rows)
    for way in () if panel.is_path else panel.groups if panel.by_group else (everything,):
        if way.label != AT_REST:
            _curve(axes, dataset.coordinates, panel, part, way, shown.factor)
    x = panel.over.values[panel.rows]
    low, high = np.percentile(x, _WITHIN)
    if panel.period is not None:
        low, high = 0.0, 1.0  # the whole wave, wherever the targets meet it
    elif float(np.ptp(x)) <= _FAR * (high - low):
        low, high = float(x.min()), float(x.max())
    if high > low:
        axes.set_xlim(low - _MARGIN * (high - low), high + _MARGIN * (high - low))
    _limits(axes, whole[panel.rows], part[panel.rows][(x >= low) & (x <= high)])
    axes.tick_params(labelbottom=False)
    axes.set_ylabel(f"{figure_text(words, 30)} ({shown.symbol})")


def _lower(axes: Axes, dataset: Dataset, panel: Panel, left: Floats, noise: NoiseFloor) -> None:
    """Draw what is left, between two standard deviations of a reading to either side."""
    shown = shown_in(dataset.units, max(float(np.std(left[panel.rows])), noise.sigma))
    half, left = 2.0 * noise.sigma * shown.factor, left * shown.factor
    axes.axhspan(-half, half, color=BAND, zorder=0)
    axes.axhline(0.0, color=GUIDE, linewidth=0.9, zorder=1)
    for way in panel.groups:
        _readings(axes, panel, left, way, sequence_of(dataset, noise))
    _limits(axes, left[panel.rows], np.array([-half, half]))
    axes.set_ylabel(f"left ({shown.symbol})")
    axes.set_xlabel(panel.over.label)


def _limits(axes: Axes, data: Floats, also: Floats) -> None:
    """Let an axis show nearly all readings and all of the model: a few far ones would flatten the rest."""
    low, high = np.percentile(data, _WITHIN)
    low, high = min(float(low), float(also.min())), max(float(high), float(also.max()))
    if high > low:
        axes.set_ylim(low - _MARGIN * (high - low), high + _MARGIN * (high - low))


def _readings(axes: Axes, panel: Panel, y: Floats, way: Way, sequence: Sequence, label: str | None = None) -> None:
    """Draw readings pale, and means of neighbours on top of them where they are many."""
    x, rows = panel.over.values, way.rows & panel.rows
    some = some_rows(rows, _MOST_DOTS)
    in_no_order = not panel.is_path and panel.over.name != "order" and way.label != AT_REST
    means = in_no_order and int(rows.sum()) > FEWEST_FOR_MEANS
    axes.plot(x[some], y[some], linestyle="none", marker=way.marker, markersize=3.0, markeredgewidth=0.0,
              color=way.colour, alpha=0.3 if means else 0.6, zorder=2, label=label)  # fmt: skip
    if means:
        line = neighbour_means(x[rows], y[rows], sequence=sequence.take(rows))
        axes.errorbar(line.at, line.mean, 2.0 * line.error, linestyle="none", marker=way.marker, markersize=4.0,
                      color=way.colour, markeredgecolor=PAPER, markeredgewidth=0.4, elinewidth=1.0, zorder=4,
                      label=None if label is None else "mean ± 2 s.e.")  # fmt: skip


def _curve(axes: Axes, c: Conditions, panel: Panel, part: Floats, way: Way, factor: float) -> None:
    """Draw the model: a wave between the readings, too; else what it is at them, joined."""
    rows = way.rows & panel.rows
    if not rows.any():
        return
    if panel.period is not None:
        x = np.linspace(0.0, 1.0, _FINE)
        places = at_places(c, x * panel.period, way.rows)
        y = np.sum([term.contribution(places) for term in panel.terms], axis=0) * factor
    else:
        x, y = contribution_curve(panel.over.values[rows], part[rows])
    label = "model, backward" if way.label == BACKWARD else "model"
    axes.plot(x, y, color=INK, linestyle=way.dash, linewidth=1.4, zorder=5, label=label)


def _path(axes: Axes, panel: Panel, part: Floats, whole: Floats) -> None:
    """Draw readings and model joined in their order: loops stay loops."""
    numbers: Rows = np.flatnonzero(panel.rows)
    numbers = numbers[:: max(1, math.ceil(numbers.size / _MOST_OF_PATH))]
    x = panel.over.values[numbers]
    axes.plot(x, whole[numbers], color=GUIDE, linewidth=0.7, zorder=1)
    axes.plot(x, part[numbers], color=INK, linewidth=1.2, zorder=5, label="model")
