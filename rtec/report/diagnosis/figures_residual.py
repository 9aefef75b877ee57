"""What a model leaves, against everything that it may depend on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Floats
from rtec.inference.local_means import Sequence, neighbour_means, sequence_of
from rtec.inference.model import Model
from rtec.inference.results import NoiseFloor, Unknown
from rtec.report.diagnosis.quantities import shown_in
from rtec.report.diagnosis.readings import (
    AT_REST,
    FEWEST_FOR_MEANS,
    Abscissa,
    abscissas,
    figure_text,
    periods_of,
    residual,
    some_rows,
    ways,
)
from rtec.report.figures_style import legend_above, new_figure
from rtec.report.palette import BAND, GUIDE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLUMNS = 2
_MOST_PANELS = 10
_WITHIN = 99.7
"""Share of the readings, in per cent, that the panels show at least."""


def residual_panels(
    dataset: Dataset, model: Model, noise: NoiseFloor, unknown: Unknown | None = None
) -> Figure | None:
    """Return the residual against each column, with a smoothed mean by direction; None where nothing varies."""
    c = dataset.coordinates
    periods = periods_of(model, c, None if unknown is None else unknown.period)
    panels = (abscissas(c, periods) + _unknown_columns(dataset, unknown))[:_MOST_PANELS]
    if not panels:
        return None
    left = residual(dataset, model)
    shown = shown_in(dataset.units, max(float(np.std(left)), noise.sigma))
    left = left * shown.factor
    limit = max(float(np.percentile(np.abs(left), _WITHIN)), 3.0 * noise.sigma * shown.factor)
    rows = math.ceil(len(panels) / _COLUMNS)
    figure = new_figure(2.35 * rows + 0.5)
    grid = figure.subplots(rows, _COLUMNS, sharey=True, squeeze=False)
    sequence = sequence_of(dataset, noise)
    for axes, panel in zip(grid.flat, panels, strict=False):
        _panel(axes, panel, c, left, sequence, 2.0 * noise.sigma * shown.factor)
    for axes in grid.flat[len(panels) :]:
        axes.remove()
    for first in grid[:, 0]:
        first.set_ylabel(f"residual ({shown.symbol})")
    if limit > 0.0:
        grid[0, 0].set_ylim(-1.1 * limit, 1.1 * limit)
    beyond = int((np.abs(left) > 1.1 * limit).sum())
    if beyond:
        grid[0, 0].set_title(f"{beyond} of {left.size} readings lie beyond the panels", fontsize=8.5)
    legend_above(figure, grid[0, 0], 6)
    return figure


def _unknown_columns(dataset: Dataset, unknown: Unknown | None) -> list[Abscissa]:
    """Return the columns of unknown meaning that the residual was found to depend on."""
    wanted = () if unknown is None else unknown.depends_on
    return [
        Abscissa(name=name, label=f"column '{figure_text(name)}' (unit unknown)", values=values)
        for name, values in dataset.unknown
        if name in wanted and np.isfinite(values).all() and float(np.ptp(values)) > 0
    ]


def _panel(axes: Axes, panel: Abscissa, c: Conditions, left: Floats, sequence: Sequence, half: float) -> None:
    axes.axhspan(-half, half, color=BAND, zorder=0, label="noise of a reading, ± 2σ")
    axes.axhline(0.0, color=GUIDE, linewidth=0.9, zorder=1)
    for way in ways(c):
        rows = some_rows(way.rows)
        axes.plot(panel.values[rows], left[rows], linestyle="none", marker=way.marker, markersize=2.6,
                  markeredgewidth=0.0, color=way.colour, alpha=0.3, zorder=2)  # fmt: skip
        if way.label == AT_REST or int(way.rows.sum()) < FEWEST_FOR_MEANS:
            continue
        line = neighbour_means(panel.values[way.rows], left[way.rows], sequence=sequence.take(way.rows))
        band = 2.0 * line.error
        axes.fill_between(line.at, line.mean - band, line.mean + band, color=way.colour, alpha=0.3,
                          linewidth=0.0, zorder=3)  # fmt: skip
        axes.plot(line.at, line.mean, color=way.colour, linestyle=way.dash, linewidth=1.5, zorder=4,
                  label=f"{way.label}, mean of neighbours")  # fmt: skip
    axes.set_xlabel(panel.label)
