"""The lines of a file with their fields, and what they look like: rows of numbers, units, sums, rules."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from rtec.errors import FileFormatError
from rtec.metrology.tables.cells import Cell, is_missing, looks_like_number, number_of
from rtec.metrology.tables.headings import unit_below
from rtec.metrology.tables.table import split_line
from rtec.metrology.tables.words import plain_words

_SAMPLE = 300
_SUMMARY = frozenset(
    "mean average mittel mittelwert std stdev sigma min max range sum total end eof summe anzahl".split()
)
_RULES = frozenset("-=_*")
_RULE = re.compile(r"[-=_*+|:\s]*[-=_*]{3}[-=_*+|:\s]*")


@dataclass(frozen=True, slots=True)
class Grid:
    """The lines of a file with their fields, whatever the file is."""

    source: str
    size: int
    fields: Callable[[int], Sequence[Cell]]
    is_blank: Callable[[int], bool]

    def next_filled(self, start: int) -> int:
        """Return the index of the first line from ``start`` on that is not blank, or the number of lines."""
        return next((index for index in range(start, self.size) if not self.is_blank(index)), self.size)


def text_grid(source: str, lines: list[str], separator: str | None) -> Grid:
    """Return the lines of a text; a rule between them, such as ``----+----``, is as good as blank."""

    def fields(index: int) -> list[str]:
        try:
            return split_line(source, index + 1, lines[index], separator)
        except FileFormatError:
            return [lines[index]]  # said where the row is read

    return Grid(source, len(lines), fields, lambda index: _is_blank(lines[index]))


def _is_blank(line: str) -> bool:
    return not line or line.isspace() or (line[:5].lstrip("| :+")[:1] in _RULES and _RULE.fullmatch(line) is not None)


def rows_from(grid: Grid, head: int) -> tuple[int, int]:
    """Return how many of the first lines look like rows of one table, and the index of the first of them."""
    sample: dict[int, Sequence[Cell]] = {}
    for index in range(head, grid.size):
        if not grid.is_blank(index):
            sample[index] = grid.fields(index)
        if len(sample) == _SAMPLE:
            break
    likely = [index for index, fields in sample.items() if is_row(fields)]
    if not likely:
        return 0, head
    width, count = Counter(len(sample[index]) for index in likely).most_common(1)[0]
    likely = [index for index in likely if len(sample[index]) == width]
    # the columns that hold numbers further down hold them in the first row, too: '1', '2', '3' may be headings
    half = len(likely) / 2
    numeric = [
        column for column in range(width) if sum(looks_like_number(sample[index][column]) for index in likely) > half
    ]
    start = next(
        (
            index
            for index in likely
            if all(
                looks_like_number(sample[index][column]) or is_missing(sample[index][column]) for column in numeric
            )
        ),
        likely[0],
    )
    return count, start


def _counts_runs(fields: Sequence[Cell]) -> bool:
    """Return whether fields are the numbers of runs, 1, 2, 3, 1, 2, 3, beside an empty cell: headings, no row."""
    numbers = [number_of(field, ".") for field in fields[1:] if field != ""]
    steps = [(before, after) for before, after in pairwise(numbers) if before is not None and after is not None]
    counted = len(numbers) > 1 and len(steps) == len(numbers) - 1 and numbers[0] == 1.0
    return fields[0] == "" and counted and all(after in (1.0, before + 1.0) for before, after in steps)


def is_row(fields: Sequence[Cell]) -> bool:
    """Return whether fields look like a row: half of those that are filled in hold a number, and at least one."""
    filled = [field for field in fields if not is_missing(field)]
    numbers = sum(looks_like_number(field) for field in filled)
    return len(fields) > 1 and numbers > 0 and 2 * numbers >= len(filled) and not _counts_runs(fields)


def is_unit_row(fields: Sequence[Cell]) -> bool:
    """Return whether every field that is filled in is a unit."""
    filled = [field for field in fields if isinstance(field, float) or field.strip(" -[]()")]
    return bool(filled) and all(isinstance(field, str) and unit_below(field) is not None for field in filled)


def is_summary(fields: Sequence[Cell]) -> bool:
    """Return whether a line begins with the name of something computed from the rows."""
    words = plain_words(str(fields[0])) if fields else []
    return bool(words) and words[0] in _SUMMARY
