"""A and B on both sides of a box over time: levels, states, counts and totals, for any stretch of any run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rtec.errors import ArgumentError
from rtec.injector import Totals
from rtec.injector.waves import counts_along, insertions
from rtec.report.figures_style import new_figure
from rtec.report.palette import ALARM, FORWARD, INK, REVERSE_LINE, STATE, STATE_EDGE
from rtec.signal import EdgeStream, states_of_levels
from rtec.units import PS_PER, PS_PER_S, symbol

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HIGH = 0.62
"""Of a line's high level; rows stand one unit apart."""
_ROW_INCH, _FRAME_INCH = 0.33, 1.45
_GROUP_APART = 0.75
_BAND = 0.64
"""Height of a row of numbers."""
_WORD = 0.6
"""Height of the word of a mark."""
_SHADE = 0.11
_FONT = 8.5
_WIDTH_INCH, _LETTER_INCH = 8.4, 0.078
"""Of the axes, and of a letter in a band: numbers stand only where they have room."""
_MOST_AWAY = 1000
"""Widths of the window from zero, beyond which time is counted from the window's begin."""

Steps = tuple[NDArray[np.int64], NDArray[np.int64]]
"""Times of changes, and the values from the start and from each change on: one value more than times."""
Rows = dict[str, Steps]
"""By the name at the left, from top to bottom."""
Groups = dict[str, Rows]
"""By a name that stands upright beside the rows."""
_NUMBERS = ("state", "count", "requested", "completed", "asked")
"""Rows that are no levels; rows of words are none, either."""


def waveform(
    encoder: EdgeStream,
    controller: EdgeStream,
    *,
    requested: Totals,
    completed: Totals,
    window_ps: tuple[int, int],
    title: str,
    marks: Sequence[tuple[int, str]] = (),
) -> Figure:
    """Draw what goes into a box and what comes out of it.

    Encoder above, controller below: A, B, the report's state 1 to 4 (docs/state-tables.md) and the count since the
    beginning of the streams; then the totals of steps. Insertions are shaded.

    Parameters
    ----------
    encoder, controller
        Both sides of the box from one moment on, the window or more of it.
    requested, completed
        Totals of steps since then.
    window_ps
        Begin and end of what is shown, ps.
    title
        Above the drawing.
    marks
        Moments to be pointed at, in ps, each with a word or two.

    Returns
    -------
    Figure
        Of the page's width; `rtec.report.figures_style.write_figure` makes a file of it.

    Raises
    ------
    ArgumentError
        A window that does not end after its begin.

    Examples
    --------
    Design C inserts one step of two counts at rest in state 1:

    >>> controller = EdgeStream([2_000_000, 3_000_000], [1, 3], initial=0)
    >>> figure = waveform(EdgeStream([], [], initial=0), controller, requested=Totals([1_000_000], [1]),
    ...                   completed=Totals([3_000_000], [1]), window_ps=(0, 5_000_000), title="Design C")
    >>> figure.axes[0].get_xlabel()
    'time (µs)'
    """
    start_ps, stop_ps = window_ps
    if start_ps >= stop_ps:
        raise ArgumentError("window_ps", f"{start_ps} to {stop_ps} ps", "an end after the begin")
    view = View(start_ps, stop_ps)
    below: Groups = {"steps": {"requested": steps_of(requested), "completed": steps_of(completed)}}
    groups = sides_of(encoder, controller) | below
    figure = new_figure(inches_of(groups))
    axes = figure.add_subplot()
    draw_sides(axes, view, groups, (encoder, controller, completed), marks=marks)
    axes.set_title(title, fontweight="bold", pad=8)
    return figure


def sides_of(encoder: EdgeStream, controller: EdgeStream) -> Groups:
    """Return the rows of both sides of a box."""
    return {"encoder": side_rows(encoder, ""), "controller": side_rows(controller, "′")}


def inches_of(groups: Groups) -> float:
    """Return the height of a drawing of groups."""
    return _ROW_INCH * height_of(groups) + _FRAME_INCH


