"""How predictors were fitted: learning curves of networks, and the spacings of tables that were tried."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.predictors.fitting.algorithms import Algorithm
from rtec.predictors.fitting.samples import FEWEST_POINTS_A_TURN
from rtec.report.figures_style import guide, magnitudes
from rtec.report.palette import AMBER, BLUE, BROWN, GUIDE, GUIDE_LINE, INK, PURPLE, VERMILION

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rtec.training import PredictorComparison, Row

ALGORITHMS = {
    Algorithm.RPROP: (VERMILION, ":"),
    Algorithm.SCG: (PURPLE, "-."),
    Algorithm.BFGS: (BLUE, "--"),
    Algorithm.LM: (INK, "-"),
}
"""Colour and line of each training algorithm, in the order of Table 4-1 of the thesis."""


def draw_courses(panels: list[Axes], designs: dict[str, list[Row]]) -> None:
    """Draw how the networks of each design learned, a design in each panel."""
    errors: list[float] = []
    for axes, (design, rows) in zip(panels, designs.items(), strict=True):
        last = 1
        for row in rows:
            name = row.name.rsplit(" ", 1)[1]
            colour, line = ALGORITHMS[Algorithm(name)]
            for course in row.courses:
                seen = 1e3 * np.array(course.unseen_mm)
                last = max(last, seen.size)
                errors += [float(seen.min()), float(seen[0])] if seen.size else []
                width, strength, label = (1.2, 1.0, name) if course is row.courses[-1] else (0.8, 0.45, None)
                axes.plot(np.arange(1, seen.size + 1), seen, line, color=colour, linewidth=width, alpha=strength,
                          label=label)  # fmt: skip
        several = any(len(row.courses) > 1 for row in rows)
        axes.set_title(f"{design}{' (pale: the first)' if several else ''}")
        axes.set_xlabel("epoch of the best start")
        magnitudes(axes, "x", [1.0, float(last)])
        axes.legend(loc="upper right", fontsize=7.5)
    magnitudes(panels[0], "y", errors)
    panels[0].set_ylabel("error on the readings\nthat stop a training, µm")


def draw_spacings(axes: Axes, result: PredictorComparison) -> None:
    """Draw the error of each spacing of a table that was tried, and mark what was chosen."""
    tables = [row for row in result.rows if row.tried]
    spacings, errors = [], []
    for row in tables:
        spacing, rms = np.array(sorted(row.tried)).T
        colour = AMBER if "bi-" in row.name else BROWN
        line = "--" if row.name.endswith("cubic") else "-"
        axes.plot(spacing, 1e3 * rms, line, color=colour, marker=".", markersize=4.0, linewidth=1.1,
                  label=row.name.removeprefix("table "))  # fmt: skip
        chosen = int(np.argmin(rms))
        axes.plot(spacing[chosen], 1e3 * rms[chosen], "o", color=colour, markersize=8.0, markerfacecolor="none")
        axes.plot(spacing[chosen], 1e3 * (row.rms_heldout_mm or 0.0), "x", color=colour, markersize=6.0)
        spacings += list(spacing)
        errors += [*(1e3 * rms), 1e3 * (row.rms_heldout_mm or 0.0)]
    axes.set(xlabel="distance of the points, mm", ylabel="error, RMS, µm")
    axes.set_title("Tables: tried (dots), chosen (ring), judged (×)")
    if not tables:
        axes.text(0.5, 0.5, "no table has a figure", transform=axes.transAxes, ha="center", color=INK)
        return
    if result.pitch_mm is not None:
        guide(axes, x=result.pitch_mm / FEWEST_POINTS_A_TURN)
        axes.plot(
            [], [], color=GUIDE, linewidth=1.0, linestyle=GUIDE_LINE, label=f"{FEWEST_POINTS_A_TURN} points a turn"
        )
    magnitudes(axes, "x", spacings)
    magnitudes(axes, "y", errors)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7.5)
