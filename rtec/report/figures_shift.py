"""A machine that warms over a shift: its error in each way of correcting, and what its thermometers say."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.report.appearance import Scale
from rtec.report.figures_style import guide, legend_above, new_figure, outline
from rtec.report.palette import BLUE, GREEN, GUIDE, NEUTRAL, SERIES, SHADE, VERMILION
from rtec.study.results import Shift, ShiftRow, StudyResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {"uncompensated": (NEUTRAL, "o"), "cold": (VERMILION, "s"), "warm": (BLUE, "v"), "speed": (GREEN, "^")}
_HOUR_S = 3600.0
_MOST_THERMOMETERS = 6


def shift_figure(result: StudyResult, scale: Scale) -> Figure | None:
    """Return error against time in each way of correcting, above the temperatures that changed most."""
    if result.shift is None:
        return None
    figure = new_figure(6.6)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    for row in result.shift.rows:
        _row(above, row, scale)
    above.axhline(0.0, color=GUIDE, linewidth=0.9, zorder=1)
    above.set_ylabel(f"deviation ({scale.symbol})")
    legend_above(figure, above, 2)
    _temperatures(below, result.shift)
    below.set_xlabel("time (h)")
    below.set_ylabel("temperature (°C)")
    below.margins(x=0.01)
    return figure


def _row(axes: Axes, row: ShiftRow, scale: Scale) -> None:
    """Draw the mean of each calibration and the range of its readings."""
    taken = np.isfinite(row.deviation_mm).all(axis=1)
    if not taken.any():
        return
    colour, marker = COLOURS[row.name]
    hours, deviation = row.time_s[taken] / _HOUR_S, row.deviation_mm[taken] * scale.per_mm
    axes.fill_between(
        hours, deviation.min(axis=1), deviation.max(axis=1), color=colour, alpha=0.18, linewidth=0.0, zorder=2
    )
    axes.plot(
        hours, deviation.mean(axis=1), color=colour, marker=marker, markersize=4.5, zorder=3,
        label=f"{row.title}: {scale.with_unit(row.rms_mm)} RMS",
    )  # fmt: skip
    if row.reason:
        guide(axes, x=float(hours[-1]), text="held", colour=colour)


def _temperatures(axes: Axes, shift: Shift) -> None:
    """Draw the temperatures that changed most; the spindle runs where it is shaded."""
    time_s, rpm = (np.asarray(values) for values in (shift.course.time_s, shift.course.spindle_rpm))
    heats = {name: np.asarray(values) for name, values in shift.course.thermometers.items()}
    most = sorted(heats, key=lambda name: -float(np.ptp(heats[name])))[:_MOST_THERMOMETERS]
    for name, colour in zip(most, SERIES, strict=False):
        hours, degc = outline(time_s / _HOUR_S, heats[name])
        axes.plot(hours, degc, color=colour, label=name.replace("_", " "))
    turns = np.flatnonzero(np.diff(rpm > 0.0, prepend=False, append=False))
    for begin, end in turns.reshape(-1, 2):
        ends_h = time_s[[begin, min(end, time_s.size - 1)]] / _HOUR_S
        axes.axvspan(*ends_h, color=SHADE, alpha=0.05, linewidth=0.0)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