def draw_marked(
    axes: Axes, view: View, groups: Groups, marks: Sequence[tuple[int, str]]
) -> dict[str, tuple[float, float]]:
    """Draw groups as `draw_groups` does, and point at moments."""
    bands = draw_groups(axes, view, groups)
    axes.set_ylim(-0.3, height_of(groups) + 0.05 + _WORD * len(marks))
    for index, (t_ps, word) in enumerate(marks):
        _mark(axes, view, t_ps, word, index)
    axes.set_xlabel(view.label)
    return bands


def draw_sides(
    axes: Axes,
    view: View,
    groups: Groups,
    box: tuple[EdgeStream, EdgeStream, Totals],
    *,
    marks: Sequence[tuple[int, str]] = (),
) -> None:
    """Draw groups, `sides_of` among them, and shade the insertions of ``box``: both sides, and completed totals."""
    low, high = draw_marked(axes, view, groups, marks)["controller"]
    encoder, controller, completed = box
    booked_ps = completed.times_ps[completed.times_ps <= view.start_ps].max(initial=0)
    for begin_ps, end_ps in insertions(encoder, controller, completed, from_ps=int(booked_ps)):
        shade(axes, view, begin_ps, end_ps, low - 0.2, high - 0.15)


def height_of(groups: Groups) -> float:
    """Return the height of all rows of groups, and of what is between the groups."""
    return sum(len(rows) for rows in groups.values()) + _GROUP_APART * (len(groups) - 1)


def draw_groups(
    axes: Axes, view: View, groups: Groups, *, colours: Mapping[str, str] = MappingProxyType({})
) -> dict[str, tuple[float, float]]:
    """Draw groups of rows below each other, lines as levels and all else as numbers, with the names at the left.

    Parameters
    ----------
    axes, view
        Where, and which stretch of time.
    groups
        From top to bottom.
    colours
        Of the levels of a group, by its name; ink where it has none.

    Returns
    -------
    dict
        Lower and upper end of each group.
    """
    top, bands = height_of(groups), {}
    for group, rows in groups.items():
        begin = top
        for name, steps in rows.items():
            top -= 1.0
            if name in _NUMBERS or steps[1].dtype.kind == "U":
                _draw_numbers(axes, view, steps, top)
            else:
                _draw_line(axes, view, steps, top, colours.get(group, INK))
            axes.annotate(name, (0.0, top + HIGH / 2), (-8, 0), xycoords=("axes fraction", "data"),
                          textcoords="offset points", ha="right", va="center")  # fmt: skip
        bands[group] = (top, begin)
        axes.annotate(group, (0.0, (begin + top - 0.4) / 2), (-72, 0), xycoords=("axes fraction", "data"),
                      textcoords="offset points", ha="center", va="center", rotation=90, fontsize=_FONT,
                      fontweight="bold")  # fmt: skip
        top -= _GROUP_APART
    axes.set_xlim(view.x(view.start_ps), view.x(view.stop_ps))
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.grid(visible=False, axis="y")
    return bands


class View:
    """The window, its unit of time, and where time counts from.

    Where ``zero_ps`` is given, time counts from there. The width of the window chooses the unit that is not given.
    """

    def __init__(self, start_ps: int, stop_ps: int, zero_ps: int | None = None, unit: str = "") -> None:
        self.start_ps, self.stop_ps = start_ps, stop_ps
        width_ps = stop_ps - start_ps
        unit = unit or next(unit for unit, size in PS_PER.items() if width_ps >= size)
        self._zero_ps, self._unit_ps = zero_ps or 0, PS_PER[unit]
        self.label = f"time ({symbol(unit)})"
        if zero_ps is None and stop_ps > _MOST_AWAY * width_ps:  # ticks would differ in their last digits only
            self._zero_ps = start_ps // self._unit_ps * self._unit_ps
            seconds = f"{self._zero_ps // PS_PER_S}.{self._zero_ps % PS_PER_S:012d}".rstrip("0")
            self.label = f"time from {seconds} s on ({symbol(unit)})"

    def x(self, t_ps: float) -> float:
        """Return the place of a time on the axis."""
        return (t_ps - self._zero_ps) / self._unit_ps

    def stretches(self, steps: Steps) -> list[tuple[int, int, int]]:
        """Return begin, end and value of each stretch in the window."""
        times_ps, values = steps
        first = int(np.searchsorted(times_ps, self.start_ps, side="right"))
        last = int(np.searchsorted(times_ps, self.stop_ps))
        inner = times_ps[first:last].tolist()
        bounds = [self.start_ps, *inner, self.stop_ps]
        return list(zip(bounds[:-1], bounds[1:], values[first : last + 1].tolist(), strict=True))

    def room_letters(self, begin_ps: int, end_ps: int) -> float:
        """Return how many letters a stretch has room for."""
        return (end_ps - begin_ps) / (self.stop_ps - self.start_ps) * _WIDTH_INCH / _LETTER_INCH


