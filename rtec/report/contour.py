"""A toolpath on feed drives as a page, figures, a table and a log that `rtec diagnose` reads."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.table import Table

from rtec.axis.plants import log_columns
from rtec.io import write_lines
from rtec.report.drawn import Plate, drawn
from rtec.report.figures_style import legend_above, new_figure
from rtec.report.page_folder import write_page_folder
from rtec.report.palette import ALARM, FORWARD, GREEN, GREY, GUIDE, MEASURED, PURPLE, REVERSE, SERIES
from rtec.toolpath.contour_run import ContourRun
from rtec.toolpath.predicted import time_at
from rtec.toolpath.pulses import FOLLOWING_LIMIT_MM

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.figure import Figure

LOG = "log.csv"
_MAGNIFIED = 0.06
"""Of the size of the path, that the largest error is drawn as."""
_MOST_DRAWN = 20_000
_COLOURS = {"velocity": FORWARD, "acceleration": GREEN, "jerk": PURPLE, "feed": REVERSE}


def contour_sentence(run: ContourRun) -> str:
    """Return what came out, in sentences."""
    d = run.document()
    parts = [
        f"The carriages stay within {d['max_contour_um']:.3g} µm of the path ({d['rms_contour_um']:.3g} µm RMS) in "
        f"{d['time_s']:.3f} s; they follow the command within {d['max_following_um']:.4g} µm."
    ]
    parts.append(f"The jerk limit costs {run.plan.price:.1%} of the time.")
    if run.limit_mm is not None:
        held = "keeps" if run.worst_mm <= run.limit_mm else "does not keep"
        parts.append(f"The run {held} the limit of {1e3 * run.limit_mm:.3g} µm; without it the path takes "
                     f"{run.unlimited_s:.3f} s.")  # fmt: skip
        if run.steady is not None:
            feed, lasts = run.steady
            parts.append(f"A constant feed that keeps it is {feed:.3g} mm/s and takes {lasts:.3f} s.")
    if run.stopped_s is not None:
        parts.append(
            f"After {run.stopped_s:.3f} s the controller stops: an axis is more than {FOLLOWING_LIMIT_MM:g} mm away."
        )
    if not run.plan.audit.passed:
        parts.append("A limit of an axis is exceeded.")
    return " ".join(parts)


def contour_table(run: ContourRun) -> Table:
    """Return the figures of a run."""
    table = Table(title=f"{run.path.name} on {run.drive}", show_header=False, title_justify="left")
    table.add_column()
    table.add_column(justify="right")
    for row in contour_rows(run):
        table.add_row(*row)
    return table


def contour_rows(run: ContourRun) -> list[tuple[str, str]]:
    """Return the figures of a run as names and texts."""
    d = run.document()
    rows = [
        ("length", f"{run.path.length_mm:.1f} mm"),
        ("time", f"{d['time_s']:.3f} s"),
        ("time without the jerk limit", f"{d['time_without_jerk_limit_s']:.3f} s"),
        ("contour error, largest", f"{d['max_contour_um']:.4g} µm"),
        ("contour error, RMS", f"{d['rms_contour_um']:.4g} µm"),
        ("following error, largest", f"{d['max_following_um']:.4g} µm"),
        ("second-order formula, off by", f"{d['formula_error_um']:.2g} µm"),
        ("formula as it is misprinted, off by", f"{d['misprint_error_um']:.3g} µm"),
    ]
    if run.prediction is not None:
        off_um, share = run.prediction
        rows.append(("contour error predicted, off by (RMS)", f"{off_um:.3g} µm, {share:.1%} of the following error"))
    if run.integration_error_nm is not None:
        rows.append(("integration error of the drives", f"{run.integration_error_nm:.2g} nm"))
    rows += [(f"{name}, largest share of the limit", f"{share:.6f}") for name, share in run.shares.items()]
    for letter, loop in run.loops.items():
        counts = f"{loop.encoder_counts}, {loop.controller_counts}"
        rows.append((f"counts of {letter}, encoder and controller", counts))
        if run.pulses is not None and run.pulses.injector is not None:
            what = f"{loop.insertions.inserted}; {abs(loop.pending_steps)} wait"
            rows.append((f"insertions of {letter} ({loop.step_counts} counts each)", what))
            rows.append((f"counts of {letter} are accounted for", "yes" if loop.audit else "no"))
    return rows


def write_contour(run: ContourRun, folder: Path) -> Path:
    """Write page, figures, numbers and log of a run, all or nothing; errors as of `write_page_folder`."""
    plates = [
        Plate("path", "The path, and the error magnified",
              "The path (grey) and the carriages (blue), their distance from it magnified as the legend says.",
              lambda: path_figure(run)),
        Plate("errors", "Errors over time and along the path",
              "Above, how far the carriages are from the command; below, from the path, over time and along it.",
              lambda: errors_figure(run)),
        Plate("feed", "Feed, and what limits it",
              "The feed along the path; the colour says which limit binds there.", lambda: feed_figure(run)),
        Plate("spectra", "Spectra of the errors",
              "Amplitude spectra of following and contour error.", lambda: spectra_figure(run)),
        Plate("formula", "What the formulas are off by",
              "The second-order formula and the one that the papers print, less the exact projection.",
              lambda: formula_figure(run)),
    ]  # fmt: skip
    values = {
        "title": f"{run.path.name} on {run.drive.replace('-', ' ')} drives",
        "sentence": contour_sentence(run),
        "tone": "good" if run.limits_held else "bad",
        "rows": contour_rows(run),
    }
    return write_page_folder(
        folder,
        drawn(plates),
        run.document(),
        "contour.html.j2",
        values,
        beside=lambda new: write_lines(new / LOG, _log(run)),
    )


def _log(run: ContourRun) -> Iterator[str]:
    columns = log_columns(dict(run.axes))
    yield ",".join(columns)
    for row in zip(*(values.tolist() for values in columns.values()), strict=True):
        yield ",".join(f"{value:.9g}" for value in row)


def _thin(size: int) -> slice:
    return slice(None, None, max(1, size // _MOST_DRAWN))


def path_figure(run: ContourRun) -> Figure:
    """Return the path and the carriages in its first two dimensions, the distance between them magnified."""
    part = _thin(run.s_mm.size)
    s = run.s_mm[part]
    place = run.path.points(s)
    load = np.column_stack([axis.load_mm for axis in run.axes.values()])[part]
    along = run.path.derivatives(s)[0]
    off = load - place
    off = off - np.sum(off * along, axis=1, keepdims=True) * along
    size = float(np.ptp(place, axis=0).max())
    factor = _MAGNIFIED * size / max(float(np.linalg.norm(off, axis=1).max()), 1e-12)
    factor = float(f"{factor:.1g}")
    figure = new_figure(6.4)
    axes = figure.add_subplot()
    axes.plot(place[:, 0], place[:, 1], color=MEASURED, linewidth=1.0, label="path")
    shown = place + factor * off
    axes.plot(shown[:, 0], shown[:, 1], color=FORWARD, linewidth=1.0, label=f"carriages, error × {factor:g}")
    axes.set_aspect("equal")
    axes.set(xlabel="x (mm)", ylabel="y (mm)")
    legend_above(figure, axes, 2)
    return figure


def errors_figure(run: ContourRun) -> Figure:
    """Return following and contour error over time, and the contour error along the path."""
    part = _thin(run.s_mm.size)
    figure = new_figure(8.0)
    above, below, along = figure.subplots(3, 1)
    for letter, colour in zip(run.axes, SERIES, strict=False):
        axis = run.axes[letter]
        following = 1e3 * (axis.command_mm - axis.load_mm)
        above.plot(axis.time_s[part], following[part], color=colour, linewidth=0.9, label=letter)
    above.set_ylabel("following error (µm)")
    above.legend(loc="upper right")
    above.set_xlabel("time (s)")
    for axes, over, label in ((below, run.time_s, "time (s)"), (along, run.s_mm, "along the path (mm)")):
        axes.plot(over[part], 1e3 * run.contour_mm[part], color=FORWARD, linewidth=0.9, label="as it runs")
        if run.predicted_mm is not None:
            axes.plot(over[part], 1e3 * run.predicted_mm[part], color=REVERSE, linewidth=0.7, label="predicted")
        for sign in (-1.0, 1.0) if run.limit_mm is not None else ():
            axes.axhline(sign * 1e3 * float(run.limit_mm or 0.0), color=ALARM, linewidth=0.9, linestyle="--")
        axes.axhline(0.0, color=GUIDE, linewidth=0.8)
        axes.set(xlabel=label, ylabel="contour error (µm)")
    if run.predicted_mm is not None:
        below.legend(loc="upper right")
    return figure


def feed_figure(run: ContourRun) -> Figure:
    """Return the feed over the path in the colour of the limit that binds."""
    s = np.linspace(0.0, run.path.length_mm, 4000)
    feed = run.plan.at(time_at(run.plan, s))[1]
    binds, _ = run.plan.limit_at(s)
    figure = new_figure(4.4)
    axes = figure.add_subplot()
    axes.plot(s, feed, color=GREY, linewidth=0.8)
    for word, colour in _COLOURS.items():
        rows = np.array([str(one).startswith(word) for one in binds])
        if rows.any():
            axes.plot(s[rows], feed[rows], ".", color=colour, markersize=2.5, label=f"{word} binds")
    axes.set(xlabel="along the path (mm)", ylabel="feed (mm/s)", ylim=(0.0, None))
    legend_above(figure, axes, 4)
    return figure


def spectra_figure(run: ContourRun) -> Figure:
    """Return amplitude spectra of following and contour error."""
    figure = new_figure(4.4)
    axes = figure.add_subplot()
    step = float(np.median(np.diff(run.time_s)))
    window = np.hanning(run.time_s.size)
    for name, values, colour in (
        ("following error", run.following_mm, REVERSE), ("contour error", run.contour_mm, FORWARD),
    ):  # fmt: skip
        size = np.abs(np.fft.rfft(window * (values - values.mean()))) * 2.0 / window.sum()
        hertz = np.fft.rfftfreq(values.size, step)
        axes.loglog(hertz[1:], 1e3 * size[1:] + 1e-9, color=colour, linewidth=0.8, label=name)
    axes.set(xlabel="frequency (Hz)", ylabel="amplitude (µm)", ylim=(1e-4, None))
    legend_above(figure, axes, 2)
    return figure


def formula_figure(run: ContourRun) -> Figure:
    """Return what the formulas are off by, over time."""
    part = _thin(run.s_mm.size)
    figure = new_figure(4.2)
    axes = figure.add_subplot()
    for name, values, colour in (
        ("as printed in the papers", run.misprint_mm, REVERSE), ("second order", run.formula_mm, FORWARD),
    ):  # fmt: skip
        off = 1e3 * np.abs(values - run.contour_mm)
        axes.semilogy(run.time_s[part], off[part] + 1e-7, color=colour, linewidth=0.8, label=name)
    axes.set(xlabel="time (s)", ylabel="off by (µm)")
    legend_above(figure, axes, 2)
    return figure
