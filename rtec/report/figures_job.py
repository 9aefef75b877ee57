"""One job of a campaign as a picture: words over the whole recording, lines around each moment that matters."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.report.figures_style import new_figure
from rtec.report.waveform import Groups, View, draw_marked, draw_sides, inches_of, sides_of, steps_of
from rtec.units import symbol
from rtec.verify.campaign.trace import Trace, Word

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TITLE_INCH = 0.4
_MOST_CHANGES = 30
_LONGEST_LINE = 90
"""Letters of a title in one line."""


def job_figure(trace: Trace) -> Figure:
    """Draw what was seen of a job; time counts from the first moment that matters.

    Examples
    --------
    >>> from rtec.verify.safety.trace import trace_of
    >>> words = {"design": "c", "phase": "cutting", "fault": "pc-killed", "second": "none"}
    >>> [axes.get_xlabel() for axes in job_figure(trace_of(words, seed=1, run=0)).axes]
    ['time since PC killed (ms)', 'time since PC killed (ms)', 'time since PC killed (ms)']
    """
    totals = {"requested": steps_of(trace.requested), "completed": steps_of(trace.completed)}
    sides = sides_of(trace.encoder, trace.controller)
    panels: list[tuple[Groups, tuple[int, int], bool]] = []
    if trace.words:
        panels.append((_words(trace.words) | {"steps": totals}, (trace.from_ps, trace.until_ps), False))
    groups = sides if trace.words else sides | {"steps": totals}
    panels += [(groups, window_ps, True) for window_ps in trace.windows_ps]
    heights = [inches_of(groups) for groups, _, _ in panels]
    figure = new_figure(sum(heights) + _TITLE_INCH)
    drawings = figure.subplots(len(panels), 1, squeeze=False, gridspec_kw={"height_ratios": heights})[:, 0]
    for axes, (groups, window_ps, lines) in zip(drawings, panels, strict=True):
        view = _view(trace, window_ps)
        marks = [mark for mark in trace.marks if window_ps[0] <= mark[0] <= window_ps[1]]
        if lines:
            draw_sides(axes, view, groups, (trace.encoder, trace.controller, trace.completed), marks=marks)
        else:
            draw_marked(axes, view, groups, marks)
    figure.suptitle(_in_lines(trace.title), fontweight="bold")
    return figure


def _view(trace: Trace, window_ps: tuple[int, int]) -> View:
    if not trace.marks:
        return View(*window_ps)
    zero_ps, word = trace.marks[0]
    width_ps = window_ps[1] - window_ps[0]
    unit = "ms" if width_ps > 2 * 10**9 else "us"
    view = View(*window_ps, zero_ps, unit)
    view.label = f"time since {word} ({symbol(unit)})"
    return view


def _words(words: tuple[Word, ...]) -> Groups:
    """Return the rows of words, without those that change too often to be read."""
    groups: Groups = {}
    for word in (one for one in words if one.times_ps.size <= _MOST_CHANGES):
        if word.texts is None:
            values = word.values
        else:
            values = np.array([word.texts.get(value, str(value)) for value in word.values.tolist()])
        groups.setdefault(word.scope.replace("_", " "), {})[word.name.replace("_", " ")] = word.times_ps[1:], values
    return groups


def _in_lines(title: str) -> str:
    """Break a long title once, near its middle."""
    if len(title) <= _LONGEST_LINE:
        return title
    at = title.find(" ", len(title) // 2)
    return title if at < 0 else f"{title[:at]}\n{title[at + 1 :]}"
