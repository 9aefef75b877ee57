"""The folder of a positioning test, which gets all of its files or none."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rtec.io import write_bytes
from rtec.report.figures_style import figure_style, new_figure
from rtec.report.illustrations import Illustration, illustration
from rtec.report.iso230.figures import draw_tests
from rtec.report.iso230.pdf import sheet_pdf
from rtec.report.iso230.sheet import Sheet
from rtec.report.page_folder import write_page_folder
from rtec.report.rendering import embedded, page_environment

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
    figure = _plot(sheet)
    pdf = sheet_pdf(sheet)
    return write_page_folder(
        folder,
        [figure],
        sheet.document,
        lambda files: _page(sheet, figure, files),
        beside=lambda new: write_bytes(new / PDF, pdf),
    )


def _plot(sheet: Sheet) -> Illustration:
    with figure_style():
        figure = new_figure(_AROUND_INCH + _PANEL_INCH * len(sheet.tests))
        draw_tests(figure, sheet.tests, sheet.units, sheet.table.decimals)
        return illustration(figure, "positioning", "Deviation at each target", sheet.caption)


def _page(sheet: Sheet, figure: Illustration, files: Sequence[str]) -> str:
    return (
        page_environment()
        .get_template("iso230/page.html.j2")
        .render(
            sheet=sheet,
            figure=figure,
            picture=embedded(figure),
            statements=sheet.statements,
            warned=any(test.warnings for test in sheet.tests),
            files=files,
        )
    )
