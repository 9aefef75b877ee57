"""What a second calibration showed that the first had hidden: its readings less the model before and after it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.inference.local_means import neighbour_means
from rtec.report.appearance import look_of
from rtec.report.diagnosis.quantities import Shown
from rtec.report.figures_style import new_figure
from rtec.report.palette import GUIDE, PAPER
from rtec.study.results import Floats, Learned, Round

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_DOTS = 4000
"""For each direction: more of them look the same."""
_STEPS = 250
"""Of the fold in which readings count as at the same place."""
_WAYS = ((1, "forward", "^"), (-1, "reverse", "v"))


def rounds_figure(learned: Learned, shown: Shown) -> Figure | None:
    """Return the readings of the last round, folded, less the model before and after it; None of a single round.

    They are folded over a turn of the screw where its pitch is known, else over the interval of the first targets:
    what repeats with it, or with a fraction of it, is what these could not show.
    """
    if len(learned.rounds) < 2:
        return None
    last = learned.rounds[-1]
    pitch = learned.diagnosis.dataset.coordinates.screw_pitch
    period = learned.plan.increment_mm if pitch is None else pitch
    figure = new_figure(4.8)
    above, below = figure.subplots(2, 1, sharex=True, sharey=True)
    for axes, left, rms, title in (
        (above, last.missed_mm, last.missed_rms_mm, "less the model that the first round gave"),
        (below, last.left_mm, last.left_rms_mm, "less the model that all readings gave"),
    ):
        _folded(axes, last, left, period, shown)
        size = shown.with_unit(rms)
        axes.set_title(f"Readings of the second round, {title}: {size} RMS")
        axes.set_ylabel(f"left ({shown.symbol})")
    turn = "a turn of the screw" if pitch is not None else "the interval of the first targets"
    below.set_xlabel(f"place in {turn} (mm)")
    above.legend(loc="lower left", ncols=2)
    return figure


def _folded(axes: Axes, last: Round, left: Floats, period: float, shown: Shown) -> None:
    """Draw readings over their place in the period, and the mean at each place."""
    colour = look_of("uncompensated").colour
    place = np.mod(last.readings.target_mm + period / _STEPS / 2.0, period)
    for way, label, marker in _WAYS:
        own = np.flatnonzero(last.readings.direction == way)
        if not own.size:
            continue
        dots = own[:: -(-own.size // _MOST_DOTS)]
        face = colour if way > 0 else PAPER
        axes.plot(place[dots], left[dots] * shown.factor, linestyle="none", marker=".", markersize=2.0, color=colour,
                  alpha=0.15, zorder=1)  # fmt: skip
        same = (np.floor(place[own] / period * _STEPS) + 0.5) * period / _STEPS
        means = neighbour_means(same, left[own], each_place=True)
        axes.plot(means.at, means.mean * shown.factor, linestyle="none", marker=marker,
                  markersize=4.5, color=colour, markerfacecolor=face, markeredgewidth=0.9, label=f"mean, {label}",
                  zorder=3)  # fmt: skip
    axes.axhline(0.0, color=GUIDE, linewidth=0.9, zorder=0)
    axes.set_xlim(0.0, period)
