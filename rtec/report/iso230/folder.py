"""The folder of a positioning test, which gets all of its files or none."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rtec.io import write_bytes
from rtec.report.drawn import Plate, drawn
from rtec.report.figures_style import new_figure
from rtec.report.iso230.figures import draw_tests
from rtec.report.iso230.pdf import sheet_pdf
from rtec.report.iso230.sheet import Sheet
from rtec.report.page_folder import write_page_folder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PANEL_INCH, _AROUND_INCH = 3.5, 0.7
PDF = "report.pdf"


def write_positioning(sheet: Sheet, folder: Path) -> Path:
    """Write the page, the PDF, the plot and the numbers of positioning tests; errors as of `write_page_folder`.

    Parameters
    ----------
    sheet
        One test, or several of one kind of axis, as before and after.
    folder
        Where to; it exists.

    Returns
    -------
    Path
        The page, ``report.html``; beside it are ``report.pdf``, ``result.json`` and ``figures``.
    """

    def plot() -> Figure:
        figure = new_figure(_AROUND_INCH + _PANEL_INCH * len(sheet.tests))
        draw_tests(figure, sheet.tests, sheet.units, sheet.table.decimals)
        return figure

    pdf = sheet_pdf(sheet)
    return write_page_folder(
        folder,
        drawn([Plate("positioning", "Deviation at each target", sheet.caption, plot)]),
        sheet.document,
        "iso230/page.html.j2",
        {"title": sheet.title, "definitions": sheet.definitions, "sheet": sheet},
        beside=lambda new: write_bytes(new / PDF, pdf),
    )
