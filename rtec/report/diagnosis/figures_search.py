"""How a search went: the candidates with what they promised and gave, and the staircase of the steps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rtec.inference.results import Candidate, Diagnosis, NoiseFloor
from rtec.readable import rounded
from rtec.report.diagnosis.quantities import Shown, probability, shown_for
from rtec.report.diagnosis.readings import figure_text
from rtec.report.diagnosis.sentence import spoken
from rtec.report.figures_style import legend_above, new_figure
from rtec.report.palette import ALARM, BAND, FORWARD, GUIDE_LINE, INK, LIGHT, NEUTRAL, PALE, REVERSE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_BARS = 18
_MOST_LABELLED = 10
"""Steps up to which both figures stand at each; of more, the held-out ones are left to the table."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Bar:
    candidate: Candidate
    reference: float
    """RMS before the candidate was added, or in the end where it was not."""

    @property
    def gain(self) -> float:
        """Predicted fall, for the ranking."""
        return self.reference - self.candidate.predicted_rms


def candidates_figure(diagnosis: Diagnosis) -> Figure | None:
    """Return the ranked candidates: from which RMS to which each was promised to bring it, and brought it."""
    bars = [_Bar(candidate=one, reference=_reference(diagnosis, one)) for one in diagnosis.candidates]
    bars = [bar for bar in bars if math.isfinite(bar.gain) and bar.candidate.predicted_rms > 0 and bar.reference > 0]
    bars = sorted(bars, key=lambda bar: -bar.gain)[:_MOST_BARS]
    if not bars:
        return None
    shown = shown_for(diagnosis.dataset)
    figure = new_figure(0.42 * len(bars) + 1.3)
    axes = figure.add_subplot()
    for row, bar in enumerate(reversed(bars)):
        _bar(axes, row, bar, shown)
    if diagnosis.noise.floor is not None:
        axes.axvline(diagnosis.noise.floor * shown.factor, color=ALARM, linewidth=1.0, linestyle=GUIDE_LINE,
                     label="noise floor", zorder=1)  # fmt: skip
    axes.set_yticks(np.arange(len(bars)), [figure_text(spoken(bar.candidate.effect)) for bar in reversed(bars)])
    axes.set_ylim(-0.7, len(bars) - 0.3)
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    floor = [diagnosis.noise.floor] if diagnosis.noise.floor else []
    _decades(axes, "x", [v * shown.factor for v in (*floor, *(v for bar in bars for v in _values(bar)))])
    axes.set_xlabel(f"RMS of the residual in training ({shown.symbol}), from before to with the effect")
    legend_above(figure, axes, 3)
    return figure


def _reference(diagnosis: Diagnosis, candidate: Candidate) -> float:
    """Return the RMS that a candidate's promise is measured against: before its own step, or after the last one."""
    before = diagnosis.rms_before
    for step in diagnosis.steps:
        if candidate.accepted and step.effect == candidate.effect:
            return before
        before = step.rms_train
    return before


def _values(bar: _Bar) -> list[float]:
    achieved = bar.candidate.achieved_rms
    return [bar.reference, bar.candidate.predicted_rms, *([achieved] if achieved else [])]


def _bar(axes: Axes, row: int, bar: _Bar, shown: Shown) -> None:
    one, start = bar.candidate, bar.reference * shown.factor
    predicted = one.predicted_rms * shown.factor
    first = row == 0
    axes.barh(row + 0.19, start - predicted, 0.34, left=predicted, color=LIGHT, zorder=2,
              label="predicted fall" if first else None)  # fmt: skip
    if one.achieved_rms is not None:
        achieved = one.achieved_rms * shown.factor
        bars = axes.barh(row - 0.19, start - achieved, 0.34, left=achieved, color=FORWARD, zorder=2)
        if "achieved fall" not in axes.get_legend_handles_labels()[1]:
            bars.set_label("achieved fall")
    axes.annotate(_judgement(one), (1.0, row), (6, 0), xycoords=("axes fraction", "data"),
                  textcoords="offset points", va="center", fontsize=8.5, annotation_clip=False,
                  color=INK if one.accepted else PALE, weight="bold" if one.accepted else "normal")  # fmt: skip


