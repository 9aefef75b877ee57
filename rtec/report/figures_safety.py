"""The safety case drawn: every fault in every phase of operation, by what happens at the controller."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rtec.injector import Design
from rtec.report.figures_style import new_figure
from rtec.report.palette import ALARM, DELAYED, EDGE, INK, PAPER, SAFE, STOPPED, UPSTREAM
from rtec.verify.safety.matrix import Matrix, Outcome
from rtec.verify.safety.phases import Phase

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ABOVE_INCH = 1.6
"""Legend, titles and names of the phases."""
_UPSTREAM = "undetected: before the box"
_LOOKS = {
    Outcome.TOLERATED.value: (SAFE, "t", "tolerated"),
    Outcome.DELAYED.value: (DELAYED, "d", "delayed"),
    Outcome.SAFE_STOP.value: (STOPPED, "s", "safe stop"),
    _UPSTREAM: (UPSTREAM, "u", "undetected, begins before the box"),
    Outcome.UNDETECTED.value: (ALARM, "U", "undetected, begins at box, link or PC"),
    Outcome.NOT_APPLICABLE.value: (PAPER, "–", "not applicable"),
}
"""Colour, letter and words; the letters tell them apart in grey print, too."""


def safety_figure(matrix: Matrix) -> Figure:
    """Return a figure with a row for each fault and a column for each phase, Design B on its own."""
    variants = matrix.plan.variants
    height_inch = _ABOVE_INCH + 0.19 * len(variants) + 0.1
    figure = new_figure(height_inch)
    figure.set_layout_engine("none")  # a constrained layout cuts the longest names off
    groups = matrix.plan.groups
    room = {"left": 0.3, "right": 0.99, "top": 1.0 - _ABOVE_INCH / height_inch, "bottom": 0.1 / height_inch}
    panels = figure.subplots(1, len(groups), sharey=True, squeeze=False, gridspec_kw=room | {"wspace": 0.05})[0]
    for axes, (title, designs) in zip(panels, groups, strict=True):
        _panel(axes, matrix, designs)
        axes.set_title(title, pad=58)
    panels[0].set_yticks(range(len(variants)), [variant.name for variant in variants], fontsize=7.5)
    from matplotlib.patches import Patch  # noqa: PLC0415 - half a second, needed only where something is drawn

    marks = [
        Patch(facecolor=colour, edgecolor=EDGE, label=f"{letter}  {words}")
        for colour, letter, words in _LOOKS.values()
    ]
    figure.legend(handles=marks, loc="upper left", ncols=3)
    return figure


def _panel(axes: Axes, matrix: Matrix, designs: Sequence[Design]) -> None:
    from matplotlib.patches import Rectangle  # noqa: PLC0415 - as above

    for y, variant in enumerate(matrix.plan.variants):
        for x, phase in enumerate(matrix.plan.phases):
            outcome = matrix.worst(variant, phase, designs)
            name = _UPSTREAM if outcome is Outcome.UNDETECTED and variant.upstream else outcome.value
            colour, letter, _ = _LOOKS[name]
            axes.add_patch(Rectangle((x - 0.5, y - 0.5), 1.0, 1.0, facecolor=colour, edgecolor=PAPER))
            ink = PAPER if name == Outcome.UNDETECTED.value else INK
            axes.text(x, y, letter, ha="center", va="center", fontsize=7.0, color=ink)
    axes.set_xlim(-0.5, len(matrix.plan.phases) - 0.5)
    axes.set_ylim(len(matrix.plan.variants) - 0.5, -0.5)
    axes.set_xticks(range(len(matrix.plan.phases)), [_short(phase) for phase in matrix.plan.phases],
                    rotation=60, ha="left", fontsize=8.0)  # fmt: skip
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _short(phase: Phase) -> str:
    return phase.value.replace(" correction", "")
