"""What predictors say of an axis and leave of its error: along the travel, between targets, within a turn."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rtec.inference.local_means import neighbour_means
from rtec.predictors._kernels import within_turn
from rtec.predictors.layered import TOUCH_MM
from rtec.report.figures_style import guide
from rtec.report.palette import AMBER, BLUE, FORWARD, GREEN, GREY, GUIDE, INK, REVERSE, VIOLET
from rtec.training.results import Kind

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rtec.predictors.fitting.samples import Samples
    from rtec.training import PredictorComparison, Row

Floats = npt.NDArray[np.float64]

COLOURS = {
    Kind.TABLE: AMBER,
    Kind.GEOMETRY: BLUE,
    Kind.MODEL: GREEN,
    Kind.NETWORK: VIOLET,
    Kind.NONE: GREY,
}
"""Of each kind of predictor."""
_WAYS = ((1.0, FORWARD, "forward"), (-1.0, REVERSE, "reverse"))
_KINDS = {Kind.TABLE: "table", Kind.GEOMETRY: "geometry", Kind.MODEL: "effects", Kind.NETWORK: "network"}
_LINES = {Kind.TABLE: "-", Kind.GEOMETRY: ":", Kind.MODEL: "--", Kind.NETWORK: "-."}
_MOST_POINTS, _MANY = 2000, 200
_FINE = 600
"""Places of a line that is drawn."""
_TURNS, _TARGETS = 2.0, 16
"""How much of the travel is drawn large: turns of the screw, or targets where its pitch is not known."""


def draw_along(axes: Axes, result: PredictorComparison, best: Row) -> None:
    """Draw the readings along the axis and what the best predictor says, in each direction."""
    readings = result.parts.train
    for way, colour, words in _WAYS:
        x, y = _thinned(readings, way)
        if not x.size:
            continue
        axes.plot(x, 1e3 * y, ".", color=colour, markersize=2.0 if x.size > _MANY else 5.0, alpha=0.35)
        places = np.linspace(*readings.span_mm, _FINE)
        axes.plot(places, _says(best, places, way, readings), color=colour, linewidth=0.9, label=words)
    axes.set(xlabel="position, mm", ylabel="error, µm")
    axes.set_title(f"Readings along the axis, and {best.name}")
    _legend(axes)


def draw_between(axes: Axes, result: PredictorComparison, rows: list[Row]) -> None:
    """Draw readings in the middle of the travel, and what the best predictor of each kind says between them.

    The rows have figures, the best first.
    """
    low, high = _middle(result)
    places = np.linspace(low, high, _FINE)
    parts = (result.parts.train, result.parts.choose, result.parts.sure)
    axes.plot([], [], ".", color=INK, label="fitted")
    axes.plot([], [], "o", color=INK, markerfacecolor="none", markersize=4.0, label="judging")
    for way, colour, _ in _WAYS:
        for part in parts:
            axes.plot(*_within(part, way, low, high), ".", color=colour, markersize=3.0, alpha=0.6)
        axes.plot(*_within(result.parts.heldout, way, low, high), "o", color=colour, markerfacecolor="none",
                  markersize=4.0, markeredgewidth=0.9)  # fmt: skip
    measured = set(np.unique(result.parts.train.direction))
    for kind, words in _KINDS.items():
        best = next((row for row in rows if row.kind is kind), None)
        for way, _, _ in _WAYS:
            if best is not None and way in measured:
                says = _says(best, places, way, result.parts.train)
                label = words if way == min(measured) else None
                axes.plot(places, says, _LINES[kind], color=COLOURS[kind], linewidth=1.2, label=label)
    axes.set(xlabel="position, mm", ylabel="error, µm")
    turns = "between the targets" if result.pitch_mm is None else f"{_TURNS:g} turns of the screw"
    axes.set_title(f"In the middle, {turns}: the best of each kind")
    _room_above(axes)
    axes.legend(loc="upper right", ncols=5, fontsize=7.5, columnspacing=1.0, handletextpad=0.4)


def draw_left(axes: Axes, heldout: Samples, best: Row, pitch_mm: float | None) -> None:
    """Draw what a predictor leaves of the readings that judge: along the axis, or within a turn of the screw.

    Without the travel of a turn it is along the axis.
    """
    left = 1e3 * best.left_mm(heldout)
    x = heldout.position_mm
    if pitch_mm is not None:
        x = np.array([within_turn(place, pitch_mm, TOUCH_MM) for place in x])
        axes.set_xlim(-0.02 * pitch_mm, 1.02 * pitch_mm)
    every = max(1, left.size // _MOST_POINTS)
    for way, colour, words in _WAYS:
        rows = heldout.direction == way
        if not rows.any():
            continue
        size = 2.0 if rows.sum() > _MANY else 5.0
        axes.plot(x[rows][::every], left[rows][::every], ".", color=colour, markersize=size, alpha=0.45)
        means = neighbour_means(x[rows], left[rows])
        axes.plot(means.at, means.mean, color=colour, linewidth=1.2, label=f"{words}, mean")
    guide(axes, y=0.0, colour=GUIDE)
    axes.set_xlabel("position, mm" if pitch_mm is None else "place in the turn of the screw, mm")
    axes.set_ylabel("left, µm")
    where = "along the axis" if pitch_mm is None else "within a turn"
    axes.set_title(f"Left {where} by {best.name}")
    _legend(axes)


def _says(row: Row, places_mm: Floats, way: float, readings: Samples) -> Floats:
    """Return what a predictor says, in µm; other axes that it looks at stand in the middle of their readings."""
    if row.predictor is None:
        return np.zeros(places_mm.size)
    others = [np.median(places) for places in readings.seen_by(row.predictor.inputs[2:]).values()]
    return 1e3 * np.asarray(row.predictor.error_mm(places_mm, np.full(places_mm.size, way), *others))


def _thinned(samples: Samples, way: float) -> tuple[Floats, Floats]:
    rows = np.flatnonzero(samples.direction == way)[:: max(1, samples.rows // _MOST_POINTS)]
    return samples.position_mm[rows], samples.error_mm[rows]


def _within(samples: Samples, way: float, low: float, high: float) -> tuple[Floats, Floats]:
    """Return places and errors, in µm, of the readings of one direction between two places."""
    rows = (samples.direction == way) & (samples.position_mm >= low) & (samples.position_mm <= high)
    return samples.position_mm[rows], 1e3 * samples.error_mm[rows]


def _middle(result: PredictorComparison) -> tuple[float, float]:
    """Return the part of the travel that is drawn large: about a place that judges."""
    readings = result.parts.train
    low, high = readings.span_mm
    places = np.unique(readings.position_mm)
    if result.pitch_mm is not None:
        wide = _TURNS * result.pitch_mm
    else:
        wide = _TARGETS * float(np.median(np.diff(places)))
    judged = result.parts.heldout.position_mm
    centre = float(judged[np.argmin(np.abs(judged - 0.5 * (low + high)))])
    return max(low, centre - 0.5 * wide), min(high, centre + 0.5 * wide)


def _legend(axes: Axes) -> None:
    _room_above(axes)
    axes.legend(loc="upper right", ncols=2, fontsize=8.0)


def _room_above(axes: Axes) -> None:
    """Make room for a legend of one line, so that it covers no data."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.14 * (high - low))