def _judgement(one: Candidate) -> str:
    words = "found" if one.accepted else f"not added, p {probability(one.p_adjusted).replace('< ', '<')}"
    if one.tied_with:
        words += f"; like {', '.join(spoken(name) for name in one.tied_with[:2])}"
    return figure_text(words, 52)


def _decades(axes: Axes, which: str, values: list[float]) -> None:
    """Make an axis logarithmic with plain numbers, whatever the range; linear where nothing is above zero."""
    from matplotlib.ticker import LogLocator, NullFormatter  # noqa: PLC0415 - half a second, needed only to draw

    if max(values, default=0.0) <= 0.0:
        return
    least, most = min(v for v in values if v > 0), max(values)
    axis = axes.xaxis if which == "x" else axes.yaxis
    (axes.set_xscale if which == "x" else axes.set_yscale)("log")
    room = (most / least) ** 0.08 * 1.05
    (axes.set_xlim if which == "x" else axes.set_ylim)(least / room, most * room)
    marks = (1.0, 2.0, 5.0) if most / least < 300 else (1.0,)
    axis.set_major_locator(LogLocator(subs=marks, numticks=30))
    axis.set_major_formatter(lambda value, _: f"{value:.10f}".rstrip("0").rstrip("."))
    axis.set_minor_formatter(NullFormatter())


def staircase_figure(diagnosis: Diagnosis) -> Figure:
    """Return the RMS in training and held out after every step, down to the band of the noise floor."""
    shown, steps = shown_for(diagnosis.dataset), diagnosis.steps
    figure = new_figure(4.4)
    axes = figure.add_subplot()
    train = [diagnosis.rms_before * shown.factor, *(step.rms_train * shown.factor for step in steps)]
    held = [diagnosis.rms_heldout_before * shown.factor, *(step.rms_heldout * shown.factor for step in steps)]
    x = np.arange(len(train))
    axes.step(np.append(x - 0.5, x[-1] + 0.5), [*train, train[-1]], where="post", color=FORWARD, linewidth=1.8,
              label="training", zorder=3)  # fmt: skip
    axes.plot(x, held, color=REVERSE, marker="D", markersize=5, linestyle="none", label="held out",
              zorder=4)  # fmt: skip
    floor = _floor(axes, diagnosis.noise, shown)
    _decades(axes, "y", [v for v in (*train, *held, *floor) if math.isfinite(v)])
    for k, (left, right) in enumerate(zip(train, held, strict=True)):
        axes.annotate(rounded(left, 3), (k - 0.45, left), (0, 3), textcoords="offset points", ha="left",
                      va="bottom", fontsize=8.5, color=FORWARD, zorder=6)  # fmt: skip
        above = not right < left
        if math.isfinite(right) and len(steps) <= _MOST_LABELLED:
            axes.annotate(rounded(right, 3), (k, right), (6, 3 if above else -3), textcoords="offset points",
                          ha="left", va="bottom" if above else "top", fontsize=8.5, color=REVERSE,
                          zorder=6)  # fmt: skip
    start = "\n".join(spoken(name) for name in diagnosis.start.names[:3]) or "no effect"
    names = [f"start:\n{start}", *(f"+ {_wrapped(step.effect)}" for step in steps)]
    turned = len(names) > 12
    axes.set_xticks(x, [figure_text(name) if turned else name for name in names], rotation=60 if turned else 0,
                    ha="right" if turned else "center")  # fmt: skip
    for label in axes.get_xticklabels()[1:]:
        label.set_color(INK)
    axes.set_xlim(-0.6, len(train) - 0.4)
    axes.grid(visible=False, axis="x")
    axes.set_ylabel(f"RMS of the residual ({shown.symbol})")
    legend_above(figure, axes, 4)
    return figure


def _wrapped(name: str) -> str:
    return "\n".join(figure_text(word) for word in spoken(name).split())


def _floor(axes: Axes, noise: NoiseFloor, shown: Shown) -> tuple[float, ...]:
    """Draw the noise floor with twice the standard error of its estimate; return its edges."""
    if noise.floor is None:
        return ()
    level = noise.floor * shown.factor
    wide = 2.0 * noise.relative_error
    low, high = level * max(1.0 - wide, 0.05), level * (1.0 + wide)
    axes.axhspan(low, high, color=BAND, zorder=0, label="noise floor, ± 2 standard errors")
    axes.axhline(level, color=NEUTRAL, linewidth=0.9, zorder=1)
    return low, high
