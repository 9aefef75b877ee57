"""A circle test as a page, figures and tables: the polar plot that users know, and what makes up the deviation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table

from rtec.metrology.ballbar import Found, FoundError
from rtec.report.drawn import Plate, drawn
from rtec.report.figures_style import legend_above, new_figure
from rtec.report.page_folder import write_page_folder
from rtec.report.palette import FORWARD, GUIDE, INK, PALE, PAPER, REVERSE, SERIES

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rtec.metrology.ballbar.circle_test import Floats, Integers

_SENSES = ((1.0, "counter-clockwise", FORWARD), (-1.0, "clockwise", REVERSE))
_DIVISIONS = 4
"""From the nominal circle outwards, and as many inwards."""
_STEPS = (1.0, 2.0, 5.0)
_REACH = 1.5
"""Of the lines of the quadrants, in radii of the nominal circle."""
_UNITS = {"um": "µm", "um/m": "µm/m", "ms": "ms"}
_MORE = {
    "period_mm": "period {:.4g} mm",
    "proportional_to_velocity_um": "with the velocity {:.3g} µm",
    "frequency_hz": "{:.4g} Hz",
    "waves_a_revolution": "{:.4g} waves a turn",
    "radial_um": "{:+.3g} µm of radius",
    "scale_difference_ppm": "{:+.3g} ppm",
    "width_deg": "{:.2g}° wide",
}
_ENDS = "at_positive_end_um", "at_negative_end_um"


def ballbar_sentence(found: Found) -> str:
    """Return what came out, in sentences."""
    figures = found.figures
    said = f"Circular deviation G(b) {figures.both:.3g} µm, G {figures.largest_g:.3g} µm in one sense."
    if not found.errors:
        return f"{said} No error of the machine stands out of the noise of {found.noise_um:.2g} µm."
    first = ", ".join(f"{e.name} ({value_text(e)}, {e.share:.0%})" for e in found.errors[:3])
    more = f" and {len(found.errors) - 3} more" if len(found.errors) > 3 else ""
    return f"{said} It shows {first}{more}; {float(np.sqrt(np.mean(found.residual_um**2))):.2g} µm RMS are left."


def value_text(error: FoundError) -> str:
    """Return the value of an error with its unit."""
    return f"{error.value:.3g} {_UNITS[error.unit]}"


def figure_rows(found: Found) -> list[tuple[str, str]]:
    """Return the figures of ISO 230-4 as names and texts."""
    figures, test = found.figures, found.test
    feed = "not known" if test.feed_mm_s is None else f"{60.0 * test.feed_mm_s:.4g} mm/min"
    return [
        ("circular deviation G, counter-clockwise", f"{figures.counter_clockwise:.3g} µm"),
        ("circular deviation G, clockwise", f"{figures.clockwise:.3g} µm"),
        ("bi-directional circular deviation G(b)", f"{figures.both:.3g} µm"),
        ("mean bi-directional radial deviation D", f"{figures.mean_radial:+.3g} µm"),
        ("radial deviation F", f"{figures.least_radial:+.3g} to {figures.largest_radial:+.3g} µm"),
        ("diameter of X less nominal, beside the reversals", f"{figures.diameters[0]:+.3g} µm"),
        ("diameter of Y less nominal, beside the reversals", f"{figures.diameters[1]:+.3g} µm"),
        ("squareness by the diagonals", f"{_near_zero(figures.diagonals):+.3g} µm/m"),
        (
            "centre offset, taken out",
            f"x {_near_zero(figures.centre[0]):+.4g} µm, y {_near_zero(figures.centre[1]):+.4g} µm",
        ),
        ("noise of a point", f"{found.noise_um:.2g} µm"),
        ("nominal radius", f"{test.radius_mm:.6g} mm"),
        ("feed", feed),
    ]


def _near_zero(value: float) -> float:
    """Return a value without what is smaller than anybody reads, and without minus zero."""
    return round(value, 4) + 0.0


def error_rows(found: Found) -> list[tuple[str, ...]]:
    """Return the errors as texts, the largest first."""
    return [
        (
            e.name,
            value_text(e),
            f"± {e.uncertainty:.2g} {_UNITS[e.unit]}",
            f"{e.alone_um:.3g}",
            f"{e.share:.0%}",
            _more(e),
        )
        for e in found.errors
    ]


def _more(error: FoundError) -> str:
    """Return the details of an error as a text."""
    found = [_MORE[name].format(value) for name, value in error.details.items() if name not in _ENDS]
    if set(_ENDS) <= set(error.details):
        plus, minus = (error.details[name] for name in _ENDS)
        found.insert(0, f"ends {plus:+.3g}, {minus:+.3g} µm")
    return "; ".join(found)


def figures_table(found: Found, name: str) -> Table:
    """Return the figures of ISO 230-4."""
    table = Table(title=f"Circle test: {name}", show_header=False, title_justify="left")
    table.add_column()
    table.add_column(justify="right")
    for row in figure_rows(found):
        table.add_row(*row)
    return table


def errors_table(found: Found) -> Table:
    """Return the errors with value, size alone and share."""
    table = Table(title="What the circle shows", title_justify="left")
    for heading, side in (("error", "left"), ("value", "right"), ("uncertainty", "right"), ("alone (µm)", "right"),
                          ("share", "right"), ("more", "left")):  # fmt: skip
        table.add_column(heading, justify="left" if side == "left" else "right")
    for row in error_rows(found):
        table.add_row(*row)
    return table


def write_ballbar(found: Found, name: str, folder: Path) -> Path:
    """Write page, figures and numbers of a circle test, all or nothing; errors as of `write_page_folder`."""
    plates = [
        Plate("circle", "The circle, its deviation magnified",
              "Both senses about the centre of the fit; the nominal circle is bold, a division is stated above.",
              lambda: circle_figure(found)),
        Plate("contributions", "What makes up the deviation",
              "The circular deviation that each error would show alone.", lambda: contributions_figure(found)),
        Plate("unrolled", "Over the angle",
              "Radial deviation of both senses with the fit, and below what the fit leaves.",
              lambda: unrolled_figure(found)),
    ]  # fmt: skip
    values = {
        "title": f"Circle test: {Path(name).name}",
        "sentence": ballbar_sentence(found),
        "tone": "good",
        "rows": figure_rows(found),
        "errors": error_rows(found),
        "notes": found.notes,
    }
    return write_page_folder(folder, drawn(plates), {"data": name, **found.document()}, "ballbar.html.j2", values)


def _passes(found: Found) -> Iterator[tuple[Integers, str, str]]:
    """Yield rows, label and colour of each pass; only the first of a sense has a label."""
    test = found.test
    for sense, label, colour in _SENSES:
        for count, number in enumerate(np.unique(test.number[test.sense == sense])):
            yield np.flatnonzero(test.number == number), "_nolegend_" if count else label, colour


def _about_centre(found: Found) -> Floats:
    """Return the radial deviation about the centre of the fit, shape (points,)."""
    angle, (x, y) = found.test.angle_rad, found.figures.centre
    return np.asarray(found.test.deviation_um - x * np.cos(angle) - y * np.sin(angle))


def division_of(largest_um: float) -> float:
    """Return the division of a polar plot on which a deviation has room: 1, 2 or 5 times a power of ten.

    Examples
    --------
    >>> division_of(7.3), division_of(0.02)
    (2.0, 0.005)
    """
    wanted = max(largest_um, 1e-3) / _DIVISIONS
    power = 10.0 ** np.floor(np.log10(wanted))
    return next(float(step * power) for step in (*_STEPS, 10.0) if step * power >= wanted * 0.999)


def circle_figure(found: Found) -> Figure:
    """Return the polar plot: both senses magnified about the nominal circle, with lines of the quadrants."""
    about = _about_centre(found)
    division = division_of(float(np.abs(about).max()))
    figure = new_figure(8.6)
    axes = figure.add_subplot()
    _draw_scale(axes, division)
    for rows, label, colour in _passes(found):
        radius = 1.0 + about[rows] / division / (2 * _DIVISIONS)
        angle = found.test.angle_rad[rows]
        axes.plot(radius * np.cos(angle), radius * np.sin(angle), color=colour, linewidth=0.9, label=label)
    figures = found.figures
    axes.set_title(
        f"{division:g} µm/division    G(b) {figures.both:.3g} µm    G {figures.counter_clockwise:.3g} µm "
        f"counter-clockwise, {figures.clockwise:.3g} µm clockwise"
    )
    axes.set_aspect("equal")
    axes.set(xlim=(-1.72, 1.72), ylim=(-1.62, 1.62))
    axes.axis("off")
    legend_above(figure, axes, 2)
    return figure


def _draw_scale(axes: Axes, division: float) -> None:
    """Draw circles at whole divisions, the axes and the diagonals, with their names and values."""
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    between = np.cos(np.pi / 8.0), np.sin(np.pi / 8.0)
    small: dict[str, Any] = {"color": PALE, "fontsize": 7.5, "ha": "center", "va": "center", "zorder": 5}
    small["bbox"] = {"boxstyle": "square,pad=0.1", "facecolor": PAPER, "edgecolor": "none"}
    for step in range(-_DIVISIONS, _DIVISIONS + 1):
        radius = 1.0 + step / (2 * _DIVISIONS)
        colour, width = (GUIDE, 0.5) if step else (INK, 1.2)
        axes.plot(radius * np.cos(turn), radius * np.sin(turn), color=colour, linewidth=width)
        if step:
            axes.annotate(
                f"{step * division:+g}".replace("-", "−"), (radius * between[0], radius * between[1]), **small
            )
    axes.annotate("µm", (1.58 * between[0], 1.58 * between[1]), **small)
    for degrees in range(0, 180, 45):
        x, y = _REACH * np.cos(np.radians(degrees)), _REACH * np.sin(np.radians(degrees))
        width, dash = (0.9, "-") if degrees % 90 == 0 else (0.5, "--")
        axes.plot([-x, x], [-y, y], color=GUIDE, linewidth=width, linestyle=dash)
    for degrees, text in ((0, "+X  0°"), (90, "+Y  90°"), (180, "−X\n180°"), (270, "−Y  270°")):
        x, y = 1.62 * np.cos(np.radians(degrees)), 1.57 * np.sin(np.radians(degrees))
        axes.annotate(text, (x, y), ha="center", va="center", fontsize=9.0, color=INK)


def contributions_figure(found: Found) -> Figure | None:
    """Return a bar for each error; nothing where there is none."""
    if not found.errors:
        return None
    figure = new_figure(1.2 + 0.34 * len(found.errors))
    axes = figure.add_subplot()
    errors = found.errors[::-1]
    places = np.arange(len(errors))
    axes.barh(places, [e.alone_um for e in errors], color=FORWARD, height=0.6)
    for place, error in zip(places, errors, strict=True):
        axes.annotate(f"{value_text(error)}, {error.share:.0%}", (error.alone_um, place), (4, 0),
                      textcoords="offset points", va="center", fontsize=8.5)  # fmt: skip
    axes.set_yticks(places, [e.name for e in errors])
    axes.set(xlabel="circular deviation alone (µm)", xlim=(0.0, 1.3 * max(e.alone_um for e in errors)))
    axes.grid(visible=False, axis="y")
    return figure


def unrolled_figure(found: Found) -> Figure:
    """Return the deviation over the angle with the fit, and the residual."""
    test, about = found.test, _about_centre(found)
    fitted = np.asarray(test.deviation_um - found.residual_um) - (test.deviation_um - about)
    figure = new_figure(6.4)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    darker = dict(zip((FORWARD, REVERSE), SERIES[2:4], strict=True))
    for every, label, colour in _passes(found):
        rows = every[np.argsort(test.angle_rad[every])]
        degrees = np.degrees(test.angle_rad[rows])
        above.plot(degrees, about[rows], color=colour, linewidth=0.8, label=label)
        fit = label if label.startswith("_") else f"fit, {label}"
        above.plot(degrees, fitted[rows], color=darker[colour], linewidth=1.0, label=fit)
        below.plot(degrees, found.residual_um[rows], color=colour, linewidth=0.6)
    above.set_ylabel("radial deviation (µm)")
    below.set(xlabel="angle from +X towards +Y (deg)", ylabel="left (µm)", xlim=(0.0, 360.0))
    below.set_xticks(range(0, 361, 45))
    legend_above(figure, above, 4)
    return figure
