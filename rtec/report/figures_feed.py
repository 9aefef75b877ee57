"""Error in motion against the feed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rtec.report.appearance import Scale, look_of
from rtec.report.figures_style import guide, legend_above, new_figure
from rtec.report.palette import FINE_DOTS, INK
from rtec.study.results import FeedCurve, Floats, StudyResult
from rtec.units import MM_PER_INCH

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def feed_figure(result: StudyResult, scale: Scale) -> Figure | None:
    """Return peak to peak and RMS of the error in motion against the feed, both directions, limits marked."""
    curves = [curve for curve in result.feed_curves if curve.feed_mm_s.size]
    if not curves:
        return None
    figure = new_figure(4.8)
    forward = figure.add_subplot(1, 2, 1)
    reverse = figure.add_subplot(1, 2, 2, sharex=forward, sharey=forward)
    for index, curve in enumerate(curves):
        _curve(forward, curve, curve.forward_pp_mm, curve.forward_rms_mm, scale, index)
        _curve(reverse, curve, curve.reverse_pp_mm, curve.reverse_rms_mm, scale, index)
    fastest = max(float(curve.feed_mm_s.max()) for curve in curves)
    forward.set_xlim(0.0, 1.03 * fastest * scale.feed_per_mm_s)
    forward.set_ylim(0.0, 1.45 * forward.get_ylim()[1])
    for axes, title in ((forward, "Forward"), (reverse, "Reverse")):
        axes.set_xlabel(f"feed ({scale.feed_unit})")
        axes.set_title(title)
        _limits(axes, curves, fastest, scale)
        if result.study.plan.feed_mm_s <= fastest:
            guide(axes, x=result.study.plan.feed_mm_s * scale.feed_per_mm_s, text="feed of the program", colour=INK)
        if scale.unit != "inch":
            upper = axes.secondary_xaxis("top", functions=(_inch_per_min, _mm_per_min))
            upper.set_xlabel("inch/min", fontsize=8.5)
    forward.set_ylabel(f"error in motion ({scale.symbol})")
    reverse.tick_params(labelleft=False)
    forward.plot([], [], color=INK, linestyle=FINE_DOTS, linewidth=1.1, label="dotted: RMS")
    legend_above(figure, forward, len(curves) + 1)
    return figure


def _inch_per_min(feed_mm_min: Any) -> Any:
    return feed_mm_min / MM_PER_INCH


def _mm_per_min(feed_inch_min: Any) -> Any:
    return feed_inch_min * MM_PER_INCH


def _curve(axes: Axes, curve: FeedCurve, spread: Floats, rms: Floats, scale: Scale, index: int) -> None:
    """Draw one design; the first ones wider, so that curves that coincide are all seen."""
    look = look_of(curve.name)
    feed = curve.feed_mm_s * scale.feed_per_mm_s
    wider = 3.2 if index == 0 else 1.4
    axes.plot(feed, spread * scale.per_mm, color=look.colour, marker=look.marker, linewidth=wider,
              markersize=7.0 if index == 0 else 4.5, alpha=0.55 if index == 0 else 1.0,
              label=f"{look.label}, peak to peak")  # fmt: skip
    axes.plot(feed, rms * scale.per_mm, color=look.colour, linestyle=FINE_DOTS, linewidth=wider - 0.3,
              alpha=0.55 if index == 0 else 1.0)  # fmt: skip


def _limits(axes: Axes, curves: list[FeedCurve], fastest: float, scale: Scale) -> None:
    """Mark the feed up to which window and update rate follow the error; designs with the same one share a line."""
    shared: dict[float, list[str]] = {}
    for curve in curves:
        if np.isfinite(curve.follows_up_to_mm_s) and curve.follows_up_to_mm_s <= fastest:
            shared.setdefault(round(curve.follows_up_to_mm_s, 6), []).append(curve.name)
    for feed, names in shared.items():
        words = ", ".join(look_of(name).label.removeprefix("Design ") for name in names)
        guide(axes, x=feed * scale.feed_per_mm_s, text=f"limit of {words}", colour=look_of(names[-1]).ink)
