"""Where the table stands in a file: what separates its columns, the headings, the units below them, the rows.

A file that keeps to our format has its headings in the first line that is no ``# key: value``, with commas between
them; nothing is guessed of it. Of any other file the rows are found first, as lines that look alike and hold numbers.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rtec.errors import FileFormatError
from rtec.metrology.tables.cells import Cell, is_missing, looks_like_number
from rtec.metrology.tables.headings import Strength, meaning_of, unit_below
from rtec.metrology.tables.table import MAX_COLUMNS, Table, split_line
from rtec.metrology.tables.words import plain_words
from rtec.metrology.text_file import PLAIN_NUMBER, shown

_FACT = re.compile(r"#\s*(?P<key>[^:]{1,80}?)\s*:\s*(?P<value>.*)")
_TITLE_FACT = re.compile(r"(?P<key>[^:=]{1,60}?)\s*[:=]\s*(?P<value>.+)")
_SEPARATORS = ("\t", ";", ",", "|", None)
_SAMPLE = 300
_SUMMARY = frozenset(
    "mean average mittel mittelwert std stdev sigma min max range sum total end eof summe anzahl".split()
)
_A_HEADER = "a header line such as target_mm,actual_mm"
_KEY_AND_VALUE = 2
_FACTS_OF_AXES = ("counts_per_rev", "screw_pitch", "scale_signal_period", "reference_temperature")


@dataclass(frozen=True, slots=True)
class _Grid:
    """The lines of a file with their fields, whatever the file is."""

    source: str
    size: int
    fields: Callable[[int], Sequence[Cell]]
    is_blank: Callable[[int], bool]

    def next_filled(self, start: int) -> int:
        """Return the index of the first line from ``start`` on that is not blank, or the number of lines."""
        return next((index for index in range(start, self.size) if not self.is_blank(index)), self.size)


def table_of_text(source: str | Path, text: str) -> Table:
    r"""Find the table in a text.

    Parameters
    ----------
    source
        The file, for messages.
    text
        With ``\n`` between its lines.

    Raises
    ------
    FileFormatError
        No headings, or no rows below them.

    Examples
    --------
    >>> table = table_of_text("x.csv", "Machine: VMC 500\n\nSoll;Abweichung\nmm;µm\n0,0;1,5\n10,0;2,5\n")
    >>> table.headings, table.units, table.separator, table.facts, table.heading_line
    (('Soll', 'Abweichung'), ('mm', 'µm'), ';', {'machine': 'VMC 500'}, 3)
    """
    lines = text.split("\n")
    facts, head = _facts(source, lines)
    if _is_ours(lines[head]):
        grid = _text_grid(str(source), lines, ",")
        return _table(grid, lines, facts, head, head, ",", ours=True)
    separators: Sequence[str | None] = _SEPARATORS
    if (stated := re.fullmatch(r"sep=(.)", lines[head].strip(), re.IGNORECASE)) is not None and head + 1 < len(lines):
        separators, head = (stated[1],), head + 1
    best = None
    for separator in separators:
        grid = _text_grid(str(source), lines, separator)
        count, start = _rows_from(grid, head)
        if count and (best is None or count > best[0]):
            best = count, start, separator, grid
    if best is None:  # no line looks like a row: what is wrong shows when the first is read as headings
        separator = next((mark for mark in _SEPARATORS if mark is not None and mark in lines[head]), ",")
        return _table(_text_grid(str(source), lines, separator), lines, facts, head, head, separator, ours=False)
    _, start, separator, grid = best
    return _table(grid, lines, facts, head, _header_above(grid, head, start), separator, ours=False)


def table_of_grid(source: str, rows: list[list[Cell | None]]) -> Table:
    """Find the table in the rows of a sheet.

    Parameters
    ----------
    source
        The file and the sheet, for messages.
    rows
        Numbers, texts, and None for an empty cell; they may be of different lengths.

    Raises
    ------
    FileFormatError
        No headings above the rows, or a column with readings and without a heading.

    Examples
    --------
    >>> table = table_of_grid("x.xlsx", [["Z axis"], [], ["Soll [mm]", "Error [um]"], [0.0, 1.5], [10.0, None]])
    >>> table.headings, table.rows, table.lines
    (('Soll [mm]', 'Error [um]'), [[0.0, 1.5], [10.0, '']], [4, 5])
    """
    width = max((len(row) for row in rows), default=0)
    left = min((_first_filled(row) for row in rows if row), default=0)
    padded = [
        [("" if cell is None else cell) for cell in [*row, *[None] * (width - len(row))][left:]] for row in rows
    ]
    grid = _Grid(
        source, len(padded), lambda index: padded[index], lambda index: not any(c != "" for c in padded[index])
    )
    head = grid.next_filled(0)
    count, start = _rows_from(grid, head)
    if not count:
        raise FileFormatError(source, None, "no rows of numbers", "headings, and rows of numbers below them")
    return _table(grid, None, {}, head, _header_above(grid, head, start), None, ours=False)


def _first_filled(row: Sequence[Cell | None]) -> int:
    return next((index for index, cell in enumerate(row) if cell is not None), len(row))


def _text_grid(source: str, lines: list[str], separator: str | None) -> _Grid:
    def fields(index: int) -> list[str]:
        try:
            return split_line(source, index + 1, lines[index], separator)
        except FileFormatError:
            return [lines[index]]  # said where the row is read

    return _Grid(source, len(lines), fields, lambda index: not lines[index].strip())


def _facts(source: str | Path, lines: list[str]) -> tuple[dict[str, str], int]:
    """Return the ``# key: value`` lines and the index of the first line that is none."""
    facts: dict[str, str] = {}
    for index, line in enumerate(lines):
        text = line.strip()
        if text.startswith("#") and not text.startswith(("#\t", "#;", "#,")):
            if (match := _FACT.match(text)) is not None:
                _add_fact(facts, match["key"], match["value"])
        elif text:
            return facts, index
    raise FileFormatError(source, None, "no header line after the '#' lines", _A_HEADER)


