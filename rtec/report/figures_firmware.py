"""The lines and pins around an insertion that a firmware made, or failed to make."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rtec.injector import Design
from rtec.report.appearance import look_of
from rtec.report.figures_style import new_figure
from rtec.report.palette import ALARM, DOTTED, MOMENT
from rtec.report.waveform import Groups, View, draw_groups, height_of, side_rows
from rtec.units import PS_PER
from rtec.verify.firmware.results import FirmwareVerdict, Trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PIN_NAMES = (*(f"P1.{bit}" for bit in range(7)), "P1.7 hold")
_HOLD_PIN = 0x80
"""Of the hold latch, which lines that pass through the processor do not have."""


def insertion_figure(verdict: FirmwareVerdict) -> Figure:
    """Return the first insertion that failed, or the slowest: encoder, controller and pins over time.

    Below in µs, above in cycles; both begin at the encoder's edge before the insertion, at rest at its first change.
    """
    trace = verdict.trace
    if trace is None:
        raise ValueError("a verdict without a trace has no figure")
    view = View(trace.from_ps, trace.to_ps, trace.zero_ps, "us")
    groups = _groups(trace, verdict.design)
    look = look_of(verdict.design.value)
    figure = new_figure(0.36 * height_of(groups) + 1.7)
    axes = figure.add_subplot()
    draw_groups(axes, view, groups, colours={"pins": look.ink})
    axes.set_ylim(-0.8, height_of(groups))
    axes.axvline(0.0, color=MOMENT, linewidth=0.8, linestyle=DOTTED, zorder=1)
    axes.set_xlabel(view.label)
    _cycles_above(axes, trace)
    if trace.mark_ps is not None:
        x = view.x(trace.mark_ps)
        axes.axvline(x, color=ALARM, linewidth=4.0, alpha=0.35, zorder=1)
        axes.annotate("fails here", (x, 0.0), (5, 2), xycoords=("data", "axes fraction"), textcoords="offset points",
                      color=ALARM, fontweight="bold", ha="left", va="bottom")  # fmt: skip
    what = trace.title if trace.mark_ps is not None else f"slowest insertion, {trace.title}"
    axes.set_title(f"{look.label}, {verdict.processor}: {what}".replace(" -", " −"), pad=10)
    return figure


def _groups(trace: Trace, design: Design) -> Groups:
    """Return the lines of both sides of the box, and the pins that the design has or that moved."""
    groups: Groups = {}
    for side, stream, prime in (("encoder", trace.encoder, ""), ("controller", trace.controller, "′")):
        groups[side] = {name: steps for name, steps in side_rows(stream, prime).items() if name[0] in "AB"}
    latches = np.concatenate([[trace.initial_pins], trace.pin_levels]).astype(np.int64)
    moved = np.bitwise_or.reduce(latches ^ latches[0])
    shown = design.pins | (0 if design.in_path else _HOLD_PIN)
    groups["pins"] = {
        name: (trace.pin_times_ps, latches >> bit & 1)
        for bit, name in enumerate(_PIN_NAMES)
        if (shown | moved) >> bit & 1
    }
    return groups


def _cycles_above(axes: Axes, trace: Trace) -> None:
    from matplotlib.ticker import MaxNLocator  # noqa: PLC0415 - as in figures_style

    per_us = PS_PER["us"] / trace.cycle_ps

    def cycles(us: ArrayLike) -> ArrayLike:
        return np.asarray(us, np.float64) * per_us

    def microseconds(count: ArrayLike) -> ArrayLike:
        return np.asarray(count, np.float64) / per_us

    above = axes.secondary_xaxis("top", functions=(cycles, microseconds))
    above.xaxis.set_major_locator(MaxNLocator(integer=True))
    above.set_xlabel("cycles of the processor")
