"""The lines before and behind the box around one insertion of each design."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.report.appearance import Scale, look_of
from rtec.report.figures_style import new_figure
from rtec.report.palette import ALARM, DOTTED, INK, MOMENT, TICK
from rtec.signal import EdgeStream, states_of_levels
from rtec.study.results import StudyResult, Waveform

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PS_PER_US = 1_000_000
_BEFORE, _AFTER = 2, 3
"""Real edges that are shown before the insertion and behind it."""
_HEIGHT = 0.62
"""Of a line's high level; lines stand one unit apart."""
_ROWS = (("A", 5.3), ("B", 4.3), ("A′", 1.9), ("B′", 0.9))
_STATES = (3.72, 0.32)
_NARROWEST = 0.012
"""Share of the width that a state number needs."""


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
    start_ps, stop_ps, zero_ps = _view(waveform)
    for stream, rows, states in (
        (waveform.encoder, _ROWS[:2], _STATES[0]),
        (waveform.controller, _ROWS[2:], _STATES[1]),
    ):
        times_us, levels = _steps(stream, start_ps, stop_ps, zero_ps)
        for bit, (name, base) in enumerate(rows):
            line = base + _HEIGHT * ((levels >> bit) & 1)
            axes.plot(times_us, line, drawstyle="steps-post", color=INK, linewidth=1.2, solid_joinstyle="miter")
            axes.annotate(name, (0.0, base + _HEIGHT / 2), (-8, 0), xycoords=("axes fraction", "data"),
                          textcoords="offset points", ha="right", va="center")  # fmt: skip
        _numbers(axes, times_us, levels, states)
    _mark_insertion(axes, waveform, start_ps, stop_ps, zero_ps)
    axes.set_xlim((start_ps - zero_ps) / _PS_PER_US, (stop_ps - zero_ps) / _PS_PER_US)
    axes.set_ylim(-0.1, 6.5)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.grid(visible=False)
    processor = "".join(sign for sign in waveform.processor if sign.isascii() and sign.isalnum())
    axes.set_title(f"{look.label}, {processor}", color=look.ink, fontweight="bold")
    axes.annotate("encoder", (0.0, 4.85), (-38, 0), xycoords=("axes fraction", "data"), rotation=90,
                  textcoords="offset points", ha="center", va="center", fontsize=8.5)  # fmt: skip
    axes.annotate("controller", (0.0, 1.45), (-38, 0), xycoords=("axes fraction", "data"), rotation=90,
                  textcoords="offset points", ha="center", va="center", fontsize=8.5)  # fmt: skip


def _view(waveform: Waveform) -> tuple[int, int, int]:
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


def _steps(stream: EdgeStream, start_ps: int, stop_ps: int, zero_ps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return times in µs and levels from the begin of the view to its end."""
    part = stream.window(start_ps, stop_ps)
    last = part.final
    levels = np.concatenate([[part.initial], part.levels, [last]]).astype(np.int64)
    times = np.concatenate([[start_ps], part.times_ps, [stop_ps]])
    return (times - zero_ps) / _PS_PER_US, levels


def _numbers(axes: Axes, times_us: np.ndarray, levels: np.ndarray, y: float) -> None:
    """Write the state 1..4 under each stretch that is wide enough."""
    width = times_us[-1] - times_us[0]
    states = states_of_levels(levels[:-1]) + 1
    for begin, end, state in zip(times_us[:-1], times_us[1:], states, strict=True):
        if end - begin >= _NARROWEST * width:
            axes.text((begin + end) / 2, y, str(state), ha="center", va="center", fontsize=8.5, color=TICK)


def _mark_insertion(axes: Axes, waveform: Waveform, start_ps: int, stop_ps: int, zero_ps: int) -> None:
    """Colour the inserted transitions and say how many counts they add."""
    own = [time for time in waveform.inserted_ps if start_ps <= time <= stop_ps]
    stream = waveform.controller
    for time in own:
        index = int(np.searchsorted(stream.times_ps, time))
        if index >= len(stream) or stream.times_ps[index] != time:
            continue
        before = int(stream.levels[index - 1]) if index else stream.initial
        changed = before ^ int(stream.levels[index])
        x = (time - zero_ps) / _PS_PER_US
        for bit, (_, base) in enumerate(_ROWS[2:]):
            if changed >> bit & 1:
                axes.plot([x, x], [base - 0.05, base + _HEIGHT + 0.05], color=ALARM, linewidth=2.4, zorder=4,
                          solid_capstyle="butt")  # fmt: skip
    if own:
        left, right = ((time - zero_ps) / _PS_PER_US for time in (min(own), max(own)))
        pad = 0.004 * (stop_ps - start_ps) / _PS_PER_US
        axes.axvspan(left - pad, right + pad, ymin=0.08, ymax=0.45, color=ALARM, alpha=0.09, linewidth=0)
        counts = f"{waveform.counts_added:+d} count".replace("-", "−") + "s" * (abs(waveform.counts_added) != 1)
        axes.text(right + 2 * pad, 2.95, f"{counts} inserted",
                  color=ALARM, fontweight="bold", va="center", ha="left")  # fmt: skip
    axes.axvline(0.0, ymin=0.08, color=MOMENT, linewidth=0.8, linestyle=DOTTED, zorder=1)
