"""The sheet as a PDF of A4 pages: plot and figures, what they are worth, and each target."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rtec.report.figures_style import figure_style
from rtec.report.iso230.figures import draw_tests, drawable
from rtec.report.iso230.sheet import Sheet, SheetOfTest
from rtec.report.palette import GUIDE, INK

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_A4_INCH = (8.27, 11.69)
_LEFT, _RIGHT, _TOP, _BOTTOM = 0.08, 0.94, 0.955, 0.05
_LINE, _HEAD = 0.0126, 0.022
"""Heights of a line and of a heading, as shares of the page."""
_LETTERS = 118
"""Of a line of running text."""
_PANELS = 3
"""Panels on a page."""
_PLOT = {1: 0.36, 2: 0.42, 3: 0.62}
"""Share of the page that the plot takes, by the number of panels."""
_WORDS, _WIDEST = 0.34, 0.13
"""Where the numbers of a table of figures begin, and how wide its columns are at most, as shares of the page."""


def sheet_pdf(sheet: Sheet) -> bytes:
    """Return the PDF; the same tests give the same bytes."""
    from matplotlib.backends.backend_pdf import PdfPages  # noqa: PLC0415 - half a second, needed only for a report

    made = io.BytesIO()
    metadata = {"Title": sheet.title, "Creator": "rtec", "Producer": None, "CreationDate": None}
    with figure_style(), PdfPages(made, metadata=metadata) as file:
        for page in sheet_pages(sheet):
            file.savefig(page)
    return made.getvalue()


def sheet_pages(sheet: Sheet) -> list[Figure]:
    """Draw the pages; to be called in the style of figures."""
    pages = _Pages()
    for first in range(0, len(sheet.tests), _PANELS):
        pages.new()
        if first == 0:
            pages.title(sheet.title, sheet.finding)
        pages.plot(sheet.tests[first : first + _PANELS], sheet)
    table = sheet.table
    pages.heading(f"Figures, in {sheet.units.symbol}", room=28)
    rows = []
    for group in table.groups:
        rows.append((group.title, *[""] * (len(table.headings) + 1)))
        rows += [(f"    {row.words}", row.symbol, *row.cells) for row in group.rows]
    pages.table(("", "", *table.headings), rows, words=_WORDS)
    pages.heading("Measurement uncertainty")
    for names, sentences in sheet.statements:
        pages.paragraph((f"{names}: " if len(sheet.statements) > 1 else "") + " ".join(sentences))
    warnings = [f"{test.name}: {text}" for test in sheet.tests for text in test.warnings]
    if warnings:
        pages.heading("Mind")
        for text in warnings:
            pages.paragraph(text)
    for test in sheet.tests:
        units = f"in {sheet.units.position_symbol}; deviations in {sheet.units.symbol}"
        pages.heading(f"{test.name}: each target, {units}", room=12)
        pages.paragraph("; ".join(f"{label}: {text}" for label, text in test.facts))
        pages.table(sheet.target_headings, test.targets, words=_LEFT)
    pages.heading("What the figures mean")
    for term, meaning in sheet.definitions:
        pages.paragraph(f"{term}: {meaning}")
    return pages.made


class _Pages:
    """Pages that fill from the top; what does not fit goes on to the next."""

    def __init__(self) -> None:
        self.made: list[Figure] = []
        self.y = 0.0

    def new(self) -> None:
        """Begin a page."""
        from matplotlib.figure import Figure  # noqa: PLC0415 - as above

        self.made.append(Figure(figsize=_A4_INCH, layout="constrained"))
        number = len(self.made)
        self.made[-1].text(_RIGHT, _BOTTOM / 2.0, f"{number}", ha="right", fontsize=8, color=INK)
        self.y = _TOP

    def _need(self, lines: float) -> Figure:
        if not self.made or self.y - lines * _LINE < _BOTTOM:
            self.new()
        return self.made[-1]

    def _write(self, x: float, text: str, **how: Any) -> None:
        # a single $ is itself: names of files are no formulae
        self.made[-1].text(x, self.y, drawable(text), va="top", parse_math=False, **{"fontsize": 8, **how})

    def title(self, title: str, finding: str) -> None:
        """Write what the sheet is."""
        self._write(_LEFT, textwrap.shorten(title, 80, placeholder=" …"), fontsize=12, fontweight="bold")
        self.y -= _HEAD
        self.paragraph(finding)

    def plot(self, tests: Sequence[SheetOfTest], sheet: Sheet) -> None:
        """Draw panels below what stands on the page."""
        share = _PLOT[len(tests)]
        above = 1.0 - self.y + _LINE
        edges = (_LEFT - 0.03, _RIGHT - _LEFT + 0.05)
        parts: Any = self.made[-1].subfigures(
            3, 3, height_ratios=[above, share, 1.0 - above - share], width_ratios=[*edges, 1.0 - sum(edges)]
        )
        draw_tests(parts[1, 1], tests, sheet.units, sheet.table.decimals)
        self.y -= share + 2.0 * _LINE

    def heading(self, text: str, room: int = 3) -> None:
        """Write a heading with room for some lines below it."""
        self._need(room + 2)
        self.y -= _LINE
        self._write(_LEFT, textwrap.shorten(text, 90, placeholder=" …"), fontsize=10, fontweight="bold")
        self.y -= _HEAD

    def paragraph(self, text: str) -> None:
        """Write running text."""
        lines = textwrap.wrap(text, _LETTERS, subsequent_indent="   ")
        for line in lines:
            self._need(1)
            self._write(_LEFT, line)
            self.y -= _LINE

    def table(self, headings: Sequence[str], rows: Sequence[Sequence[str]], *, words: float) -> None:
        """Write a table: words at the left, numbers at the right of columns that share what is right of ``words``."""
        texts = sum(not heading for heading in headings[:2])  # of the columns that hold words
        columns = len(headings) - texts
        places = [_LEFT, words - 0.06][:texts]
        width = min((_RIGHT - words) / columns, _WIDEST)
        ends = [words + (column + 1) * width for column in range(columns)]
        for index, row in enumerate(rows):
            page = self.made[-1]
            if index == 0 or self._need(1) is not page:
                self._head(headings[texts:], ends)
            for x, cell in zip(places, row, strict=False):
                self._write(x, cell, fontstyle="normal" if cell.startswith(" ") or x != _LEFT else "italic")
            for x, cell in zip(ends, row[texts:], strict=True):
                self._write(x, cell, ha="right")
            self.y -= _LINE

    def _head(self, headings: Sequence[str], ends: Sequence[float]) -> None:
        from matplotlib.lines import Line2D  # noqa: PLC0415 - as above

        letters = int((ends[1] - ends[0] if len(ends) > 1 else 0.3) * 125)
        for x, heading in zip(ends, headings, strict=True):
            short = heading if len(heading) <= letters else f"…{heading[1 - letters :]}"
            self._write(x, short, ha="right", fontweight="bold", fontsize=7)
        self.y -= _LINE
        page = self.made[-1]
        y = self.y + 0.2 * _LINE
        page.add_artist(Line2D([_LEFT, _RIGHT], [y, y], color=GUIDE, linewidth=0.6, transform=page.transFigure))
        self.y -= 0.2 * _LINE
