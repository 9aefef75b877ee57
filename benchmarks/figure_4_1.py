"""Table 4-1 as learning curves: the sum of squares after each epoch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rtec.predictors.fitting.algorithms import Algorithm
from rtec.report.figures_learning import ALGORITHMS
from rtec.report.figures_style import guide, new_figure
from rtec.report.palette import INK

Courses = Mapping[Algorithm, Sequence[Sequence[float]]]
"""Of each start of each algorithm: the sum of squares before the first epoch and after each, in square inches."""


def learning_figure(panels: Mapping[str, Courses], *, goal: float, published: Mapping[Algorithm, float]) -> Figure:
    """Return a panel for each title: the median of the starts and all of them, and the published mean at the edge."""
    figure = new_figure(3.5)
    every = figure.subplots(1, len(panels), sharey=True)
    for axes, (title, courses) in zip(every, panels.items(), strict=True):
        for algorithm, starts in courses.items():
            _draw(axes, algorithm, starts)
            axes.plot(1.0, published[algorithm], "<", color=ALGORITHMS[algorithm][0], markersize=7.0, clip_on=False,
                      transform=axes.get_yaxis_transform())  # fmt: skip
        axes.plot([], [], "<", color=INK, linestyle="none", label="mean at the end in the thesis")
        guide(axes, y=goal)
        axes.text(1.0, goal, "goal", va="bottom")
        axes.set(xscale="log", yscale="log", xlabel="epoch", title=title)
    every[0].set_ylabel("sum of squared errors\nso far, square inch")
    figure.legend(*every[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return figure


def _draw(axes: Axes, algorithm: Algorithm, starts: Sequence[Sequence[float]]) -> None:
    """Draw the median and the range of the lowest so far; a start that has ended counts on with its last value."""
    colour, line = ALGORITHMS[algorithm]
    last = max(map(len, starts))
    squares = np.array([np.pad(course, (0, last - len(course)), mode="edge")[1:] for course in starts])
    squares = np.minimum.accumulate(squares, axis=1)
    epochs = np.arange(1, last)
    axes.fill_between(epochs, squares.min(axis=0), squares.max(axis=0), color=colour, alpha=0.15, linewidth=0.0)
    axes.plot(epochs, np.median(squares, axis=0), line, color=colour, label=algorithm.title)
