"""Spectra of what was there before and of what is left, with the level that noise alone does not reach."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Floats
from rtec.inference.model import Model
from rtec.inference.results import NoiseFloor
from rtec.inference.spectra import (
    PROBABILITY,
    Spectrum,
    highest_frequency,
    mirrored,
    sampling_of,
    spectrum,
    threshold,
)
from rtec.readable import rounded
from rtec.report.diagnosis.quantities import shown_for
from rtec.report.diagnosis.readings import residual
from rtec.report.figures_style import legend_above, new_figure
from rtec.report.palette import ALARM, FORWARD, INK, LIMIT_LINE, NEUTRAL, PALE, PAPER, SHADE
from rtec.units import symbol

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LINES_PER_SPAN = 2000
"""Periods over the span that the spectrum of a moving log goes up to."""
_COLUMNS = 1200
_FEWEST = 8
_ROOM = 1.15
_FAR = 0.55
_CROWDED, _CROWDED_MIRRORED = 8.0, 12.0
"""Highest frequency over that of the highest line from which on an axis is logarithmic."""
_MANY = 300
_SIGN = 0.0075
"""Width of a letter of a mark, as a share of the axis."""
_MOST_MARKS = 40


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Axis:
    """What a spectrum is taken over, and what the places allow."""

    x: Floats
    label: str
    factor: float
    """From cycles per unit of ``x`` to the unit of the label."""
    top: float
    nyquist: float | None
    step: float | None
    """Of regular targets."""
    spacing: float
    lines: tuple[tuple[float, str], ...]
    logarithmic: bool


def spectra_figure(dataset: Dataset, before: Model | None, after: Model, noise: NoiseFloor) -> Figure | None:
    """Return spectra over position and, where there is time beside it, over time; None for very few places."""
    c = dataset.coordinates
    found = [axis for axis in (_over_position(c, after), _over_time(c)) if axis is not None]
    if not found:
        return None
    shown = shown_for(dataset)
    left = [("left by the model", FORWARD, residual(dataset, after) * shown.factor)]
    if before is not None:
        left.insert(0, ("before", NEUTRAL, residual(dataset, before) * shown.factor))
    figure = new_figure(3.3 * len(found) + 0.4)
    panels = figure.subplots(len(found), 1, squeeze=False)[:, 0]
    for axes, axis in zip(panels, found, strict=True):
        _panel(axes, axis, left, noise, shown.factor)
        axes.set_ylabel(f"amplitude ({shown.symbol})")
    legend_above(figure, panels[0], 4)
    return figure


def _over_position(c: Conditions, model: Model) -> _Axis | None:
    places = c.places
    if places.size < _FEWEST:
        return None
    sampling = sampling_of(places)
    regular = sampling.step is not None
    held = not c.moving and not c.time_is_coordinate
    lines = _found_lines(model, symbol(c.position_unit))
    wanted = (2.0 - 1.0 / places.size) * sampling.nyquist if held else min(_LINES_PER_SPAN / c.span, sampling.nyquist)
    if not (held and regular):  # places that are not regular show lines beyond, too
        wanted = max([wanted, *(_ROOM * line for line, _ in lines)])
    per, factor = (
        ("cycles per turn", 360.0) if c.position_unit == "deg" else (f"cycles/{symbol(c.position_unit)}", 1.0)
    )
    label = "frequency in time (Hz)" if c.time_is_coordinate else f"frequency along the axis ({per})"
    moves = np.abs(np.diff(c.position))
    wide = _wide(c, wanted, lines, _CROWDED_MIRRORED if held and regular else _CROWDED)
    if wide and held:
        wanted = sampling.nyquist  # mirror images would be crowded at the end of a logarithmic axis
    top = highest_frequency(c.span, wanted)
    return _Axis(
        x=c.position,
        label=label,
        factor=factor,
        top=top,
        nyquist=sampling.nyquist if held and not wide else None,
        step=sampling.step if held and not wide else None,
        spacing=float(np.median(moves[moves > 0])),
        lines=lines,
        logarithmic=wide,
    )


def _wide(c: Conditions, top: float, lines: tuple[tuple[float, str], ...], crowded: float) -> bool:
    """Return whether the lines crowd at the low end, or would in a log that shows many periods."""
    if lines:
        return max(line for line, _ in lines) < top / crowded
    return c.moving and top * c.span > _MANY


def _found_lines(model: Model, unit: str) -> tuple[tuple[float, str], ...]:
    """Return frequency and label of every harmonic of the model's periodic effects, fundamentals first.

    Harmonics of several families would be mistaken for each other: they have marks without labels.
    """
    terms = [(term, period) for term in model.terms if term.fitted and (period := term.period) is not None]
    lines = [(1 / period, f"{rounded(period, 4)} {unit}") for _, period in terms]
    for term, period in terms:
        for h in range(2, term.harmonics + 1):
            lines.append((h / period, f"{h}×" if len(terms) == 1 else ""))
    return tuple(lines)


def _over_time(c: Conditions) -> _Axis | None:
    if c.time_s is None or c.time_is_coordinate or np.ptp(c.time_s) <= 0 or c.rows < _FEWEST:
        return None
    gaps = np.diff(np.unique(c.time_s))
    step = float(np.median(gaps))
    slow = 0.5 / step < 0.1
    return _Axis(
        x=c.time_s,
        label=f"frequency in time ({'mHz' if slow else 'Hz'})",
        factor=1e3 if slow else 1.0,
        top=highest_frequency(float(np.ptp(c.time_s)), 0.5 / step),
        nyquist=None,
        step=None,
        spacing=step,
        lines=(),
        logarithmic=c.moving,
    )


def _panel(axes: Axes, axis: _Axis, left: list[tuple[str, str, Floats]], noise: NoiseFloor, factor: float) -> None:
    lowest, highest = np.inf, 0.0
    for label, colour, values in left:
        found = _thinned(spectrum(axis.x, values, axis.top))
        axes.plot(found.frequency * axis.factor, found.amplitude, color=colour, linewidth=1.0, label=label)
        highest = max(highest, float(found.amplitude.max()))
        lowest = min(lowest, float(np.median(found.amplitude)))
    aliased_from = axis.nyquist if axis.step is not None and axis.nyquist is not None else axis.top
    level = factor * threshold(found.frequency, noise, rows=axis.x.size,
                               resolved=aliased_from * float(np.ptp(axis.x)), spacing=axis.spacing)  # fmt: skip
    axes.plot(found.frequency * axis.factor, level, color=ALARM, linestyle=LIMIT_LINE, linewidth=1.2,
              label=f"noise alone passes it anywhere with p = {PROBABILITY:g}")  # fmt: skip
    highest = max(highest, float(level.max()))
    if highest > 0.0:
        bottom = max(min(lowest, float(level.min())) / 4.0, highest * 1e-5)
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:.10f}".rstrip("0").rstrip("."))
        axes.set_ylim(bottom, highest * (highest / bottom) ** 0.28)
    if axis.logarithmic:
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:.10f}".rstrip("0").rstrip("."))
    axes.set_xlim(found.frequency[0] * axis.factor if axis.logarithmic else 0.0, axis.top * axis.factor)
    axes.set_xlabel(axis.label)
    _marks(axes, axis)


def _thinned(found: Spectrum) -> Spectrum:
    """Return the largest amplitude of each stretch, where there are more frequencies than a figure can show."""
    if found.frequency.size <= 2 * _COLUMNS:
        return found
    starts = np.unique(np.linspace(0, found.frequency.size, _COLUMNS, endpoint=False).astype(np.int64))
    peaks = np.maximum.reduceat(found.amplitude, starts)
    where = np.append(starts[1:], found.frequency.size) - 1
    return Spectrum(frequency=(found.frequency[starts] + found.frequency[where]) / 2, amplitude=peaks)


def _marks(axes: Axes, axis: _Axis) -> None:
    """Mark the model's lines, their aliases, and the frequency beyond which targets show everything twice."""
    if axis.nyquist is not None and axis.nyquist < axis.top:
        axes.axvspan(axis.nyquist * axis.factor, axis.top * axis.factor, color=SHADE, alpha=0.05, linewidth=0)
        words = "beyond the Nyquist limit of the targets" + (
            ": everything is mirrored" if axis.step is not None else "' mean distance"
        )
        right = axis.nyquist > _FAR * axis.top
        at = axis.top if right else axis.nyquist
        _word(axes, at * axis.factor, 0.99, f" {words} ", "right" if right else "left", "top", INK)
    marks = []
    for frequency, name in axis.lines[:_MOST_MARKS]:
        if frequency <= axis.top:
            marks.append((frequency, name, INK))
        if axis.step is not None:
            words = f"alias of {name}" if name else ""
            marks += [(alias, words, PALE) for alias in mirrored(frequency, axis.step, axis.top)]
    taken: list[tuple[float, float]] = []
    for frequency, name, colour in sorted(marks, key=lambda mark: mark[2] == PALE):
        x = frequency * axis.factor
        axes.plot(x, 0.82, marker="v", color=colour, markersize=5, transform=axes.get_xaxis_transform(),
                  markerfacecolor=PAPER if colour == PALE else colour)  # fmt: skip
        middle = float(axes.transAxes.inverted().transform(axes.transData.transform((x, 1.0)))[0])
        half = 0.5 * _SIGN * (len(name) + 1)
        across = "left" if middle < half else "right" if middle > 1 - half else "center"
        if name and all(middle + half < left or middle - half > right for left, right in taken):
            taken.append((middle - half, middle + half))
            _word(axes, x, 0.85, name, across, "bottom", colour)


def _word(axes: Axes, x: float, height: float, text: str, across: str, up: str, colour: str) -> None:
    axes.annotate(text, (x, height), xycoords=axes.get_xaxis_transform(), ha=across, va=up, fontsize=8.0,
                  color=colour).set_in_layout(False)  # fmt: skip
