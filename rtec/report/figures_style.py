"""The common style of all figures, and how a figure becomes files.

Figures are made through matplotlib's objects, never through ``pyplot``: no global figure, no window. Settings of the
user's own do not reach them, and the same results give the same bytes.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from rtec.io import write_bytes
from rtec.report.palette import EDGE, GRID, GUIDE, GUIDE_LINE, INK, PAPER, TICK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

WIDTH_INCH = 10.0
"""Width of every figure: that of the page."""
DPI = 150
MOST_POINTS = 1500
"""Points of a line; a longer one is drawn as the range of each stretch."""
_MOST_SHAPES = 1000
"""Dots of a cloud up to which an SVG draws each as a shape; more are pixels, a tenth of the bytes."""
_NEARLY_EQUAL = 4.0
_DECADES = 250.0
"""Range up to which a logarithmic axis has room for three labels a decade."""

_FAMILIES = (
    "axes", "errorbar", "figure", "font", "grid", "hatch", "image", "legend", "lines", "markers", "mathtext",
    "patch", "path", "savefig", "scatter", "svg", "text", "xaxis", "xtick", "yaxis", "ytick",
)  # fmt: skip
_STYLE: dict[str, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": EDGE,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.labelsize": 9.5,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10.0,
    "figure.facecolor": PAPER,
    "font.size": 9.0,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "legend.fontsize": 9.0,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "svg.fonttype": "path",
    "svg.hashsalt": "rtec",
    "text.color": INK,
    "xtick.color": TICK,
    "xtick.labelcolor": INK,
    "ytick.color": TICK,
    "ytick.labelcolor": INK,
}


@contextmanager
def figure_style() -> Iterator[None]:
    """Let figures be drawn in the report's style, whatever the user's own settings are."""
    import matplotlib as mpl  # noqa: PLC0415 - half a second, needed only where something is drawn

    with mpl.rc_context():
        defaults: dict[Any, Any] = dict(mpl.rcParamsDefault)
        own = {key: value for key, value in defaults.items() if key.split(".")[0] in _FAMILIES}
        mpl.rcParams.update(own | _STYLE)
        yield


def new_figure(height_inch: float) -> Figure:
    """Return an empty figure of the page's width."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - as above

    return Figure(figsize=(WIDTH_INCH, height_inch), layout="constrained")


def rendered(figure: Figure) -> tuple[bytes, bytes]:
    """Return the figure as SVG and as PNG of 150 dots an inch; the same figure gives the same bytes."""
    _lay_out(figure)
    return _file_of(figure, ".svg"), _file_of(figure, ".png")


def write_figure(draw: Callable[[], Figure], file: Path) -> None:
    """Draw in the report's style into a file; the same figure gives the same bytes.

    Parameters
    ----------
    draw
        Makes the figure.
    file
        Its name ends in .png, .svg or .pdf; one that exists is overwritten once the new one is complete.

    Raises
    ------
    OutputError
        It cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "empty.pdf"
    >>> def draw():
    ...     figure = new_figure(1.0)
    ...     figure.add_subplot().set_xlabel("time (s)")
    ...     return figure
    >>> write_figure(draw, file)
    >>> file.read_bytes()[:5]
    b'%PDF-'
    """
    with figure_style():
        figure = draw()
        _lay_out(figure)
        made = _file_of(figure, file.suffix.lower())
    write_bytes(file, made)


def _lay_out(figure: Figure) -> None:
    """Lay the figure out once for all formats: with an engine left, each of them would be drawn twice."""
    layout = figure.get_layout_engine()
    if layout is not None:
        layout.execute(figure)
        figure.set_layout_engine(None)
    # the layout's last digits vary, and ids in an SVG are digests of all digits
    for axes in figure.axes:
        left, bottom, width, height = (round(float(edge), 6) for edge in axes.get_position().bounds)
        axes.set_position((left, bottom, width, height))


def _draw_clouds_as_pixels(figure: Figure) -> None:
    """Let an SVG hold a cloud of very many dots as a picture of it."""
    for axes in figure.axes:
        for line in axes.lines:
            if line.get_linestyle() == "None" and np.size(line.get_xdata()) > _MOST_SHAPES:
                line.set_rasterized(True)


