"""The stack of contributions as a picture: what is left with each predictor and each design, in squares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from contributions import (
    CAUSES,
    COVARIANCE,
    INTERPOLATION,
    REPEATABILITY,
    REST,
    ROUNDING,
    SHAPE,
    TIMING,
    TRAINING,
    Stack,
    root,
)
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from rtec.report.figures_style import figure_style, new_figure, rendered

COLOURS = {
    REPEATABILITY: "#999999",
    INTERPOLATION: "#0072b2",
    SHAPE: "#56b4e9",
    TRAINING: "#009e73",
    COVARIANCE: "#c8e6c9",
    ROUNDING: "#d55e00",
    TIMING: "#e69f00",
    REST: "#4d4d4d",
}
"""Those of Okabe and Ito, told apart by colour-blind readers."""
WORDS = {
    REPEATABILITY: "repeatability of the readings",
    INTERPOLATION: "interpolation",
    SHAPE: "shape of the predictor",
    TRAINING: "noise in its training readings",
    COVARIANCE: "covariance of these three",
    ROUNDING: "rounding to the step",
    TIMING: "timing of the insertion",
    REST: "where the axis comes to rest",
}
SHORT = ("ideal", "Orig.", "A", "B", "C")


def stack_figure(stacks: Sequence[Stack], titles: Mapping[str, str]) -> bytes:
    """Return a PNG with a panel for each title's predictor and a bar for each way of inserting, ideal first."""
    with figure_style():
        figure = new_figure(4.6)
        panels = figure.subplots(1, len(titles))
        for panel, (name, title) in zip(panels, titles.items(), strict=True):
            shown = [stack for stack in stacks if stack.recipe == name]
            handles = _bars(panel, shown)
            panel.set_title(title)
            panel.set_xticks(range(len(shown)), SHORT[: len(shown)])
            panel.set_xlabel("inserted by")
            panel.grid(visible=False, axis="x")
        panels[0].set_ylabel("mean square of what is left, µm²")
        words = [*(WORDS[cause] for cause in CAUSES), "whole, as measured; its root in µm above"]
        figure.legend(handles, words, loc="outside lower center", ncols=3)
        return rendered(figure)[1]


def _bars(panel: Axes, shown: Sequence[Stack]) -> list[Artist]:
    """Draw the bars of a panel, what adds upwards, what takes away downwards; return what a legend needs."""
    up, down = [0.0] * len(shown), [0.0] * len(shown)
    handles: list[Artist] = []
    places = range(len(shown))
    for cause in CAUSES:
        heights = [stack.alone[cause] for stack in shown]
        begins = [up[k] if height >= 0.0 else down[k] for k, height in enumerate(heights)]
        hatch = "//" if cause == COVARIANCE else None
        handles.append(
            panel.bar(
                places, heights, 0.7, begins, color=COLOURS[cause], hatch=hatch, edgecolor="white", linewidth=0.3
            )
        )
        for k, height in enumerate(heights):
            up[k] += max(height, 0.0)
            down[k] += min(height, 0.0)
    whole = [stack.whole for stack in shown]
    handles += panel.plot(places, whole, "D", color="black", markersize=4.0, markeredgecolor="white")
    top = max(*up, *whole)
    for k, stack in enumerate(shown):
        panel.text(k, max(up[k], whole[k]) + 0.02 * top, f"{root(stack.whole):.2f}", ha="center", va="bottom")
    panel.set_ylim(min(*down, 0.0) * 1.08, 1.1 * top)
    panel.axhline(0.0, color="#888888", linewidth=0.8)
    return handles
