"""The envelope drawn: what each design does on each processor at which frequency, and up to where it is safe."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rtec.injector import Design
from rtec.readable import hertz_text
from rtec.report.appearance import look_of
from rtec.report.figures_margin import draw_bands, name_bands
from rtec.report.figures_style import guide, legend_above, new_figure
from rtec.report.palette import GRID, INK
from rtec.verify.envelope.rows import GOAL_HZ, MODERATE_HZ, RAPID_HZ, EnvelopeRow

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_GUIDES = {
    RAPID_HZ: "30 kHz: rapid traverse of\nthe demonstration machine",
    MODERATE_HZ: "100 kHz:\n'moderate' in\nthe report",
    GOAL_HZ: "500 kHz: 'on the\nhorizon' there",
}
_APART = 0.19
"""Between the designs of one processor, in rows of the figure."""


def envelope_figure(rows: Sequence[EnvelopeRow]) -> Figure:
    """Return a figure with a bar and a mark for each design and processor on a logarithmic axis of frequency."""
    processors = list(dict.fromkeys(row.processor.name for row in rows))
    figure = new_figure(1.7 + 1.25 * len(processors))
    axes = figure.add_subplot()
    axes.set_xscale("log")
    for design in dict.fromkeys(row.design for row in rows):
        _marks(axes, [row for row in rows if row.design is design], processors)
    low, high = _span(rows)
    axes.set_xlim(low, high)
    axes.set_ylim(len(processors) - 0.45, -0.95)
    axes.set_yticks(range(len(processors)), processors)
    axes.grid(visible=False, axis="y")
    for between in range(1, len(processors)):
        axes.axhline(between - 0.5, color=GRID, linewidth=0.6)
    for frequency_hz, words in _GUIDES.items():
        if low < frequency_hz < high:
            guide(axes, x=frequency_hz, colour=INK)
            axes.annotate(
                words,
                (frequency_hz, -0.62),
                (-4, 0),
                textcoords="offset points",
                ha="right",
                va="bottom",
                fontsize=8.0,
            )
    axes.annotate("marks: safe to,\nlimited by", (1.0, -0.62), (4, 0), xycoords=axes.get_yaxis_transform(),
                  textcoords="offset points", va="bottom", ha="left", fontsize=8.0)  # fmt: skip
    axes.set_xlabel("encoder frequency, square waves a second of each line")
    axes.xaxis.set_major_formatter(lambda hertz, _: hertz_text(hertz, 3))
    name_bands(axes)
    legend_above(figure, axes, 7)
    return figure


def _marks(axes: Axes, rows: Sequence[EnvelopeRow], processors: Sequence[str]) -> None:
    """Draw a design: what it does at steady speed as a bar, the safe frequency as a mark, and what limits that."""
    designs = list(Design)
    look = look_of(rows[0].design.value)
    label: str | None = look.label
    for row in rows:
        y = processors.index(row.processor.name) + _APART * (designs.index(row.design) - 1.5)
        draw_bands(axes, y, row.speeds.frequencies, look.colour, height=0.45 * _APART)
        if row.max_safe_hz > 0.0:
            axes.plot(row.max_safe_hz, y, color=look.colour, marker=look.marker, markersize=7.0, linestyle="none",
                      label=label)  # fmt: skip
            label = None
        words = row.limited_by.value
        if row.max_safe_hz:
            words = f"{hertz_text(row.max_safe_hz, 3)}, {words}"
        axes.annotate(words, (1.0, y), (4, 0), xycoords=axes.get_yaxis_transform(), textcoords="offset points",
                      va="center", ha="left", fontsize=8.0, color=look.ink)  # fmt: skip


def _span(rows: Sequence[EnvelopeRow]) -> tuple[float, float]:
    found = [row.max_safe_hz for row in rows if row.max_safe_hz > 0.0] or [float(GOAL_HZ)]
    highest = max(row.speeds.frequencies.searched_to_hz for row in rows)
    return min([*found, RAPID_HZ]) / 4.0, max([*found, highest]) * 1.15
