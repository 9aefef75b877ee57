"""What a model consists of, which effects look alike on the plan, and what would tell rivals apart."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Floats
from rtec.inference.model import Model, Term
from rtec.inference.results import Cosines, Experiment
from rtec.report.diagnosis.likeness import ALIKE, nested
from rtec.report.diagnosis.quantities import Shown, shown_for
from rtec.report.diagnosis.readings import (
    ALL,
    AT_REST,
    FORWARD,
    NEUTRAL,
    REVERSE,
    Abscissa,
    Way,
    abscissas,
    at_places,
    figure_text,
    outline,
    period_of,
    phase,
    some_rows,
    ways,
)
from rtec.report.diagnosis.sentence import spoken, term_words
from rtec.report.figures_style import ALARM, GUIDE, INK, legend_above, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_OVER = {
    "servo_lag": "velocity",
    "viscous": "velocity",
    "coulomb": "velocity",
    "asymmetric_friction": "velocity",
    "stribeck": "velocity",
    "acceleration_lag": "acceleration",
    "inertia": "acceleration",
    "windup": "since_reversal",
}
"""What a contribution is drawn over, where that is neither position nor, for what changes in time, time."""
_MOST_TERMS = 12
_FINE = 400
_MOST_NAMES = 24
_FEW_TURNS = 4
"""Periods over the travel above which one period is drawn, not the travel."""
_RIVALS = ((FORWARD, "-"), (REVERSE, "--"), ("#009e73", "-."), ("#cc79a7", ":"), ("#e69f00", (0, (5, 1))))


def components_figure(dataset: Dataset, model: Model) -> Figure | None:
    """Return the contribution of each effect in a panel of its own, all in one unit."""
    terms = [term for term in model.terms if term.fitted][:_MOST_TERMS]
    if not terms:
        return None
    c, shown = dataset.coordinates, shown_for(dataset)
    axes_of = {one.name: one for one in reversed(abscissas(c))}
    figure = new_figure(1.75 * len(terms) + 0.6)
    panels = figure.subplots(len(terms), 1, squeeze=False)[:, 0]
    for axes, term in zip(panels, terms, strict=True):
        values = term.component(dataset)
        over = _abscissa(term, c, axes_of)
        if over.name == "phase" and dataset.resample is None:
            _wave(axes, c, term, shown)
        _component(axes, c, over, values * shown.factor)
        axes.set_title(
            f"{figure_text(term_words(term))}: RMS {shown.text(float(np.std(values)))}, "
            f"peak to peak {shown.with_unit(float(np.ptp(values)))}"
        )
        axes.set_ylabel(shown.symbol)
    legend_above(figure, panels[0], 3)
    return figure


def _abscissa(term: Term, c: Conditions, axes_of: dict[str, Abscissa]) -> Abscissa:
    wanted = _OVER.get(term.name, "")
    period = period_of(term)
    if period is not None and _FEW_TURNS * period < c.span:
        return phase(c, period)
    if term.effect.in_time:
        wanted = "time" if c.time_s is not None else "order"
    found = axes_of.get(wanted) or axes_of.get("position") or next(iter(axes_of.values()), None)
    return found or Abscissa(name="order", label="row order", values=c.order)


def _wave(axes: Axes, c: Conditions, term: Term, shown: Shown) -> None:
    """Draw one period of a wave, which readings show at some phases only."""
    turn = np.linspace(0.0, 1.0, _FINE)
    for way in ways(c):
        if way.label != AT_REST:
            values = term.contribution(at_places(c, turn * (period_of(term) or 1.0), way)) * shown.factor
            axes.plot(turn, values, color=way.colour, linestyle=way.dash, linewidth=1.2, label=_name(way))


def _component(axes: Axes, c: Conditions, over: Abscissa, values: Floats) -> None:
    axes.axhline(0.0, color=GUIDE, linewidth=0.9, zorder=1)
    for way in ways(c):
        x, y = over.values[way.rows], values[way.rows]
        order = np.argsort(x, kind="stable")
        x, y = x[order], y[order]
        if way.label != AT_REST and over.name != "phase" and _is_line(x, y):
            axes.plot(*outline(x, y), color=way.colour, linestyle=way.dash, linewidth=1.2, label=_name(way),
                      marker=way.marker if x.size < 300 else "", markersize=2.5)  # fmt: skip
        else:
            rows = some_rows(np.ones(x.size, dtype=np.bool_))
            axes.plot(x[rows], y[rows], color=way.colour, linestyle="none", marker=way.marker, markersize=2.2,
                      markeredgewidth=0.0, alpha=0.5,
                      label=None if over.name == "phase" else _name(way))  # fmt: skip
    axes.set_xlabel(over.label)


def _name(way: Way) -> str | None:
    return way.label if way.label != ALL else None


def _is_line(x: Floats, y: Floats) -> bool:
    """Return whether a contribution is a function of what it is drawn over, so that neighbours may be joined."""
    if x.size < 2:
        return False
    same = np.diff(x) <= 1e-6 * float(x[-1] - x[0])
    jumps = np.abs(np.diff(y))[same]
    return not jumps.size or float(jumps.max()) <= 1e-3 * max(float(np.ptp(y)), 1e-300)


def cosines_figure(cosines: Cosines | None) -> Figure | None:
    """Return how alike the effects look on this plan, the size of the cosine in every cell."""
    if cosines is None or len(cosines.names) < 2:
        return None
    from matplotlib.colors import LinearSegmentedColormap  # noqa: PLC0415 - half a second, needed only to draw

    names = [spoken(name) for name in cosines.names[:_MOST_NAMES]]
    size = len(names)
    table = np.abs(cosines.cosine[:size, :size])
    below = np.where(np.tri(size, k=-1, dtype=np.bool_) & np.isfinite(table), table, np.nan)
    figure = new_figure(min(0.36 * size + 1.6, 9.5))
    axes = figure.add_subplot()
    blues = LinearSegmentedColormap.from_list("alike", ["#f4f8fb", "#a9cbe2", FORWARD])
    image = axes.imshow(below[1:, :-1], cmap=blues, vmin=0.0, vmax=1.0, aspect="auto")
    for i in range(1, size):
        for j in range(i):
            _cell(axes, j, i - 1, float(below[i, j]), nested(cosines.names[i], cosines.names[j]))
    axes.set_xticks(np.arange(size - 1), [figure_text(name) for name in names[:-1]], rotation=45, ha="right")
    axes.set_yticks(np.arange(size - 1), [figure_text(name) for name in names[1:]])
    axes.tick_params(length=0)
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    bar = figure.colorbar(image, ax=axes, shrink=0.7, pad=0.02)
    bar.set_label("size of the cosine")
    return figure


def _cell(axes: Axes, column: int, row: int, value: float, special: bool) -> None:
    from matplotlib.patches import Rectangle  # noqa: PLC0415 - as above

    if not np.isfinite(value):
        axes.text(column, row, "–", ha="center", va="center", fontsize=7.5, color="#888888")
        return
    alike = value > ALIKE
    text = f"{value:.2f}" if value < 0.995 or value == 1.0 else f"{value:.3f}"
    axes.text(column, row, text, ha="center", va="center", fontsize=7.5, weight="bold" if alike else "normal",
              color="white" if value > 0.72 else INK)  # fmt: skip
    if alike:
        axes.add_patch(
            Rectangle(
                (column - 0.47, row - 0.44),
                0.94,
                0.88,
                fill=False,
                edgecolor=INK if special else ALARM,
                linestyle=":" if special else "-",
                linewidth=1.8,
            )
        )


def experiment_figure(experiment: Experiment, dataset: Dataset) -> Figure | None:
    """Return what the rivals predict for the suggested experiment; None where there is no prediction."""
    if experiment.abscissa is None or not experiment.predictions:
        return None
    shown = shown_for(dataset)
    figure = new_figure(3.6)
    axes = figure.add_subplot()
    axes.axhline(0.0, color=GUIDE, linewidth=0.9, zorder=1)
    x = np.asarray(experiment.abscissa, dtype=np.float64)
    for k, (name, values) in enumerate(zip(experiment.rivals, experiment.predictions, strict=False)):
        colour, dash = _RIVALS[k % len(_RIVALS)] if k < len(_RIVALS) else (NEUTRAL, "-")
        axes.plot(x, np.asarray(values) * shown.factor, color=colour, linestyle=dash, linewidth=1.7,
                  marker="o" if x.size <= 40 else "", markersize=3.5, label=figure_text(spoken(name)))  # fmt: skip
    axes.set_xlabel(figure_text(experiment.label, 80))
    axes.set_ylabel(f"predicted {figure_text(dataset.observe)} ({shown.symbol})")
    legend_above(figure, axes, 4)
    return figure
