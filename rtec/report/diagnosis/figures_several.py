"""Several measurements beside each other: what was measured in each, and how much is left of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.inference.changes import Change, Outcome
from rtec.inference.local_means import neighbour_means
from rtec.inference.results import Diagnosis
from rtec.report.appearance import printable
from rtec.report.diagnosis.quantities import Shown, shown_for
from rtec.report.diagnosis.readings import position_label
from rtec.report.diagnosis.sentence import spoken
from rtec.report.figures_style import new_figure
from rtec.report.palette import BAND, FORWARD, GUIDE, PAPER, SERIES
from rtec.units import symbol

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rtec.report.diagnosis.several import Changes, Results

_LONGEST = 28
SEVERAL_CAPTION = (
    "Left, the mean of the readings at each place, forward solid and backward dashed, a colour for each measurement. "
    "Right, in the same colours, the RMS of what was measured, of what the effects leave, and of a reading's noise."
)


PARAMETERS_CAPTION = (
    "Each parameter in the order of the measurements, with two standard errors; the grey band is the first, or what "
    "the model states. Filled marks differ from it."
)
_MOST_PARAMETERS = 9
_COLUMNS = 3


def parameters_figure(found: Changes, against: str) -> Figure | None:
    """Return each parameter over the measurements, what they are held against first; None where there is none."""
    names = list(found)
    each: dict[tuple[str, str], dict[str, Change]] = {}
    for name, of_file in found.items():
        for change in of_file:
            if change.first is not None and change.other is not None and change.difference is not None:
                each.setdefault((change.effect, change.parameter), {})[name] = change
    shown = list(each.items())[:_MOST_PARAMETERS]
    if not shown:
        return None
    columns = min(_COLUMNS, len(shown))
    rows = -(-len(shown) // columns)
    figure = new_figure(2.6 * rows + 0.6)
    every = figure.subplots(rows, columns, squeeze=False)
    for axes in every.flat[len(shown) :]:
        axes.set_visible(False)
    for axes, ((effect, parameter), changes) in zip(every.flat, shown, strict=False):
        first = next(iter(changes.values())).first
        assert first is not None  # noqa: S101 - asked above
        value, half = float(first.value), 2.0 * float(first.error or 0.0)
        axes.axhspan(value - half, value + half, color=BAND, linewidth=0)
        for k, name in enumerate(names):
            if name in changes and (other := changes[name].other) is not None:
                inside = FORWARD if changes[name].outcome is Outcome.DIFFERS else PAPER
                reach = 2.0 * float(other.error or 0.0)
                axes.errorbar(k, float(other.value), reach, fmt="o", color=FORWARD, capsize=3, markerfacecolor=inside)
        axes.set_xticks(range(len(names)), [_short(name)[:14] for name in names], rotation=30, ha="right")
        axes.set_xlim(-0.5, len(names) - 0.5)
        what = spoken(effect) if parameter in ("", effect) else f"{spoken(effect)}: {spoken(parameter)}"
        axes.set_title(what, fontsize=9)
        axes.set_ylabel(symbol(first.unit) if first.unit else "")
    return figure


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
