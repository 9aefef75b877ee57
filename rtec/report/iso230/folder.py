"""The folder of a positioning test, which gets all of its files or none."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rtec.io import json_text, whole_folder, write_text
from rtec.report.figures_style import figure_style, new_figure
from rtec.report.illustrations import Illustration, illustration
from rtec.report.iso230.figures import draw_tests
from rtec.report.iso230.pdf import sheet_pdf
from rtec.report.iso230.sheet import Sheet
from rtec.report.page_folder import PAGE, without_empty, write_figures
from rtec.report.rendering import embedded, page_environment

_PANEL_INCH, _AROUND_INCH = 3.5, 0.7
PDF = "report.pdf"


def write_positioning(sheet: Sheet, folder: Path) -> Path:
    """Write the page, the PDF, the plot and the numbers of positioning tests.

    Everything is put in place at the end: an error, a full disk or Ctrl-C leaves the folder as it was.

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

    Raises
    ------
    OutputError
        The folder is missing or not writable, or the disk is full.
    """
    figure = _plot(sheet)
    pdf = sheet_pdf(sheet)
    with whole_folder(folder, last=PAGE) as new:
        write_figures(new, [figure])
        (new / PDF).write_bytes(pdf)
        write_text(new / "result.json", json_text(sheet.document, indent=2) + "\n")
        write_text(new / PAGE, _page(sheet, figure, without_empty(new, ())))
    return folder / PAGE


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
