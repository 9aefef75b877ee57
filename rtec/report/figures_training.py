"""A comparison of predictors as a picture: errors against size and time, what is left, how networks learned."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rtec.errors import ArgumentError
from rtec.report.figures_style import GUIDE, INK, guide, new_figure, write_figure
from rtec.training.results import BASE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rtec.predictors.fitting.samples import Samples
    from rtec.training import PredictorComparison, Row

COLOURS = {"table": "#d17a00", "model": "#2a7f3f", "network": "#2457a6", BASE: GUIDE}
_MARKS = {"table": "s", "model": "D", "network": "o"}
_MOST_POINTS = 3000
_BINS = 60


def training_figure(result: PredictorComparison) -> Figure:
    """Return the picture of a comparison.

    Left above, the held-out error of each predictor; right above, against the numbers that were fitted; in the
    middle, what the best predictor leaves along the axis and within a turn of the screw; below, how networks learned.

    Parameters
    ----------
    result
        With one row at least that has a figure.

    Raises
    ------
    ArgumentError
        No row has one.
    """
    rows = [row for row in result.ranked if row.works]
    if not rows:
        raise ArgumentError("figure", "no predictor has a figure", "one at least")
    turns = result.pitch_mm is not None
    figure = new_figure(height_inch=11.0)
    figure.set_layout_engine(
        "constrained", w_pad=0.2
    )  # tick labels of logarithmic axes are wider than it takes them for
    grid = figure.add_gridspec(3, 2, height_ratios=(1.3, 1.0, 1.1))
    _draw_errors(figure.add_subplot(grid[0, 0]), result, rows)
    _draw_sizes(figure.add_subplot(grid[0, 1]), result, rows)
    _draw_left(figure.add_subplot(grid[1, 0] if turns else grid[1, :]), result.parts.heldout, rows[0], None)
    if turns:
        _draw_left(figure.add_subplot(grid[1, 1]), result.parts.heldout, rows[0], result.pitch_mm)
    _draw_courses(figure.add_subplot(grid[2, :]), rows)
    figure.draw_without_rendering()  # logarithmic axes know their labels, and so their margins, only once drawn
    return figure


def write_training_figure(path: Path, result: PredictorComparison) -> None:
    """Write the picture of a comparison as .png, .svg or .pdf.

    Raises
    ------
    ArgumentError
        No row has a figure.
    OutputError
        The file cannot be written.
    """
    write_figure(lambda: training_figure(result), path)


def _draw_errors(axes: Axes, result: PredictorComparison, rows: list[Row]) -> None:
    y = np.arange(len(rows))[::-1]
    for place, row in zip(y, rows, strict=True):
        axes.plot(_um(row.rms_heldout_mm), place, _MARKS[row.kind], color=COLOURS[row.kind], markersize=6)
        axes.plot(_um(row.worst_heldout_mm), place, "|", color=COLOURS[row.kind], markersize=8)
    axes.set_yticks(y, [_short(row) for row in rows], fontsize=7.5)
    axes.set(xscale="log", xlabel="held-out error, µm: RMS (mark), largest (bar)")
    axes.set_title("Error on readings that no predictor has seen")
    _plain_numbers(axes.xaxis)
    if result.noise_mm:
        axes.axvline(1e3 * result.noise_mm, color=INK, linewidth=0.9, linestyle="--")


def _short(row: Row) -> str:
    return row.name.replace("-directional", "").removeprefix("network ")


def _um(value_mm: float | None) -> float:
    return 1e3 * (value_mm or 0.0)


def _plain_numbers(axis: Any) -> None:
    """Label a logarithmic axis with 1, 2, 5, 10, ... in place of powers of ten."""
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter  # noqa: PLC0415 - heavy, as the style

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FormatStrFormatter("%g"))
    axis.set_minor_formatter(NullFormatter())


def _draw_sizes(axes: Axes, result: PredictorComparison, rows: list[Row]) -> None:
    for kind, mark in _MARKS.items():
        these = [row for row in rows if row.kind == kind]
        if these:
            axes.scatter(
                [row.parameters or 1 for row in these],
                [1e3 * (row.rms_heldout_mm or 0.0) for row in these],
                s=[12.0 + 14.0 * np.log10(1.0 + 10.0 * (row.train_s or 0.0)) for row in these],
                color=COLOURS[kind],
                marker=mark,
                alpha=0.8,
                label={"model": "effects"}.get(kind, kind),
            )
    if result.noise_mm:
        axes.axhline(1e3 * result.noise_mm, color=INK, linewidth=0.9, linestyle="--", label="repeatability")
    axes.set(xscale="log", yscale="log", xlabel="numbers fitted", ylabel="held-out error, RMS, µm")
    _plain_numbers(axes.xaxis)
    _plain_numbers(axes.yaxis)
    axes.set_title("Against size; larger marks took longer")
    axes.legend(loc="best")


def _draw_left(axes: Axes, heldout: Samples, best: Row, pitch_mm: float | None) -> None:
    left = 1e3 * best.left_mm(heldout)
    x = heldout.position_mm if pitch_mm is None else heldout.position_mm % pitch_mm
    every = max(1, left.size // _MOST_POINTS)
    for way, colour, words in ((1.0, "#2457a6", "forward"), (-1.0, "#c1121f", "reverse")):
        rows = heldout.direction == way
        axes.plot(x[rows][::every], left[rows][::every], ".", color=colour, markersize=2.0, alpha=0.45)
        middle, mean = _means(x[rows], left[rows])
        axes.plot(middle, mean, color=colour, linewidth=1.3, label=words)
    guide(axes, y=0.0)
    where = "along the axis" if pitch_mm is None else "within a turn"
    axes.set_xlabel("position, mm" if pitch_mm is None else "place in the turn, mm")
    axes.set_ylabel("left, µm")
    axes.set_title(f"Left {where} by {best.name}")
    axes.legend(loc="upper right", ncols=2)


def _means(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return middles of bins and the mean in each that holds a reading."""
    if x.size == 0:
        return x, y
    edges = np.linspace(x.min(), x.max() + 1e-9, min(_BINS, max(2, x.size // 4)) + 1)
    bin_of = np.searchsorted(edges, x, side="right") - 1
    counts = np.bincount(bin_of, minlength=edges.size - 1)
    sums = np.bincount(bin_of, y, edges.size - 1)
    there = counts > 0
    return (0.5 * (edges[1:] + edges[:-1]))[there], sums[there] / counts[there]


def _draw_courses(axes: Axes, rows: list[Row]) -> None:
    networks = [row for row in rows if row.courses]
    styles = {"lm": "-", "bfgs": "--", "scg": "-.", "rprop": ":"}
    colours = dict(zip(sorted({row.name.rsplit(" ", 1)[0] for row in networks}), ("#2457a6", "#d17a00", "#2a7f3f"),
                       strict=False))  # fmt: skip
    for row in networks:
        design, algorithm = row.name.rsplit(" ", 1)
        course = row.courses[-1]
        axes.plot(
            np.arange(1, len(course.unseen_mm) + 1),
            1e3 * np.array(course.unseen_mm),
            styles.get(algorithm, "-"),
            color=colours[design],
            linewidth=1.1,
            label=_short(row),
        )
    axes.set(xscale="log", yscale="log", xlabel="epoch of the best start", ylabel="error on choosing readings, µm")
    _plain_numbers(axes.xaxis)
    _plain_numbers(axes.yaxis)
    axes.set_title("How networks learned (of two networks, the second)")
    if networks:
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=7.5)