def _file_of(figure: Figure, suffix: str) -> bytes:
    """Return the figure as a file, without a date."""
    _draw_clouds_as_pixels(figure)
    metadata: dict[str, dict[str, str | None]] = {
        ".svg": {"Date": None, "Creator": "rtec"},
        ".png": {"Software": None, "Description": _titles(figure)},
        ".pdf": {"CreationDate": None, "Producer": None, "Creator": "rtec"},
    }
    made = io.BytesIO()
    # a PNG at the usual level is 4 % smaller and takes three times as long
    options: dict[str, Any] = {"pil_kwargs": {"compress_level": 2}} if suffix == ".png" else {}
    figure.savefig(made, format=suffix[1:], metadata=metadata[suffix], dpi=DPI, **options)
    return made.getvalue()


def _titles(figure: Figure) -> str | None:
    """Return the titles of the panels, with the figures in them, a line for each panel; None without any."""
    panels = ([axes.get_title(loc=side) for side in ("left", "center", "right")] for axes in figure.axes)
    return "\n".join("  ".join(filter(None, panel)) for panel in panels).strip() or None


def legend_above(figure: Figure | SubFigure, axes: Axes, columns: int) -> None:
    """Put the legend of ``axes`` above everything, where it covers no data."""
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside upper left", ncols=columns)


def guide(axes: Axes, *, x: float | None = None, y: float | None = None, text: str = "", colour: str = GUIDE) -> None:
    """Draw a thin line across the axes, with a word at its upper or right end."""
    from matplotlib.transforms import blended_transform_factory as blended  # noqa: PLC0415 - as above

    if x is not None:
        axes.axvline(x, color=colour, linewidth=1.0, linestyle=GUIDE_LINE, zorder=1)
        place = blended(axes.transData, axes.transAxes)
        axes.annotate(text, (x, 1.0), (-3, -2), xycoords=place, textcoords="offset points", color=colour,
                      rotation=90, ha="right", va="top", fontsize=8.5)  # fmt: skip
    if y is not None:
        axes.axhline(y, color=colour, linewidth=1.0, linestyle=GUIDE_LINE, zorder=1)
        place = blended(axes.transAxes, axes.transData)
        axes.annotate(text, (1.0, y), (-2, 3), xycoords=place, textcoords="offset points", color=colour,
                      ha="right", va="bottom", fontsize=8.5)  # fmt: skip


def outline(
    x: NDArray[np.float64], y: NDArray[np.float64], most: int = MOST_POINTS
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a line with at most twice ``most`` points that keeps every peak: least and largest of each stretch.

    Of x, ascending, and y, shape (points,) each.

    Examples
    --------
    >>> outline(np.arange(6.0), np.array([0.0, 9.0, 0.0, 0.0, -9.0, 0.0]), 2)[1].tolist()
    [0.0, 9.0, -9.0, 0.0]
    """
    if x.size <= 2 * most:
        return x, y
    starts = np.unique(np.linspace(0, x.size, most, endpoint=False).astype(np.int64))
    low, high = np.minimum.reduceat(y, starts), np.maximum.reduceat(y, starts)
    return np.repeat(x[starts], 2), np.stack([low, high], axis=1).reshape(-1)


def magnitudes(axes: Axes, which: Literal["x", "y"], values: Iterable[float]) -> None:
    """Let an axis show numbers above zero that differ by factors: a logarithmic one, labelled 1, 2, 5, 10, ...

    Where they hardly differ, or some are zero, it stays linear.

    Examples
    --------
    >>> axes = new_figure(1.0).add_subplot()
    >>> magnitudes(axes, "x", [1.0, 300.0])
    >>> magnitudes(axes, "y", [1.0, 1.2])
    >>> axes.get_xscale(), axes.get_yscale()
    ('log', 'linear')
    """
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter  # noqa: PLC0415 - as above

    low, high = min(values := [*values], default=0.0), max(values, default=0.0)
    if not 0.0 < _NEARLY_EQUAL * low < high < math.inf:
        return
    axes.set(**{f"{which}scale": "log"})
    axis = axes.xaxis if which == "x" else axes.yaxis
    steps = (1.0, 2.0, 5.0) if high < _DECADES * low else (1.0,)
    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_major_formatter(FormatStrFormatter("%g"))
    axis.set_minor_formatter(NullFormatter())
