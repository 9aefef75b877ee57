"""Sobol indices drawn: for each result which share of its variance each parameter makes, with intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rtec.report.figures_campaign import words_of
from rtec.report.figures_style import WIDTH_INCH, new_figure
from rtec.report.palette import BLUE, INK, LIGHT
from rtec.verify.campaign.sensitivity import SobolIndex

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ACROSS = 3
_ROW_INCH, _PANEL_INCH, _LEGEND_INCH, _LETTER_INCH, _BELOW_INCH = 0.17, 0.6, 0.35, 0.075, 0.45


def combinations(indices: Sequence[SobolIndex]) -> dict[str, list[SobolIndex]]:
    """Return the indices of each combination of the grid, by its values in words."""
    found: dict[str, list[SobolIndex]] = {}
    for one in indices:
        found.setdefault(", ".join(map(words_of, one.where.values())), []).append(one)
    return found


def sobol_figure(indices: Sequence[SobolIndex]) -> Figure:
    """Draw a panel for each result, and in it two bars for each parameter: first order and total.

    Parameters
    ----------
    indices
        Of one combination, at least one. The parameter with the largest total of any result stands on top.
    """
    results, largest = dict.fromkeys(one.of for one in indices), dict[str, float]()
    for one in indices:
        largest[one.parameter] = max(one.total, largest.get(one.parameter, -math.inf))
    parameters = sorted(largest, key=lambda name: -largest[name])
    lines = math.ceil(len(results) / _ACROSS)
    rows_inch = _ROW_INCH * len(parameters)
    height_inch = _LEGEND_INCH + lines * (_PANEL_INCH + rows_inch) + _BELOW_INCH
    figure = new_figure(height_inch)
    figure.set_layout_engine("none")  # a constrained layout cuts the longest names off
    room = {
        "left": (_LETTER_INCH * max(map(len, parameters)) + 0.15) / WIDTH_INCH, "right": 0.98, "wspace": 0.06,
        "top": 1.0 - (_LEGEND_INCH + 0.3) / height_inch, "bottom": _BELOW_INCH / height_inch,
        "hspace": _PANEL_INCH / rows_inch,
    }  # fmt: skip
    panels = figure.subplots(lines, _ACROSS, sharex=True, sharey=True, squeeze=False, gridspec_kw=room).ravel()
    for axes, result in zip(panels, results, strict=False):
        _panel(axes, {one.parameter: one for one in indices if one.of == result}, parameters)
        axes.set_title(result)
    for axes in panels[len(results) :]:
        axes.remove()
    panels[0].set_yticks(range(len(parameters)), parameters)
    panels[0].set_ylim(len(parameters) - 0.4, -0.6)
    panels[0].set_xlim(-0.1, 1.2)
    figure.supxlabel("share of the variance, with intervals of 95 %", y=0.02 / height_inch, fontsize=9)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="upper center", ncols=2)
    return figure


def _panel(axes: Axes, of_parameter: dict[str, SobolIndex], parameters: Sequence[str]) -> None:
    shown = [of_parameter[name] for name in parameters]
    at = np.arange(len(parameters))
    for share, interval, place, colour, label in (
        ([one.first for one in shown], [one.first_95 for one in shown], -0.2, LIGHT, "first order: alone"),
        ([one.total for one in shown], [one.total_95 for one in shown], 0.2, BLUE, "total: alone and with others"),
    ):
        axes.barh(at + place, share, 0.36, color=colour, label=label)
        for y, ends in zip(at + place, interval, strict=True):
            if ends is not None:
                axes.plot(ends, [y, y], color=INK, linewidth=0.7)
    axes.tick_params(axis="y", length=0, labelsize=7.5)
