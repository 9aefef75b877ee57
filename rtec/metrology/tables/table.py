"""A table as it stands in a file, before anything of it is understood."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rtec.errors import FileFormatError
from rtec.metrology.plain_numbers import LONGEST_SHOWN, shown
from rtec.metrology.tables.cells import Cell
from rtec.metrology.tables.choices import as_option

MAX_COLUMNS = 1000
MOST_CELLS = 8_000_000
"""That are looked at one by one: they take a gigabyte. Plain numbers are read in one sweep and need a fifth of it."""
_NAMES = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "bars"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table as it stands in a file, before anything of it is understood."""

    source: str
    """The file, for messages."""
    facts: dict[str, str]
    """``# key: value`` lines and ``key: value`` titles, keys in lower case."""
    headings: tuple[str, ...]
    units: tuple[str, ...]
    above: tuple[str, ...]
    """``headings``, ``units``, ``above``: of each column: its heading (nothing where the whole column is empty),
    what stands below it in a row of units, and what spans it from the line above."""
    heading_line: int
    """Line of the headings, counted from 1."""
    titles: tuple[str, ...] = ()
    """The lines above it, or above its part of them."""
    text: list[str] = field(default_factory=list)
    separator: str | None = ","
    first_line: int = 0
    """``text``, ``separator``, ``first_line``: lines of the rows where the file is a text, what is between their
    columns (None for spaces), and the line of the first of them."""
    rows: list[list[Cell]] | None = None
    lines: Sequence[int] = ()
    """``rows``, ``lines``: cells of a workbook, and the row of the sheet in which each stood."""
    numbers: NDArray[np.float64] | None = None
    """Of columns in memory that are numbers throughout, shape (rows, columns), instead of ``rows``."""
    notes: tuple[str, ...] = ()
    """What was found out, in words."""

    def refused(self, problem: str, allowed: str) -> FileFormatError:
        """Return the error of a table that cannot be read; it names the line of the headings."""
        return FileFormatError(self.source, self.heading_line or None, problem, allowed)

    def called(self, column: int) -> str:
        """Return what a column is called in a message: its heading, cut where it is long."""
        heading = self.headings[column]
        return heading if len(heading) <= LONGEST_SHOWN else shown(heading)

    def as_choice(self, column: int, meaning: str) -> str:
        """Return the option that says what a column is; by its number where its heading does not do it."""
        heading = self.headings[column]
        alone = [other.lower() for other in self.headings].count(heading.lower()) == 1
        return as_option(heading if alone else "", meaning, f"column {column + 1}")

    def cells(self) -> tuple[list[list[Cell]], Sequence[int]]:
        """Return the rows with the line of each; empty lines are passed over.

        Raises
        ------
        FileFormatError
            A row of another length than the headings, quotes that do not close, or too many cells.
        """
        if self.rows is not None:
            return self.rows, self.lines
        if self.numbers is not None:
            return [list(row) for row in self.numbers.tolist()], self.lines
        width = len(self.headings)
        if width * len(self.text) > MOST_CELLS:
            problem = f"{width * len(self.text)} cells, not all of which are plain numbers"
            allowed = f"at most {MOST_CELLS}; or plain numbers alone: seconds for dates, no empty cells"
            raise FileFormatError(self.source, None, problem, allowed)
        rows: list[list[Cell]] = []
        lines: list[int] = []
        for line, text in enumerate(self.text, self.first_line):
            if not text or text.isspace():
                continue
            found = split_line(self.source, line, text, self.separator)
            while len(found) > width and not found[-1]:
                found.pop()
            if self.separator != "," and not any(found):
                continue
            if len(found) != width:
                allowed = f"{width}, one for each heading; the file may be cut off"
                raise FileFormatError(self.source, line, f"{len(found)} fields", allowed)
            rows.append(list(found))
            lines.append(line)
        return rows, lines


def split_line(source: str, line: int, text: str, separator: str | None) -> list[str]:
    """Return the fields of a line without the spaces around them.

    Raises
    ------
    FileFormatError
        Quotes that do not close, or a field that is too long.

    Examples
    --------
    >>> split_line("x.csv", 1, '1, "a, b",', ","), split_line("x.csv", 1, "1.5  2.5", None)
    (['1', 'a, b', ''], ['1.5', '2.5'])
    """
    if separator is None:
        return text.split()
    try:
        found = next(csv.reader([text], delimiter=separator, strict=True, skipinitialspace=True))
    except csv.Error as error:
        allowed = f"fields separated by {_NAMES.get(separator, shown(separator))}"
        raise FileFormatError(source, line, f"no row of a CSV file ({error})", allowed) from None
    return [field.strip() for field in found]
