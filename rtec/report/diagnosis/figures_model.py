"""Which effects are collinear on the plan, and what would separate rivals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.inference.collinear import COLLINEAR, nested
from rtec.inference.results import Cosines, Experiment
from rtec.report.diagnosis.quantities import shown_for
from rtec.report.diagnosis.readings import figure_text
from rtec.report.diagnosis.sentence import spoken
from rtec.report.figures_style import legend_above, new_figure
from rtec.report.palette import ALARM, ALIKE_COLOURS, EDGE, GUIDE, INK, NEUTRAL, PAPER, RIVALS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_NAMES = 24


def cosines_figure(cosines: Cosines | None) -> Figure | None:
    """Return how alike the effects look on this plan, the size of the cosine in every cell."""
    if cosines is None or len(cosines.names) < 2:
        return None
    from matplotlib.colors import LinearSegmentedColormap  # noqa: PLC0415 - half a second, needed only to draw

    names = [spoken(name) for name in cosines.names[:_MOST_NAMES]]
    size = len(names)
    table = np.abs(cosines.cosine[:size, :size])
    below = np.where(np.tri(size, k=-1, dtype=np.bool_) & np.isfinite(table), table, np.nan)
    figure = new_figure(min(0.36 * size + 1.6, 9.5))
    axes = figure.add_subplot()
    blues = LinearSegmentedColormap.from_list("alike", ALIKE_COLOURS)
    image = axes.imshow(below[1:, :-1], cmap=blues, vmin=0.0, vmax=1.0, aspect="auto")
    for i in range(1, size):
        for j in range(i):
            _cell(axes, j, i - 1, float(below[i, j]), nested(cosines.names[i], cosines.names[j]))
    axes.set_xticks(np.arange(size - 1), [figure_text(name) for name in names[:-1]], rotation=45, ha="right")
    axes.set_yticks(np.arange(size - 1), [figure_text(name) for name in names[1:]])
    axes.tick_params(length=0)
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    bar = figure.colorbar(image, ax=axes, shrink=0.7, pad=0.02)
    bar.set_label("size of the cosine")
    return figure


def _cell(axes: Axes, column: int, row: int, value: float, special: bool) -> None:
    from matplotlib.patches import Rectangle  # noqa: PLC0415 - as above

    if not np.isfinite(value):
        axes.text(column, row, "–", ha="center", va="center", fontsize=7.5, color=EDGE)
        return
    alike = value > COLLINEAR
    text = f"{value:.2f}" if value < 0.995 or value == 1.0 else f"{value:.3f}"
    axes.text(column, row, text, ha="center", va="center", fontsize=7.5, weight="bold" if alike else "normal",
              color=PAPER if value > 0.72 else INK)  # fmt: skip
    if alike:
        axes.add_patch(
            Rectangle(
                (column - 0.47, row - 0.44),
                0.94,
                0.88,
                fill=False,
                edgecolor=INK if special else ALARM,
                linestyle=":" if special else "-",
                linewidth=1.8,
            )
        )


def experiment_figure(experiment: Experiment, dataset: Dataset) -> Figure | None:
    """Return what the rivals predict for the suggested experiment; None where there is no prediction."""
    if experiment.abscissa is None or not experiment.predictions:
        return None
    shown = shown_for(dataset)
    figure = new_figure(3.6)
    axes = figure.add_subplot()
    axes.axhline(0.0, color=GUIDE, linewidth=0.9, zorder=1)
    x = np.asarray(experiment.abscissa, dtype=np.float64)
    for k, (name, values) in enumerate(zip(experiment.rivals, experiment.predictions, strict=False)):
        colour, dash = RIVALS[k % len(RIVALS)] if k < len(RIVALS) else (NEUTRAL, "-")
        axes.plot(x, np.asarray(values) * shown.factor, color=colour, linestyle=dash, linewidth=1.7,
                  marker="o" if x.size <= 40 else "", markersize=3.5, label=figure_text(spoken(name)))  # fmt: skip
    axes.set_xlabel(figure_text(experiment.label, 80))
    axes.set_ylabel(f"predicted {figure_text(dataset.observe)} ({shown.symbol})")
    legend_above(figure, axes, 4)
    return figure
