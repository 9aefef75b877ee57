"""The lines and pins around an insertion that a firmware made, or failed to make."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rtec.campaign import FirmwareVerdict, Trace
from rtec.injector import Design
from rtec.report.appearance import look_of
from rtec.report.figures_style import new_figure, write_figure
from rtec.report.palette import ALARM, DOTTED, INK, MOMENT

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PS_PER_US = 1e6
_HIGH = 0.62
"""Of a line's high level; lines stand one unit apart."""
_APART = 0.35
_PIN_NAMES = {
    0: "P1.0", 1: "P1.1", 2: "P1.2", 3: "P1.3", 4: "P1.4", 5: "P1.5", 6: "P1.6", 7: "P1.7 hold",
}  # fmt: skip
_HOLD_PIN = 0x80
"""Of the hold latch, which lines that pass through the processor do not have."""


def write_insertion_figure(verdict: FirmwareVerdict, file: Path) -> None:
    """Draw the first insertion that failed, or the slowest, into a file.

    Parameters
    ----------
    verdict
        Whose ``trace`` is drawn; it must have one.
    file
        Its name ends in .png, .svg or .pdf.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    write_figure(lambda: insertion_figure(verdict), file)


def insertion_figure(verdict: FirmwareVerdict) -> Figure:
    """Return the figure: encoder, controller and pins over time in µs and, above, in cycles.

    Both scales begin at the encoder's edge before the insertion; at rest, at its first change.
    """
    trace = verdict.trace
    if trace is None:
        raise ValueError("a verdict without a trace has no figure")
    rows = _rows(trace, verdict.design)
    figure = new_figure(0.36 * len(rows) + 1.7)
    axes = figure.add_subplot()
    left, right = ((t - trace.zero_ps) / _PS_PER_US for t in (trace.from_ps, trace.to_ps))
    # encoder, controller and pins stand a little apart
    places = [len(rows) - 1 - index + _APART * ((index < 2) + (index < 4)) for index in range(len(rows))]
    for index, (name, times_ps, levels) in enumerate(rows):
        base = places[index]
        times_us, values = _steps(trace, times_ps, levels)
        colour = INK if not name.startswith("P1") else look_of(verdict.design.value).ink
        axes.plot(times_us, base + _HIGH * values, drawstyle="steps-post", color=colour, linewidth=1.3)
        axes.annotate(name, (0.0, base + _HIGH / 2), (-8, 0), xycoords=("axes fraction", "data"),
                      textcoords="offset points", ha="right", va="center")  # fmt: skip
    axes.set_xlim(left, right)
    axes.set_ylim(-0.8, places[0] + 0.9)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.grid(visible=False, axis="y")
    axes.axvline(0.0, color=MOMENT, linewidth=0.8, linestyle=DOTTED, zorder=1)
    axes.set_xlabel("time (µs)")
    _cycles_above(axes, trace)
    _mark(axes, trace)
    what = trace.title if trace.mark_ps is not None else f"slowest insertion, {trace.title}"
    axes.set_title(f"{look_of(verdict.design.value).label}, {verdict.processor}: {what}".replace(" -", " −"), pad=10)
    return figure


def _rows(trace: Trace, design: Design) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Return name, times and levels of each line, the level before the first change included."""
    rows = []
    shown = design.pins | (0 if design.in_path else _HOLD_PIN)
    for stream, prime in ((trace.encoder, ""), (trace.controller, "′")):
        levels = np.concatenate([[stream.initial], stream.levels]).astype(np.int64)
        rows += [(f"{name}{prime}", stream.times_ps, levels >> bit & 1) for bit, name in enumerate("AB")]
    latches = np.concatenate([[trace.initial_pins], trace.pin_levels]).astype(np.int64)
    moved = np.bitwise_or.reduce(latches ^ latches[0])
    for bit in range(8):
        if (shown | moved) >> bit & 1:
            rows.append((_PIN_NAMES[bit], trace.pin_times_ps, latches >> bit & 1))
    return rows


def _steps(trace: Trace, times_ps: np.ndarray, levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return times in µs and levels from the begin of the view to its end."""
    begin, end = (int(np.searchsorted(times_ps, t, side="right")) for t in (trace.from_ps, trace.to_ps))
    times = np.concatenate([[trace.from_ps], times_ps[begin:end], [trace.to_ps]])
    shown = np.concatenate([levels[begin : end + 1], levels[end : end + 1]])
    return (times - trace.zero_ps) / _PS_PER_US, shown


def _cycles_above(axes: Axes, trace: Trace) -> None:
    """Put a second scale above: cycles of the processor."""
    from matplotlib.ticker import MaxNLocator  # noqa: PLC0415 - as in figures_style

    per_us = _PS_PER_US / trace.cycle_ps

    def cycles(us: ArrayLike) -> ArrayLike:
        return np.asarray(us, np.float64) * per_us

    def microseconds(count: ArrayLike) -> ArrayLike:
        return np.asarray(count, np.float64) / per_us

    above = axes.secondary_xaxis("top", functions=(cycles, microseconds))
    above.xaxis.set_major_locator(MaxNLocator(integer=True))
    above.set_xlabel("cycles of the processor")


def _mark(axes: Axes, trace: Trace) -> None:
    """Mark the moment that failed."""
    if trace.mark_ps is None:
        return
    x = (trace.mark_ps - trace.zero_ps) / _PS_PER_US
    axes.axvline(x, color=ALARM, linewidth=4.0, alpha=0.35, zorder=1)
    axes.annotate("fails here", (x, 0.0), (5, 2), xycoords=("data", "axes fraction"), textcoords="offset points",
                  color=ALARM, fontweight="bold", ha="left", va="bottom")  # fmt: skip
