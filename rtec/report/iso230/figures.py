"""The plot of ISO 230-2: means of both directions with ± 2s, and A, E, M, B and R as dimensions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rtec.metrology import TargetFigures
from rtec.metrology.readings import Floats
from rtec.report.figures_positioning import share_scales
from rtec.report.figures_style import legend_above
from rtec.report.iso230.figure_table import DIRECTIONS, number_text
from rtec.report.iso230.sheet import SheetOfTest, SheetUnits
from rtec.report.palette import CENTRE_LINE, FORWARD, GUIDE, INK, LEADER, PAPER, REVERSE, REVERSE_LINE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

WAYS = (("forward", FORWARD, "^", "-"), ("backward", REVERSE, "v", REVERSE_LINE))
"""Name, colour, marker and line of each direction; the colours are told apart by colour-blind readers."""
_COLUMNS, _COLUMN_WIDTH = 1.035, 0.062
"""Where the first dimension stands beside the axes, and how far the next is, as shares of their width."""
_LAST_LETTER, _SIGNS = 0x52F, "–—…→↑↓▲▽"
"""Up to which letters, and which signs beyond, the font has: Latin, Greek and Cyrillic."""
_ROOM = 0.085
"""Share of the width that is left beside the first and the last target, for a label there."""
_ASIDE = 0.012
"""Share of the width by which B and R stand beside their target, so that they do not hide what they measure."""


def drawable(text: str) -> str:
    """Return text without signs that the figures' font lacks.

    Examples
    --------
    >>> drawable("Achse Ж, 軸")
    'Achse Ж, ?'
    """
    return "".join(sign if ord(sign) <= _LAST_LETTER or sign in _SIGNS else "?" for sign in text)


def draw_tests(figure: Figure | SubFigure, tests: Sequence[SheetOfTest], units: SheetUnits, decimals: int) -> None:
    """Draw a panel for each test, one below the other over the same targets."""
    panels: list[Axes] = []
    for index, test in enumerate(tests):
        axes = figure.add_subplot(len(tests), 1, index + 1, sharex=panels[0] if panels else None)
        panels.append(axes)
        _means(axes, test.judged.figures.at_targets, units)
        axes.axhline(0.0, color=GUIDE, linewidth=0.9, zorder=1)
        axes.set_title(drawable(test.name), fontweight="bold", parse_math=False)
        axes.set_ylabel(f"deviation ({units.symbol})")
        axes.tick_params(labelbottom=index == len(tests) - 1)
        axes.margins(x=_ROOM, y=0.12)
    panels[-1].set_xlabel(f"target position ({units.position_symbol})")
    share_scales(panels)
    for axes, test in zip(panels, tests, strict=True):
        axes.autoscale(False)
        _dimensions(axes, test, units, decimals)
    legend_above(figure, panels[0], 5)


def _means(axes: Axes, at: TargetFigures, units: SheetUnits) -> None:
    x = at.target * units.position_factor
    for way, colour, marker, line in WAYS:
        mean, half = (values * units.factor for values in _of_way(at, way))
        known = np.isfinite(mean)
        if not known.any():
            continue
        half = np.nan_to_num(half)
        axes.fill_between(x[known], (mean - half)[known], (mean + half)[known], color=colour, alpha=0.16, linewidth=0,
                          label=f"{way} ± 2s" if half.any() else None)  # fmt: skip
        for edge in (mean - half, mean + half):
            axes.plot(x[known], edge[known], color=colour, linewidth=0.6, alpha=0.6)
        face = colour if way == "forward" else PAPER
        axes.plot(x[known], mean[known], color=colour, linestyle=line, marker=marker, markersize=4.5, linewidth=1.3,
                  markerfacecolor=face, label=f"{way}, mean")  # fmt: skip
    if np.isfinite(at.mean).any():
        axes.plot(x, at.mean * units.factor, color=INK, linewidth=0.8, linestyle=CENTRE_LINE,
                  label="mean of both")  # fmt: skip


def _of_way(at: TargetFigures, way: str) -> tuple[Floats, Floats]:
    if way == "forward":
        return at.mean_forward, 2.0 * at.spread_forward
    return at.mean_backward, 2.0 * at.spread_backward


def _dimensions(axes: Axes, test: SheetOfTest, units: SheetUnits, decimals: int) -> None:
    """Draw A, E and M beside the panel, B and R at their targets; of one direction where there is only one."""
    at, document = test.judged.figures.at_targets, test.document
    end = next((end for end in DIRECTIONS if document[f"E{end}"] is not None), None)
    if end is None:
        return
    ways = [way for way, *_ in WAYS if end in ("", f"_{way}")]
    means = np.array([_of_way(at, way)[0] for way in ways])
    halves = np.array([_of_way(at, way)[1] for way in ways])
    beside = {"A": (means - halves, means + halves), "E": (means, means), "M": (at.mean, at.mean)}
    column = 0
    for key, (low, high) in beside.items():
        value = document.get(f"{key}{end}")
        if value is None:
            continue
        label = f"{key}{DIRECTIONS[end]}\n{number_text(value, decimals)}"
        _beside(axes, column, label, *_extremes(at.target * units.position_factor, low, high, units.factor))
        column += 1
    repeats = at.repeatability if end == "" else getattr(at, f"repeatability{end}")
    if document[f"R{end}"] is not None:
        index = int(np.nanargmax(repeats))
        low, high = np.nanmin((means - halves)[:, index]), np.nanmax((means + halves)[:, index])
        label = f"R{DIRECTIONS[end]} {number_text(document[f'R{end}'], decimals)}"
        _at_target(axes, at.target[index] * units.position_factor, low * units.factor, high * units.factor, label, 1)
    if end == "":
        index = int(np.nanargmax(np.abs(at.reversal)))
        low, high = sorted((at.mean_forward[index] * units.factor, at.mean_backward[index] * units.factor))
        label = f"B {number_text(document['B'], decimals)}"
        _at_target(axes, at.target[index] * units.position_factor, low, high, label, -1)


def _extremes(x: Floats, low: Floats, high: Floats, factor: float) -> tuple[tuple[float, float], tuple[float, float]]:
    least = int(np.nanargmin(low)) % x.size
    most = int(np.nanargmax(high)) % x.size
    return (x[least], float(np.nanmin(low)) * factor), (x[most], float(np.nanmax(high)) * factor)


def _beside(axes: Axes, column: int, label: str, low: tuple[float, float], high: tuple[float, float]) -> None:
    """Draw a dimension beside the panel, with lines from the points that it is measured between."""
    left, right = axes.get_xlim()
    share = _COLUMNS + column * _COLUMN_WIDTH
    place = left + share * (right - left)
    for x, y in (low, high):
        axes.plot([x, place], [y, y], color=INK, linewidth=0.5, linestyle=LEADER, clip_on=False, zorder=1.5)
    axes.annotate("", (place, low[1]), (place, high[1]), annotation_clip=False,
                  arrowprops={"arrowstyle": "<|-|>,head_width=0.18,head_length=0.4", "color": INK, "linewidth": 0.9,
                              "shrinkA": 0.0, "shrinkB": 0.0})  # fmt: skip
    axes.text(share, 1.02, label, transform=axes.transAxes, ha="center", va="bottom", fontsize=8.5, linespacing=1.15)


def _at_target(axes: Axes, x: float, low: float, high: float, label: str, side: int) -> None:
    """Draw a dimension beside its target, to the right (+1) or the left (-1), with its label at its middle."""
    from matplotlib.patheffects import withStroke  # noqa: PLC0415 - half a second, needed only where something is drawn

    # wide enough to meet between letter and number: a line seen there would be read as a minus
    outline = withStroke(linewidth=6.0, foreground=PAPER)
    left, right = axes.get_xlim()
    aside = side * _ASIDE * (right - left)
    for y in (low, high):
        axes.plot([x, x + aside], [y, y], color=INK, linewidth=0.7, zorder=4)
    axes.annotate("", (x + aside, low), (x + aside, high), zorder=5,
                  arrowprops={"arrowstyle": "<|-|>,head_width=0.15,head_length=0.3", "color": INK, "linewidth": 0.9,
                              "shrinkA": 0.0, "shrinkB": 0.0})  # fmt: skip
    axes.annotate(label, (x + aside, (low + high) / 2.0), (4 * side, 0), textcoords="offset points", fontsize=8.5,
                  ha="left" if side > 0 else "right", va="center", zorder=6,
                  path_effects=[outline])  # fmt: skip
