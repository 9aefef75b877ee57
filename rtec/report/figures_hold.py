"""An axis held at one position while its error grows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rtec.report.appearance import Scale, look_of
from rtec.report.figures_style import guide, legend_above, new_figure, outline
from rtec.report.palette import GROWTH, GUIDE, STATE_LINES
from rtec.study.results import HoldCurve, StudyResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def hold_figure(result: StudyResult, scale: Scale) -> Figure | None:
    """Return what is left of the growth against time, all designs in one panel."""
    curves = [curve for curve in result.hold_curves if curve.time_s.size]
    if not curves:
        return None
    figure = new_figure(3.9)
    axes = figure.add_subplot()
    several = len({curve.name for curve in curves}) < len(curves)
    for index, curve in enumerate(curves):
        _curve(axes, curve, scale, index, several=several)
    axes.axhline(0.0, color=GUIDE, linewidth=0.9, zorder=1)
    guide(axes, y=result.study.hold_growth_mm * scale.per_mm, text="growth in the end", colour=GROWTH)
    axes.set_xlabel("time (s)")
    axes.set_ylabel(f"deviation ({scale.symbol})")
    axes.margins(x=0.01)
    legend_above(figure, axes, 2 if len(curves) <= 4 else 3)
    return figure


def _curve(axes: Axes, curve: HoldCurve, scale: Scale, index: int, *, several: bool) -> None:
    look = look_of(curve.name)
    time, deviation = outline(curve.time_s, curve.deviation_mm)
    axes.plot(time, deviation * scale.per_mm, color=look.colour, linewidth=1.3 + 1.4 * (index == 0),
              linestyle=STATE_LINES[curve.state % 4] if several else "-",
              label=f"{look.label}, state {curve.state + 1}: {curve.inserted} inserted, "
                    f"{curve.pending_steps} pending")  # fmt: skip
