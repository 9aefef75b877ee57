"""A comparison of models of a warm machine as a picture: the chosen one over time, all of them, and thermometers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.errors import ArgumentError
from rtec.report.figures_style import magnitudes, new_figure, outline
from rtec.report.palette import AMBER, BLUE, GREEN, GREY, INK, LIGHT, MEASURED, PURPLE, SKY, VERMILION
from rtec.report.warm_training import short_name
from rtec.training.warm_results import WarmKind

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rtec.training.warm_results import WarmComparison, WarmRow

COLOURS = {
    WarmKind.NONE: GREY,
    WarmKind.LINEAR: AMBER,
    WarmKind.PHYSICAL: GREEN,
    WarmKind.FUZZY: VERMILION,
    WarmKind.KERNEL: BLUE,
    WarmKind.BAYES: PURPLE,
}
"""Of each kind of model."""
_CHANNEL_INCH, _ROW_INCH = 1.9, 0.22
_MOST_CHANNELS = 6


def warm_figure(result: WarmComparison) -> Figure:
    """Return the picture of a comparison.

    Above, each channel over the held-out part: what was measured, what the chosen row says with its 90 % interval,
    and what it leaves. Below, the error of every row, and the error with each number of thermometers.

    Raises
    ------
    ArgumentError
        No row has a figure.
    """
    row = result.named(result.chosen) or next((one for one in result.ranked if one.channels), None)
    if row is None:
        raise ArgumentError("figure", "no model has a figure", "one at least")
    channels = list(row.channels)[:_MOST_CHANNELS]
    below = max(2.8, 1.0 + _ROW_INCH * len(result.rows))
    heights = [*[_CHANNEL_INCH] * len(channels), below]
    figure = new_figure(height_inch=sum(heights) + 0.6)
    bands = figure.add_gridspec(len(heights), 1, height_ratios=heights)
    for place, name in enumerate(channels):
        axes = figure.add_subplot(bands[place])
        _draw_channel(axes, result, row, name)
        if place == 0:
            axes.set_title(f"Held-out part: measured, and what {row.name} says with its 90 % interval")
            axes.legend(loc="best", ncols=4, fontsize=8)
        if place == len(channels) - 1:
            axes.set_xlabel("time, h")
    last = bands[-1].subgridspec(1, 2, width_ratios=(1.2, 1.0))
    _draw_ranking(figure.add_subplot(last[0]), result)
    _draw_sensors(figure.add_subplot(last[1]), result)
    figure.draw_without_rendering()  # logarithmic axes know their labels, and so their margins, only once drawn
    return figure


def _draw_channel(axes: Axes, result: WarmComparison, row: WarmRow, name: str) -> None:
    parts, one = result.parts, row.channels[name]
    hours, measured = parts.hours, parts.judged[name]
    if one.half_um is not None:
        step = max(1, hours.size // 1500)
        low, high = one.predicted_um - one.half_um, one.predicted_um + one.half_um
        axes.fill_between(hours[::step], low[::step], high[::step], color=LIGHT, alpha=0.6, linewidth=0, label="90 %")
    axes.plot(*outline(hours, measured), color=INK, linewidth=1.2, label="measured")
    axes.plot(*outline(hours, one.predicted_um), color=COLOURS[row.kind], linewidth=1.2, label=row.name)
    axes.plot(
        *outline(hours, measured - one.predicted_um), color=MEASURED, linewidth=0.9, label="measured - predicted"
    )
    axes.set_ylabel(f"{name}, µm")
    axes.text(0.995, 0.03, f"{one.rms_heldout_um:.3g} µm RMS", transform=axes.transAxes, ha="right", va="bottom",
              fontsize=8.5, color=INK)  # fmt: skip


def _draw_ranking(axes: Axes, result: WarmComparison) -> None:
    y = np.arange(len(result.rows))[::-1]
    shown: list[float] = []
    said: set[str] = set()
    for place, row in zip(y, result.ranked, strict=True):
        colour = COLOURS[row.kind]
        if row.rms_heldout_um is None:
            axes.text(0.99, place, "no figure", transform=axes.get_yaxis_transform(), color=GREY, fontsize=7.5,
                      ha="right", va="center")  # fmt: skip
            continue
        marks = (
            (row.rms_heldout_um, "o", colour, "held out"),
            (row.rms_blocks_um, "|", INK, "blocks left out"),
            (row.rms_rows_um, "x", SKY, "random rows left out"),
        )
        for value, mark, shade, label in marks:
            if value is not None:
                shown.append(value)
                axes.plot(value, place, mark, color=shade, markersize=7, label=None if label in said else label)
                said.add(label)
    axes.set_yticks(
        y, [f"{row.name}{' (chosen)' * (row.name == result.chosen)}" for row in result.ranked], fontsize=8
    )
    axes.set_ylim(-0.7, y.size - 0.3)
    axes.set_xlabel("error, RMS over the channels, µm")
    axes.set_title("All models")
    axes.legend(loc="upper center", bbox_to_anchor=(0.4, -0.14), ncols=3, fontsize=7.5)
    magnitudes(axes, "x", shown)


def _draw_sensors(axes: Axes, result: WarmComparison) -> None:
    rows = result.sensors
    axes.set_title("With how many thermometers")
    axes.set(xlabel="thermometers", ylabel="error, RMS, µm")
    if not rows:
        axes.text(0.5, 0.5, "no thermometers, or a single block", transform=axes.transAxes, ha="center", color=INK)
        return
    places = np.arange(len(rows))
    figures = {
        "held out": ([row.rms_heldout_um for row in rows], GREEN, "o-"),
        "blocks left out": ([row.rms_blocks_um for row in rows], INK, "|--"),
        "with a probe once an hour": ([row.rms_hourly_um for row in rows], SKY, "s:"),
    }
    for label, (values, colour, line) in figures.items():
        axes.plot(places, values, line, color=colour, markersize=5, label=label)
    axes.set_xticks(places, [str(len(row.sensors)) for row in rows])
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="upper right", fontsize=7.5)
    best = next((row for row in rows if len(row.sensors) == min(3, len(rows[-1].sensors))), rows[-1])
    names = ", ".join(short_name(name) for name in best.sensors)
    text = f"best {len(best.sensors)}: {names}\n(the same in {100.0 * best.same:.0f} % of repeats without a block)"
    axes.text(0.02, 0.02, text, transform=axes.transAxes, fontsize=7.5, color=INK)