def _add_fact(facts: dict[str, str], key: str, value: str) -> None:
    key = key.strip().lower()
    key = key.replace(" ", "_") if key.replace(" ", "_") in _FACTS_OF_AXES else key
    facts[key] = f"{facts[key]}\n{value}" if key in facts else value


def _is_ours(line: str) -> bool:
    """Return whether a line is a header of our own format: one of its headings is one of ours, and none a number."""
    try:
        headings = split_line("", 0, line, ",")
    except FileFormatError:
        return False
    if any(PLAIN_NUMBER.fullmatch(heading) for heading in headings):
        return False
    meanings = (meaning_of(heading) for heading in headings)
    return any(meaning is not None and meaning.strength is Strength.EXACT for meaning in meanings)


def _rows_from(grid: _Grid, head: int) -> tuple[int, int]:
    """Return how many of the first lines look like rows of one table, and the index of the first of them."""
    sample: dict[int, Sequence[Cell]] = {}
    for index in range(head, grid.size):
        if not grid.is_blank(index):
            sample[index] = grid.fields(index)
        if len(sample) == _SAMPLE:
            break
    likely = [index for index, fields in sample.items() if _is_row(fields)]
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


def _is_row(fields: Sequence[Cell]) -> bool:
    """Return whether fields look like a row: half of those that are filled in hold a number, and at least one."""
    filled = [field for field in fields if not is_missing(field)]
    numbers = sum(looks_like_number(field) for field in filled)
    return len(fields) > 1 and numbers > 0 and 2 * numbers >= len(filled)


def _header_above(grid: _Grid, head: int, start: int) -> int:
    """Return the index of the headings above the first row, passing over a row of units."""
    first = grid.fields(start)[0]
    meaning = meaning_of(first) if isinstance(first, str) else None
    if meaning is not None and meaning.quantity in ("target", "position"):
        return start  # 'Target [mm]' before numbers: the targets stand side by side
    above = [index for index in range(head, start) if not grid.is_blank(index)]
    if above and _is_unit_row(grid.fields(above[-1])):
        above.pop()
    if not above:
        line = ", ".join(str(field) for field in grid.fields(start))
        raise FileFormatError(grid.source, start + 1, f"no header line: {shown(line)} holds numbers", _A_HEADER)
    return above[-1]


def _is_unit_row(fields: Sequence[Cell]) -> bool:
    filled = [field for field in fields if isinstance(field, float) or field.strip(" -[]()")]
    return bool(filled) and all(isinstance(field, str) and unit_below(field) is not None for field in filled)


