"""A campaign drawn: a cell for each combination, coloured by the worst that happened in its jobs."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from rtec.report.campaign_tally import Axis, Cell, Tally
from rtec.report.figures_style import WIDTH_INCH, new_figure
from rtec.report.palette import ALARM, BAND, DELAYED, EDGE, INK, PAPER, SAFE, STOPPED, UPSTREAM
from rtec.verify.campaign.job import Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LOOKS = {
    "failed": (ALARM, "F", "failed: harm that supervision can prevent"),
    "exempt": (UPSTREAM, "x", "exempt: harm that supervision cannot prevent"),
    "no record": (PAPER, "?", "no record"),
    "hole": (BAND, "o", "never took effect: a hole"),
    "safe stop": (STOPPED, "s", "safe stop"),
    "delayed": (DELAYED, "d", "delayed"),
    "passed": (SAFE, "p", "passed"),
    "left out": (PAPER, "–", "left out: not possible, or not planned"),
}
"""Colour, letter and words, the worst first; the letters tell them apart in grey print, too."""
_MOST_COLUMNS, _MOST_ROWS = 90, 150
_LETTER_INCH, _ROW_INCH, _TITLE_INCH, _LEGEND_INCH = 0.065, 0.17, 0.35, 0.6
_LARGEST_PT = 8.0


def worst_of(cell: Cell | None) -> str:
    """Return the worst that happened in the jobs of a cell."""
    if cell is None:
        return "left out"
    counts = cell.counts
    if counts.failed or counts.exempt:
        return "failed" if counts.failed else "exempt"
    if counts.tried + counts.not_activated < len(cell.addresses):
        return "no record"
    if not counts.tried:
        return "hole"
    return next((word for word in ("safe stop", "delayed") if counts.outcomes[word]), "passed")


def words_of(value: Value) -> str:
    """Return a value of an axis as a person reads it."""
    return "" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def campaign_figure(tally: Tally, link: Callable[[Value, Value, Value], str]) -> Figure | None:
    """Return the map: rows, columns, and panels beside each other; None where there is nothing to lay out.

    Parameters
    ----------
    tally
        Of the campaign.
    link
        Returns where a cell, by row, column and panel, leads to in the SVG.
    """
    rows, columns, panels = tally.rows, tally.columns, tally.panels
    if not rows.name or len(rows.values) > _MOST_ROWS or len(columns.values) > _MOST_COLUMNS:
        return None
    corner = f"{columns.name} →\n{rows.name} ↓" if columns.name else f"{rows.name} ↓"
    longest = max(len(words) for words in (*corner.split("\n"), *map(words_of, rows.values)))
    left_inch = _LETTER_INCH * longest + 0.3
    title_inch = _LETTER_INCH * max(len(words_of(value)) for value in columns.values) + 0.1
    above_inch = title_inch + _TITLE_INCH * bool(panels.name) + _LEGEND_INCH
    height_inch = above_inch + _ROW_INCH * len(rows.values) + 0.1
    figure = new_figure(height_inch)
    figure.set_layout_engine("none")  # a constrained layout cuts the longest names off
    across = len(columns.values) * len(panels.values)
    width_inch = min(WIDTH_INCH - left_inch - 0.15, 0.6 * across)
    room = {
        "left": left_inch / WIDTH_INCH, "right": (left_inch + width_inch) / WIDTH_INCH,
        "top": 1.0 - above_inch / height_inch, "bottom": 0.1 / height_inch, "wspace": 0.06,
    }  # fmt: skip
    drawn = figure.subplots(1, len(panels.values), sharey=True, squeeze=False, gridspec_kw=room)[0]
    size = min(_LARGEST_PT, 72.0 * 0.85 * width_inch / across)
    shown = set[str]()
    for axes, panel in zip(drawn, panels.values, strict=True):
        shown |= _panel(axes, tally, panel, link, size)
        if panels.name:
            axes.text(0.0, 1.0 + title_inch / (_ROW_INCH * len(rows.values)),
                      f"{panels.name} {words_of(panel)}", transform=axes.transAxes, fontsize=9.5)  # fmt: skip
    _ticks(drawn[0], rows)
    drawn[0].text(-0.05 / width_inch * len(panels.values), 1.0 + 0.05 / (_ROW_INCH * len(rows.values)), corner,
                  transform=drawn[0].transAxes, ha="right", va="bottom", fontsize=7.5)  # fmt: skip
    from matplotlib.patches import Patch  # noqa: PLC0415 - half a second, needed only where something is drawn

    marks = [
        Patch(facecolor=colour, edgecolor=EDGE, label=f"{letter}  {words}")
        for word, (colour, letter, words) in _LOOKS.items() if word in shown
    ]  # fmt: skip
    figure.legend(handles=marks, loc="upper left", ncols=3, fontsize=8.5)
    return figure


def _ticks(axes: Axes, rows: Axis) -> None:
    axes.set_yticks(range(len(rows.values)), [words_of(value) for value in rows.values], fontsize=7.5)
    axes.set_ylim(len(rows.values) - 0.5, -0.5)


def _panel(
    axes: Axes, tally: Tally, panel: Value, link: Callable[[Value, Value, Value], str], size: float
) -> set[str]:
    """Draw the cells of a panel; return what happened in them."""
    from matplotlib.patches import Rectangle  # noqa: PLC0415 - as above

    shown = set[str]()
    columns = tally.columns.values
    for y, row in enumerate(tally.rows.values):
        for x, column in enumerate(columns):
            cell = tally.cells.get((row, column, panel))
            shown.add(what := worst_of(cell))
            colour, letter, _ = _LOOKS[what]
            box = Rectangle((x - 0.5, y - 0.5), 1.0, 1.0, facecolor=colour, edgecolor=PAPER)
            axes.add_patch(box)
            ink = PAPER if what == "failed" else INK
            mark = axes.text(x, y, letter, ha="center", va="center", fontsize=min(7.0, size), color=ink)
            if cell is not None:
                for part in (box, mark):
                    part.set_url(link(row, column, panel))
    axes.set_xlim(-0.5, len(columns) - 0.5)
    names = [words_of(value) for value in columns]
    axes.set_xticks(range(len(columns)), names, rotation=90, ha="center", fontsize=size)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    return shown
