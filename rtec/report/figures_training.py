"""A comparison of predictors as a picture: errors against size, time and certainty, what they say and leave."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.errors import ArgumentError
from rtec.report.figures_learning import draw_courses, draw_spacings
from rtec.report.figures_predicted import COLOURS, draw_along, draw_between, draw_left
from rtec.report.figures_style import guide, magnitudes, new_figure
from rtec.report.palette import GREY, GUIDE_LINE, INK
from rtec.training.results import Kind

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rtec.training import PredictorComparison, Row

_ROW_INCH = 0.19
"""Height of a line of the list of predictors."""
_MARKS = "osD^vP"
"""Of the designs of one kind, in the order of their names."""


def training_figure(result: PredictorComparison) -> Figure:
    """Return the picture of a comparison.

    Above, the error of each predictor on the readings that judge, against the numbers that were fitted and against
    the time of the fit, and how many of these readings its interval holds. In the middle, what the best of each kind
    says along the axis and between the targets, and what the best predictor leaves. Below, how networks learned and
    which spacings of tables were tried.

    Raises
    ------
    ArgumentError
        No row has one.
    """
    rows = [row for row in result.ranked if row.works]
    if not rows:
        raise ArgumentError("figure", "no predictor has a figure", "one at least")
    list_inch = max(4.2, 1.0 + _ROW_INCH * len(result.rows))
    learned = _designs(rows)
    heights = [list_inch, 2.6, 2.4, *([2.6] if learned else []), 2.4]
    figure = new_figure(height_inch=sum(heights) + 0.7)
    # tick labels of logarithmic axes are wider than the layout takes them for
    figure.set_layout_engine("constrained", w_pad=0.12, h_pad=0.08)
    bands = figure.add_gridspec(len(heights), 1, height_ratios=heights)
    above = bands[0].subgridspec(2, 2, width_ratios=(1.0, 1.1))
    _draw_errors(figure.add_subplot(above[:, 0]), result)
    looks = _looks(rows)
    _draw_costs(figure.add_subplot(above[0, 1]), result, rows, looks, time=False)
    _draw_costs(figure.add_subplot(above[1, 1]), result, rows, looks, time=True)
    says = bands[1].subgridspec(1, 2, width_ratios=(1.0, 1.1))
    draw_along(figure.add_subplot(says[0]), result, rows[0])
    draw_between(figure.add_subplot(says[1]), result, rows)
    left = bands[2].subgridspec(1, 1 if result.pitch_mm is None else 2)
    for place, pitch_mm in enumerate((None,) if result.pitch_mm is None else (None, result.pitch_mm)):
        draw_left(figure.add_subplot(left[place]), result.parts.heldout, rows[0], pitch_mm)
    if learned:
        panels = bands[3].subgridspec(1, len(learned)).subplots(sharey=True, squeeze=False)[0]
        draw_courses(list(panels), learned)
    below = bands[-1].subgridspec(1, 2)
    draw_spacings(figure.add_subplot(below[0]), result)
    _draw_certainty(figure.add_subplot(below[1]), rows, looks)
    figure.draw_without_rendering()  # logarithmic axes know their labels, and so their margins, only once drawn
    return figure


def _designs(rows: list[Row]) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = {}
    for row in sorted((row for row in rows if row.courses), key=lambda row: row.name):
        found.setdefault(_design(row), []).append(row)
    return found


def _design(row: Row) -> str:
    """Return the name of a predictor without the way in which it was fitted."""
    return row.name.rsplit(" ", 1)[0] if row.kind in (Kind.NETWORK, Kind.TABLE) else row.name


def _draw_errors(axes: Axes, result: PredictorComparison) -> None:
    y = np.arange(len(result.rows))[::-1]
    shown: list[float] = []
    for place, row in zip(y, result.ranked, strict=True):
        colour = COLOURS[row.kind]
        if row.rms_heldout_mm is None or row.worst_heldout_mm is None:
            axes.text(0.99, place, "no figure", transform=axes.get_yaxis_transform(), color=GREY, fontsize=7.5,
                      ha="right", va="center")  # fmt: skip
            continue
        shown += [1e3 * row.rms_heldout_mm, 1e3 * row.worst_heldout_mm]
        axes.plot(shown[-2:], [place, place], color=colour, linewidth=0.8, alpha=0.5)
        axes.plot(shown[-2], place, "o", color=colour, markersize=5.5)
        axes.plot(shown[-1], place, "|", color=colour, markersize=8)
    names = ["none (no correction)" if row.kind is Kind.NONE else row.name for row in result.ranked]
    axes.set_yticks(y, names, fontsize=7.5)
    axes.set_ylim(-0.7, y.size - 0.3)
    dashed = "; dashed: repeatability" if result.noise_mm else ""
    axes.set_xlabel(f"error, µm: RMS (dot), largest (bar){dashed}")
    where = "at places held out" if result.parts.heldout_by == "places" else "of the other file"
    axes.set_title(f"Error on the readings {where}")
    if result.noise_mm:
        guide(axes, x=1e3 * result.noise_mm, colour=INK)
        shown.append(1e3 * result.noise_mm)
    magnitudes(axes, "x", shown)


def _looks(rows: list[Row]) -> dict[str, tuple[str, str]]:
    """Return colour and mark of each design: the kind has the colour."""
    looks: dict[str, tuple[str, str]] = {}
    for kind in dict.fromkeys(row.kind for row in rows):
        designs = sorted({_design(row) for row in rows if row.kind is kind})
        for place, design in enumerate(designs):
            looks[design] = COLOURS[kind], _MARKS[place % len(_MARKS)]
    return {name: looks[name] for name in sorted(looks)}


def _draw_costs(
    axes: Axes, result: PredictorComparison, rows: list[Row], looks: dict[str, tuple[str, str]], *, time: bool
) -> None:
    """Draw what a lower error costs: numbers that are fitted, or the time of the fit."""
    costs, errors = [], []
    for design, (colour, mark) in looks.items():
        these = [row for row in rows if _design(row) == design]
        x = [float(row.train_s or 0.0) if time else float(row.parameters or 0) for row in these]
        x = [max(value, 1e-3 if time else 1.0) for value in x]
        y = [1e3 * (row.rms_heldout_mm or 0.0) for row in these]
        axes.plot(x, y, mark, color=colour, markersize=5.5, alpha=0.8, label=design)
        costs += x
        errors += y
    if result.noise_mm:
        guide(axes, y=1e3 * result.noise_mm, colour=INK)
        axes.plot([], [], color=INK, linewidth=1.0, linestyle=GUIDE_LINE, label="repeatability")
        errors.append(1e3 * result.noise_mm)
    axes.set_xlabel("time of the fit, s" if time else "numbers fitted")
    axes.set_ylabel("error, RMS, µm")
    axes.set_title("Error against time" if time else "Error against size")
    magnitudes(axes, "x", costs)
    magnitudes(axes, "y", errors)
    if not time:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7.5, handletextpad=0.5)


def _draw_certainty(axes: Axes, rows: list[Row], looks: dict[str, tuple[str, str]]) -> None:
    """Draw the interval of each predictor and how many of the readings that judge lie in it."""
    sure = [row for row in rows if row.interval_mm is not None and np.isfinite(row.interval_mm)]
    widths = [1e3 * (row.interval_mm or 0.0) for row in sure]
    for row, width in zip(sure, widths, strict=True):
        colour, mark = looks[_design(row)]
        axes.plot(width, 100.0 * (row.coverage or 0.0), mark, color=colour, markersize=5.5, alpha=0.8)
    guide(axes, y=90.0, colour=INK)
    lowest = min([100.0 * (row.coverage or 0.0) for row in sure], default=90.0)
    axes.set_ylim(min(80.0, lowest - 3.0), 102.0)
    axes.set(xlabel="half width of the interval, µm", ylabel="readings within, %")
    axes.set_title("How sure: intervals for 90 % of the readings")
    magnitudes(axes, "x", widths)
    if not sure:
        axes.text(0.5, 0.2, "too few places for an interval", transform=axes.transAxes, ha="center", color=INK)
