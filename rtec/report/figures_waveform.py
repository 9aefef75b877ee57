"""The lines before and behind the box around one insertion of each design."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.report.appearance import Scale, look_of
from rtec.report.figures_style import new_figure
from rtec.report.palette import ALARM, DOTTED, MOMENT
from rtec.report.waveform import HIGH, View, draw_groups, height_of, shade, side_rows
from rtec.study.results import StudyResult, Waveform

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BEFORE, _AFTER = 2, 3
"""Real edges that are shown before the insertion and behind it."""


def waveform_figure(result: StudyResult, scale: Scale) -> Figure | None:
    """Return one panel a waveform: the encoder's lines, the controller's, and the state numbers below each.

    Time is in µs whatever the scale.
    """
    del scale
    waveforms = result.waveforms
    if not waveforms:
        return None
    figure = new_figure(2.15 * len(waveforms) + 0.3)
    for index, waveform in enumerate(waveforms):
        axes = figure.add_subplot(len(waveforms), 1, index + 1)
        _panel(axes, waveform)
        axes.set_xlabel("time since the real edge before the insertion (µs)" if index == len(waveforms) - 1 else "")
    return figure


def _panel(axes: Axes, waveform: Waveform) -> None:
    look = look_of(waveform.name)
    start_ps, stop_ps, zero_ps = _shown_ps(waveform)
    view = View(start_ps, stop_ps, zero_ps, "us")
    sides = {"encoder": side_rows(waveform.encoder, ""), "controller": side_rows(waveform.controller, "′")}
    for rows in sides.values():
        del rows["count"]
    low, high = draw_groups(axes, view, sides)["controller"]
    axes.set_ylim(low - 0.3, height_of(sides))
    _mark_insertion(axes, waveform, view, low, high)
    processor = "".join(sign for sign in waveform.processor if sign.isascii() and sign.isalnum())
    axes.set_title(f"{look.label}, {processor}", color=look.ink, fontweight="bold")


def _shown_ps(waveform: Waveform) -> tuple[int, int, int]:
    """Return begin and end of the part that is shown, and the real edge from which time counts."""
    real = waveform.encoder.times_ps
    first = min(waveform.inserted_ps, default=waveform.from_ps)
    last = max(waveform.inserted_ps, default=waveform.to_ps)
    before = int(np.searchsorted(real, first, side="right"))
    behind = int(np.searchsorted(real, last, side="right"))
    zero_ps = int(real[before - 1]) if before else first
    if not waveform.inserted_ps:
        return waveform.from_ps, waveform.to_ps, zero_ps
    gap_ps = int(np.diff(real).min()) // 2 if real.size > 1 else 0
    start_ps = int(real[before - _BEFORE]) - gap_ps if before >= _BEFORE else waveform.from_ps
    stop_ps = int(real[behind + _AFTER - 1]) - gap_ps if behind + _AFTER <= real.size else waveform.to_ps
    return max(start_ps, waveform.from_ps), min(stop_ps, waveform.to_ps), zero_ps


def _mark_insertion(axes: Axes, waveform: Waveform, view: View, low: float, high: float) -> None:
    """Colour the inserted transitions and say how many counts they add."""
    own = [time for time in waveform.inserted_ps if view.start_ps <= time <= view.stop_ps]
    stream = waveform.controller
    levels = np.concatenate([[stream.initial], stream.levels])
    for time in own:
        index = int(np.searchsorted(stream.times_ps, time))
        changed = int(levels[index] ^ levels[index + 1]) if time in stream.times_ps else 0
        for bit, base in enumerate((high - 1.0, high - 2.0)):
            if changed >> bit & 1:
                axes.plot([view.x(time)] * 2, [base - 0.05, base + HIGH + 0.05], color=ALARM, linewidth=2.4, zorder=4,
                          solid_capstyle="butt")  # fmt: skip
    if own:
        shade(axes, view, min(own), max(own), low - 0.2, high - 0.15)
        counts = f"{waveform.counts_added:+d} count".replace("-", "−") + "s" * (abs(waveform.counts_added) != 1)
        axes.text(view.x(max(own)), high + 0.1, f"{counts} inserted", color=ALARM, fontweight="bold", va="bottom")
    axes.axvline(0.0, color=MOMENT, linewidth=0.8, linestyle=DOTTED, zorder=1)
