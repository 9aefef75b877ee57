"""The table of three axes as a picture: what each correction leaves of each axis."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from rtec.report.figures_style import new_figure

COLOURS = ("#777777", "#e69f00", "#56b4e9", "#0072b2", "#009e73", "#7b3294")
"""Of the corrections, in their order."""


def axes_figure(left_um: Mapping[str, npt.NDArray[np.float64]]) -> Figure:
    """Return bars of root mean squares and lines up to the largest, for each axis a group.

    Parameters
    ----------
    left_um
        Deviations in µm by what corrected them, a column for each axis.
    """
    figure = new_figure(3.8)
    axes = figure.add_subplot()
    width = 0.8 / len(left_um)
    for place, (name, deviation) in enumerate(left_um.items()):
        rms, largest = np.sqrt(np.mean(deviation**2, axis=0)), np.abs(deviation).max(axis=0)
        x = np.arange(rms.size) + (place - 0.5 * (len(left_um) - 1)) * width
        colour = COLOURS[place]
        axes.bar(x, rms, 0.9 * width, color=colour, label=name)
        axes.vlines(x, rms, largest, color=colour, linewidth=1.0)
        axes.plot(x, largest, "_", color=colour, markersize=8.0)
        for each, value in zip(x, rms, strict=True):
            axes.annotate(f"{value:.2f}", (each, value), (4, 1), textcoords="offset points", fontsize=7.5)
    axes.set_xticks(range(rms.size), [f"axis {k + 1}" for k in range(rms.size)])
    axes.grid(visible=False, axis="x")
    axes.set_ylabel("left, µm: RMS (bar), largest (line)")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=len(left_um))
    return figure
