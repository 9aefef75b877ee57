"""The behavioural box held against the firmware: the difference, effect by effect."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rtec.report.figures_style import ALARM, INK, figure_style, new_figure, rendered
from rtec.whole_file import WholeFile

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rtec.campaign.behaviour import Behaviour, Rung

_STEADY, _LONG = "#1f6f8b", "#d08c2e"
_TICKS = (0, 1, 10, 100, 1000)


def behaviour_figure(found: Sequence[Behaviour]) -> Figure:
    """Return the staircase of each design: the difference in clocks, and what comes behind the same transition."""
    figure = new_figure(6.0)
    panels = figure.subplots(2, len(found), sharex="col", sharey="row", squeeze=False, height_ratios=(3, 2))
    for column, one in enumerate(found):
        upper, lower = panels[0, column], panels[1, column]
        _clocks(upper, one.rungs)
        _shares(lower, one.rungs)
        name = one.design if one.design == "original" else one.design.upper()
        upper.set_title(f"{name}{', lines held' if one.hold_latch else ''}")
        lower.set_xticks(
            range(len(one.rungs)), [rung.name for rung in one.rungs], rotation=45, ha="right", rotation_mode="anchor"
        )
    panels[0, 0].set_ylabel("firmware less model (clocks)")
    panels[1, 0].set_ylabel("behind the same\ntransition (%)")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4)
    return figure


def write_behaviour_figure(found: Sequence[Behaviour], file: Path) -> None:
    """Write the staircase as PNG or SVG, by the name's ending.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    with figure_style():
        svg, png = rendered(behaviour_figure(found))
    with WholeFile(file) as whole:
        whole.write(svg if file.suffix == ".svg" else png)


def _clocks(axes: Axes, rungs: Sequence[Rung]) -> None:
    for name, colour, marker, values in (
        ("steady", _STEADY, "o", [rung.steady for rung in rungs]),
        ("long run", _LONG, "s", [rung.long for rung in rungs]),
    ):
        axes.plot([d.worst_clocks for d in values], color=colour, marker=marker, ms=4.5, label=f"{name}, worst")
        rms = [d.rms_clocks for d in values]
        axes.plot(rms, color=colour, marker=marker, ms=3.5, mfc="white", linestyle=(0, (3, 2)), label=f"{name}, rms")
    axes.set_yscale("symlog", linthresh=1.0, linscale=0.6)
    axes.set_yticks(_TICKS, [str(tick) for tick in _TICKS])
    axes.minorticks_off()
    axes.set_ylim(bottom=-0.25)
    last = len(rungs) - 1
    worst = max(rungs[last].steady.worst_clocks, rungs[last].long.worst_clocks)
    axes.annotate(f"{worst:g}", (last, worst), (0, 7), textcoords="offset points", ha="center", fontweight="bold",
                  color=INK if worst == 0.0 else ALARM)  # fmt: skip


def _shares(axes: Axes, rungs: Sequence[Rung]) -> None:
    places = np.arange(len(rungs))
    axes.bar(places - 0.19, [100 * rung.steady.share_same for rung in rungs], 0.36, color=_STEADY)
    axes.bar(places + 0.19, [100 * rung.long.share_same for rung in rungs], 0.36, color=_LONG)
    axes.set_ylim(0, 105)
