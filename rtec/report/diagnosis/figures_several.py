"""Several measurements beside each other: what was measured in each, and how much is left of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.inference.local_means import neighbour_means
from rtec.inference.results import Diagnosis
from rtec.report.appearance import printable
from rtec.report.diagnosis.quantities import Shown, shown_for
from rtec.report.diagnosis.readings import position_label
from rtec.report.figures_style import new_figure
from rtec.report.palette import GUIDE, SERIES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rtec.report.diagnosis.several import Results

_LONGEST = 28
SEVERAL_CAPTION = (
    "Left, the mean of the readings at each place, forward solid and backward dashed, a colour for each measurement. "
    "Right, in the same colours, the RMS of what was measured, of what the effects leave, and of a reading's noise."
)


def several_figure(results: Results) -> Figure:
    """Return the mean readings of each measurement along the axis, and the RMS measured, left and of the noise.

    More than eight share colours.

    Returns
    -------
    Figure
        Two panels, drawn within ``figure_style``.
    """
    figure = new_figure(4.6)
    along, bars = figure.subplots(1, 2, width_ratios=(2.0, 1.0))
    shown = shown_for(next(iter(results.values())).dataset)
    for number, (name, one) in enumerate(results.items()):
        _along(along, one.dataset, shown, _short(name), SERIES[number % len(SERIES)])
    first = next(iter(results.values())).dataset
    along.set(xlabel=position_label(first.conditions), ylabel=f"{printable(first.observe)} ({shown.symbol})")
    along.axhline(0.0, color=GUIDE, linewidth=0.8)
    along.set_title("mean at each place: forward solid, backward dashed")
    along.legend(loc="best")
    _bars(bars, results, shown)
    return figure


def _short(name: str) -> str:
    text = printable(name)
    return text if len(text) <= _LONGEST else "..." + text[3 - _LONGEST :]


def _along(axes: Axes, dataset: Dataset, shown: Shown, label: str, colour: str) -> None:
    c = dataset.conditions
    ways = np.ones(dataset.rows) if c.direction is None else np.sign(c.direction)
    for way, dash in ((1.0, "-"), (-1.0, "--"), (0.0, ":")):
        rows = ways == way
        if not rows.any():
            continue
        means = neighbour_means(c.position[rows], dataset.observed[rows])
        shown_label = label if way == ways.max() else None
        axes.plot(means.at, means.mean * shown.factor, dash, color=colour, linewidth=1.2, label=shown_label)


def _bars(axes: Axes, results: Results, shown: Shown) -> None:
    heads = ("measured", "left", "noise")
    width = 0.8 / len(results)
    for number, one in enumerate(results.values()):
        left = one.rms_after if isinstance(one, Diagnosis) else one.rms
        measured = one.dataset.rms(one.dataset.observed)
        values = [shown.number(value) or 0.0 for value in (measured, left, one.noise.floor)]
        at = np.arange(len(heads)) + (number - (len(results) - 1) / 2) * width
        axes.bar(at, values, width * 0.9, color=SERIES[number % len(SERIES)])
    axes.set_xticks(range(len(heads)), heads)
    axes.set(ylabel=f"RMS ({shown.symbol})", ylim=(0.0, None))
    axes.set_title("how much of it")
    axes.grid(visible=False, axis="x")