def side_rows(stream: EdgeStream, prime: str) -> Rows:
    """Return the rows of one side of the box: levels, state 1 to 4, and count."""
    levels = np.concatenate([[stream.initial], stream.levels]).astype(np.int64)
    states = states_of_levels(levels).astype(np.int64) + 1
    rows = {"A" + prime: levels & 1, "B" + prime: levels >> 1, "state": states, "count": counts_along(stream)}
    return {name: (stream.times_ps, values) for name, values in rows.items()}


def steps_of(totals: Totals) -> Steps:
    """Return a total as a row."""
    return totals.times_ps, np.concatenate([[0], totals.totals])


def _draw_line(axes: Axes, view: View, steps: Steps, base: float, colour: str) -> None:
    stretches = view.stretches(steps)
    x = [view.x(begin) for begin, _, _ in stretches] + [view.x(view.stop_ps)]
    y = [base + HIGH * level for _, _, level in stretches]
    axes.plot(x, [*y, y[-1]], drawstyle="steps-post", color=colour, linewidth=1.3, solid_joinstyle="miter")


def _draw_numbers(axes: Axes, view: View, steps: Steps, base: float) -> None:
    """Draw a band that is cut where the number changes, with the numbers that have room."""
    stretches = view.stretches(steps)
    left, right = view.x(view.start_ps), view.x(view.stop_ps)
    axes.fill_between([left, right], base, base + _BAND, color=STATE, linewidth=0)
    cuts = [view.x(begin) for begin, _, _ in stretches[1:]]
    axes.vlines(cuts, base, base + _BAND, color=STATE_EDGE, linewidth=0.8)
    for begin, end, value in stretches:
        text = str(value).replace("-", "−")
        if len(text) <= view.room_letters(begin, end):
            axes.text((view.x(begin) + view.x(end)) / 2, base + _BAND / 2, text, ha="center", va="center",
                      fontsize=_FONT)  # fmt: skip


def shade(axes: Axes, view: View, begin_ps: int, end_ps: int, low: float, high: float) -> None:
    """Colour an insertion, from its first change to its last."""
    if end_ps < view.start_ps or begin_ps > view.stop_ps:
        return
    pad = 0.004 * (view.x(view.stop_ps) - view.x(view.start_ps))
    span = (view.x(max(begin_ps, view.start_ps)) - pad, view.x(min(end_ps, view.stop_ps)) + pad)
    axes.fill_between(span, low, high, color=FORWARD, alpha=_SHADE, linewidth=0, zorder=3)


def _mark(axes: Axes, view: View, t_ps: int, word: str, index: int) -> None:
    """Point at a moment; each has a line of its own for its word."""
    if view.start_ps <= t_ps <= view.stop_ps:
        in_right_half = 2 * t_ps > view.start_ps + view.stop_ps
        axes.axvline(view.x(t_ps), color=ALARM, linewidth=1.0, linestyle=REVERSE_LINE, zorder=4)
        axes.annotate(word, (view.x(t_ps), axes.get_ylim()[1] - _WORD * index),
                      (-4 if in_right_half else 4, -1), textcoords="offset points", color=ALARM, va="top",
                      fontweight="bold", ha="right" if in_right_half else "left")  # fmt: skip
