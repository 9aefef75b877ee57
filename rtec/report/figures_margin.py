"""What an algorithm does over the frequency as a bar: inserts, only passes, fails."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rtec.errors import ArgumentError
from rtec.readable import hertz_text
from rtec.report.figures_style import guide, legend_above, new_figure
from rtec.report.palette import ALARM, BLUE, GUIDE_LINE, INK, PAPER
from rtec.verify.contract.frequencies import Does, Frequencies
from rtec.verify.contract.results import Verdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ALPHAS = {Does.INSERTS: 0.9, Does.PASSES: 0.28, Does.FAILS: 1.0}


def draw_bands(axes: Axes, y: float, found: Frequencies, colour: str, *, height: float = 0.62) -> None:
    """Draw a bar of a row: full where it inserts, pale where it only passes, hatched where it fails.

    Parameters
    ----------
    axes
        With a logarithmic axis of frequency.
    y, height
        Middle and height of the bar.
    found
        What is drawn.
    colour
        Of what is right.
    """
    bands = found.bands
    for k, band in enumerate(bands):
        # up to the next frequency tried, at most 3 % on
        width_hz = (bands[k + 1].from_hz if k + 1 < len(bands) else band.to_hz) - band.from_hz
        _bar(axes, y, band.from_hz, width_hz, band.does, colour, height)


def _bar(
    axes: Axes, y: float, left: float, width: float, does: Does, colour: str, height: float, label: str | None = None
) -> None:
    bars = axes.barh(
        y, width, height=height, left=left, color=colour, alpha=_ALPHAS[does], linewidth=0.0, label=label
    )
    if does is Does.FAILS:
        bars[0].set(facecolor=PAPER, edgecolor=ALARM, hatch="////")


def name_bands(axes: Axes) -> None:
    """Put the three words into the axes' legend."""
    for does in Does:
        words = "only passes" if does is Does.PASSES else does.value
        _bar(axes, 0.0, 0.0, 0.0, does, INK, 0.1, words)


def margin_figure(verdict: Verdict) -> Figure:
    """Return a figure of how far an algorithm goes; it has speeds.

    Raises
    ------
    ArgumentError
        It has no speeds.
    """
    speeds = verdict.speeds
    if speeds is None:
        raise ArgumentError("speeds", None, "a verdict with speeds", "an algorithm that inserts nothing has none")
    figure = new_figure(2.1)
    axes = figure.add_subplot()
    axes.set_xscale("log")
    found = speeds.frequencies
    name_bands(axes)
    draw_bands(axes, 0.0, found, BLUE)
    axes.plot(
        [hertz for hertz, _ in found.rows], [0.42] * len(found.rows), "|", color=INK, markersize=5.0, label="tried"
    )
    axes.set_xlim(found.rows[0][0] / 1.15, found.rows[-1][0] * 1.15)
    axes.set_ylim(-0.45, 0.6)
    axes.set_yticks([])
    axes.grid(visible=False, axis="y")
    guide(axes, x=speeds.top_hz, colour=INK)
    axes.plot(
        [], [], color=INK, linewidth=1.0, linestyle=GUIDE_LINE, label=f"{hertz_text(speeds.top_hz)}, of the contract"
    )
    axes.set_title("\n".join([verdict.algorithm, *(f"{name}: {value}" for name, value in speeds.data_sheet())]))
    axes.set_xlabel("encoder frequency, square waves a second of each line")
    axes.xaxis.set_major_formatter(lambda hertz, _: hertz_text(hertz))
    legend_above(figure, axes, 5)
    return figure