def _table(
    grid: _Grid,
    text: list[str] | None,
    facts: dict[str, str],
    head: int,
    header: int,
    separator: str | None,
    *,
    ours: bool,
) -> Table:
    """Return the table whose headings stand at an index; in our own format nothing else is looked for."""
    headings = _headings(grid, text, header, separator)
    width = len(headings)
    first = header + 1
    units, above = [""] * width, [""] * width
    notes: tuple[str, ...] = ()
    last = grid.size
    if not ours:
        below = grid.next_filled(first)
        if below < grid.size and _is_unit_row(grid.fields(below)):
            units = [str(field) for field in [*grid.fields(below), *units][:width]]
            first = below + 1
        titles = [index for index in range(head, header) if not grid.is_blank(index)]
        if titles and (spanning := _spanning(grid.fields(titles[-1]), width)) is not None:
            above = spanning
            titles.pop()
        for index in titles:
            _title(facts, grid.fields(index))
        last, notes = _end(grid, first, width)
    filled = [] if text is not None else [index for index in range(first, last) if not grid.is_blank(index)]
    return Table(
        source=grid.source,
        facts=facts,
        headings=tuple(headings),
        units=tuple(units),
        above=tuple(above),
        heading_line=header + 1,
        text=[] if text is None else text[first:last],
        separator=separator,
        first_line=first + 1,
        rows=None if text is not None else [list(grid.fields(index)[:width]) for index in filled],
        lines=[index + 1 for index in filled],
        notes=notes,
    )


def _headings(grid: _Grid, text: list[str] | None, header: int, separator: str | None) -> list[str]:
    """Return the headings, without empty ones over empty columns at the end."""
    if text is None:
        headings = [str(field) if isinstance(field, str) else f"{field:.15g}" for field in grid.fields(header)]
    elif separator is None:
        width = len(grid.fields(grid.next_filled(header + 1))) if grid.next_filled(header + 1) < grid.size else 0
        apart = [text[header].split(), re.split(r"\s{2,}|\t", text[header].strip())]
        headings = next((words for words in apart if len(words) == width), apart[0])
    else:
        headings = split_line(grid.source, header + 1, text[header], separator)
    if len(headings) > MAX_COLUMNS:
        raise FileFormatError(grid.source, header + 1, f"{len(headings)} columns", f"at most {MAX_COLUMNS}")
    if headings and PLAIN_NUMBER.fullmatch(headings[0]):
        problem = f"no header line: {shown(', '.join(headings))} holds numbers"
        raise FileFormatError(grid.source, header + 1, problem, _A_HEADER)
    for column, heading in enumerate(headings):
        if not heading and not _is_empty_column(grid, header + 1, column):
            problem = f"column {column + 1} has no heading"
            raise FileFormatError(grid.source, header + 1, problem, "a heading in every column")
    while headings and not headings[-1]:
        headings.pop()
    return headings


def _is_empty_column(grid: _Grid, first: int, column: int) -> bool:
    rows = (grid.fields(index) for index in range(first, grid.size) if not grid.is_blank(index))
    return not any(len(row) > column and row[column] != "" for row in rows)


def _spanning(fields: Sequence[Cell], width: int) -> list[str] | None:
    """Return headings that span several columns, filled in to the right; None for a line that is a mere title."""
    filled = [index for index, field in enumerate(fields) if field != ""]
    if filled == [0] and (meaning := meaning_of(str(fields[0]))) is not None and meaning.unit is not None:
        return [str(fields[0])] * width  # such as 'Deviation [µm]' over all the runs
    if not filled or filled[-1] == 0 or (len(filled) == _KEY_AND_VALUE and filled == [0, 1]):
        return None
    found, current = [], ""
    for column in range(width):
        current = str(fields[column] if column < len(fields) else "") or current
        found.append(current)
    return found


def _title(facts: dict[str, str], fields: Sequence[Cell]) -> None:
    """Keep a title line ``key: value``, or a key and a value in two cells, as a fact."""
    filled = [str(field) for field in fields if field != ""]
    if len(filled) == _KEY_AND_VALUE and ":" not in filled[0][:-1]:
        _add_fact(facts, filled[0].rstrip(":= "), filled[1])
    elif (match := _TITLE_FACT.fullmatch(" ".join(filled))) is not None:
        _add_fact(facts, match["key"], match["value"])


def _end(grid: _Grid, first: int, width: int) -> tuple[int, tuple[str, ...]]:
    """Return the index behind the last row: text behind an empty line, and sums below the rows, are no readings."""
    last = grid.size
    while last > first and grid.is_blank(last - 1):
        last -= 1
    end = last
    for index in range(last - 1, first - 1, -1):
        if grid.is_blank(index) or _is_summary(grid.fields(index)):
            end = index
        elif len(fields := grid.fields(index)) == width and _is_row(fields):
            break
    else:
        return last, ()
    left = grid.next_filled(end)
    if left >= last:
        return last, ()
    text = " ".join(str(field) for field in grid.fields(left) if field != "")
    return end, (f"what stands below the table, from line {left + 1} on, is left out: {shown(text)}",)


def _is_summary(fields: Sequence[Cell]) -> bool:
    words = plain_words(str(fields[0])) if fields else []
    return bool(words) and words[0] in _SUMMARY
