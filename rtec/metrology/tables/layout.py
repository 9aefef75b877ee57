"""Where the table stands in a file: what separates its columns, the headings, the units below them, the rows.

A file that keeps to our format has its headings in the first line that is no ``# key: value``, with commas between
them; nothing is guessed of it. Of any other file the rows are found first, as lines that look alike and hold numbers.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rtec.errors import FileFormatError
from rtec.metrology.plain_numbers import PLAIN_NUMBER, shown
from rtec.metrology.tables.blocks import WORD, Block, blocks_of, is_name, without_remarks
from rtec.metrology.tables.cells import Cell
from rtec.metrology.tables.grid import Grid, is_row, is_summary, is_unit_row, rows_from, text_grid
from rtec.metrology.tables.headings import Strength, meaning_of
from rtec.metrology.tables.table import MAX_COLUMNS, Table, split_line

_FACT = re.compile(r"#\s*(?P<key>[^:]{1,80}?)\s*:\s*(?P<value>.*)")
_TITLE_FACT = re.compile(r"(?P<key>[^:=]{1,60}?)\s*[:=]\s*(?P<value>.+)")
_SEPARATORS = ("\t", ";", ",", "|", None)
_A_HEADER = "a header line such as target_mm,actual_mm"
_KEY_AND_VALUE = 2
_FACTS_OF_AXES = ("counts_per_rev", "screw_pitch", "scale_signal_period", "reference_temperature")


def tables_of_text(source: str | Path, text: str) -> list[Table]:
    r"""Find the tables in a text, one after the other.

    Raises
    ------
    FileFormatError
        No headings, or no rows below them.

    Examples
    --------
    >>> [table] = tables_of_text("x.csv", "Machine: VMC 500\n\nSoll;Abweichung\nmm;µm\n0,0;1,5\n10,0;2,5\n")
    >>> table.headings, table.units, table.separator, table.facts, table.heading_line
    (('Soll', 'Abweichung'), ('mm', 'µm'), ';', {'machine': 'VMC 500'}, 3)
    """
    lines = text.split("\n")
    facts, head = _facts(source, lines)
    if _is_ours(lines[head]):
        grid = text_grid(str(source), lines, ",")
        if text.count(lines[head].strip()) == 1:
            return [_table(grid, lines, facts, Block(head, head, head + 1, grid.size), ",", ours=True)]
        return _tables(grid, lines, facts, head, head, ",")
    separators: Sequence[str | None] = _SEPARATORS
    if (stated := re.fullmatch(r"sep=(.)", lines[head].strip(), re.IGNORECASE)) is not None and head + 1 < len(lines):
        separators, head = (stated[1],), head + 1
    best = None
    for separator in separators:
        grid = text_grid(str(source), lines, separator)
        count, start = rows_from(grid, head)
        if count and (best is None or count > best[0]):
            best = count, start, separator, grid
    if best is None:  # no line looks like a row: what is wrong shows when the first is read as headings
        separator = next((mark for mark in _SEPARATORS if mark is not None and mark in lines[head]), ",")
        return _tables(text_grid(str(source), lines, separator), lines, facts, head, head, separator)
    _, start, separator, grid = best
    if start == head and (commented := _commented(lines, separator, head, len(grid.fields(start)))) is not None:
        lines[commented] = lines[commented].strip().lstrip("#").strip()
        return _tables(grid, lines, facts, commented, commented, separator)
    return _tables(grid, lines, facts, head, _header_above(grid, head, start), separator)


def tables_of_grid(source: str, rows: list[list[Cell | None]]) -> list[Table]:
    """Find the tables in the rows of a sheet, one after the other; None stands for an empty cell.

    Raises
    ------
    FileFormatError
        No headings above the rows, or a column with readings and without a heading.

    Examples
    --------
    >>> sheet = [["Z axis"], [], ["Soll [mm]", "Error [um]"], [0.0, 1.5], [10.0, None]]
    >>> [table] = tables_of_grid("x.xlsx", sheet)
    >>> table.headings, table.rows, table.lines
    (('Soll [mm]', 'Error [um]'), [[0.0, 1.5], [10.0, '']], [4, 5])
    """
    width = max((len(row) for row in rows), default=0)
    left = min((_first_filled(row) for row in rows if row), default=0)
    padded = [
        [("" if cell is None else cell) for cell in [*row, *[None] * (width - len(row))][left:]] for row in rows
    ]
    grid = Grid(
        source, len(padded), lambda index: padded[index], lambda index: not any(c != "" for c in padded[index])
    )
    head = grid.next_filled(0)
    count, start = rows_from(grid, head)
    if not count:
        raise FileFormatError(source, None, "no rows of numbers", "headings, and rows of numbers below them")
    return _tables(grid, None, {}, head, _header_above(grid, head, start), None)


def _commented(lines: list[str], separator: str | None, head: int, width: int) -> int | None:
    """Return the index of headings behind a '#', as numpy writes them, above rows that have none."""
    above = [index for index in range(head) if lines[index].strip()]
    if not above:
        return None
    text = lines[above[-1]].strip().lstrip("#").strip()
    fields = text.split(separator)
    said = sum(meaning_of(field) is not None for field in fields)
    return above[-1] if len(fields) == width and 2 * said >= width else None


def _first_filled(row: Sequence[Cell | None]) -> int:
    return next((index for index, cell in enumerate(row) if cell is not None), len(row))


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
    exact = {meaning.quantity for meaning in meanings if meaning is not None and meaning.strength is Strength.EXACT}
    return bool(exact - {"run", "direction"})


def _header_above(grid: Grid, head: int, start: int) -> int:
    """Return the index of the headings above the first row, passing over a row of units."""
    first = grid.fields(start)[0]
    meaning = meaning_of(first) if isinstance(first, str) and len(first) > 1 else None
    if meaning is not None and meaning.quantity in ("target", "position"):
        return start  # 'Target [mm]' before numbers: the targets stand side by side
    above = [index for index in range(head, start) if not grid.is_blank(index)]
    if above and is_unit_row(grid.fields(above[-1])):
        above.pop()
    if any(not is_name(grid.fields(index)) for index in above):
        while is_name(grid.fields(above[-1])):
            above.pop()  # 'Run 1' between the headings and its rows
    while len(above) > 1 and is_row(fields := grid.fields(above[-1])):
        if any(isinstance(field, str) and meaning_of(field) is not None for field in fields):
            break
        above.pop()  # a row with something strange in it: said where it is read
    if not above:
        line = ", ".join(str(field) for field in grid.fields(start))
        raise FileFormatError(grid.source, start + 1, f"no header line: {shown(line)} holds numbers", _A_HEADER)
    return above[-1]


def _tables(
    grid: Grid, text: list[str] | None, facts: dict[str, str], head: int, header: int, separator: str | None
) -> list[Table]:
    """Return the table whose headings stand at an index, with those above and below it."""
    quiet = text is not None and not any(WORD.search(line) for line in text[header + 1 :])
    blocks = blocks_of(grid, head, header, below=not quiet)
    return [
        _table(replace(grid, size=block.stop), text, dict(facts), block, separator, ours=False) for block in blocks
    ]


def _table(
    grid: Grid, text: list[str] | None, facts: dict[str, str], block: Block, separator: str | None, *, ours: bool
) -> Table:
    """Return the table in a block of lines; in our own format nothing but rows is looked for below the headings."""
    headings = _headings(grid, text, block.header, separator)
    width = len(headings)
    head, header, first = block.head, block.header, block.first
    units, above, names = [""] * width, [""] * width, ()  # type: list[str], list[str], tuple[str, ...]
    notes: tuple[str, ...] = ()
    last = grid.size
    if not ours:
        below = grid.next_filled(header + 1)
        if below < grid.size and is_unit_row(grid.fields(below)):
            units = [str(field) for field in [*grid.fields(below), *units][:width]]
            first = max(first, below + 1)
        titles = [index for index in range(head, header) if not grid.is_blank(index)]
        names = block.titles(grid, titles)
        if titles and (spanning := _spanning(grid.fields(titles[-1]), width)) is not None:
            above = spanning
            titles.pop()
            if titles and (outer := _over_all(grid.fields(titles[-1]))):
                above = [f"{outer} {text}" for text in above]
                titles.pop()
        for index in titles:
            _title(facts, grid.fields(index))
        last, notes = _end(grid, first, width)
        grid, remarks = without_remarks(grid, text, first, last)
        notes += remarks
    filled = [] if text is not None else [index for index in range(first, last) if not grid.is_blank(index)]
    return Table(
        source=grid.source,
        facts=facts,
        headings=tuple(headings),
        units=tuple(units),
        above=tuple(above),
        titles=names,
        heading_line=header + 1,
        text=[] if text is None else _rows(text, grid, first, last) if not ours else text[first:last],
        separator=separator,
        first_line=first + 1,
        rows=None if text is not None else [list(grid.fields(index)[:width]) for index in filled],
        lines=[index + 1 for index in filled],
        notes=notes,
    )


def _rows(text: list[str], grid: Grid, first: int, last: int) -> list[str]:
    """Return the lines of the rows, with nothing in those that are to be passed over."""
    return ["" if grid.is_blank(index) else text[index] for index in range(first, last)]


def _headings(grid: Grid, text: list[str] | None, header: int, separator: str | None) -> list[str]:
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
            if (merged := _above(grid, header, column)) is not None:
                headings[column] = merged
                continue
            problem = f"column {column + 1} has no heading"
            raise FileFormatError(grid.source, header + 1, problem, "a heading in every column")
    while headings and not headings[-1]:
        headings.pop()
    return headings


def _above(grid: Grid, header: int, column: int) -> str | None:
    """Return the words above a heading that is empty, as they are where the two cells are merged."""
    above = grid.fields(header - 1) if header > 0 and not grid.is_blank(header - 1) else ()
    cell = above[column] if len(above) > column else ""
    return cell if isinstance(cell, str) and meaning_of(cell) is not None else None


def _is_empty_column(grid: Grid, first: int, column: int) -> bool:
    rows = (grid.fields(index) for index in range(first, grid.size) if not grid.is_blank(index))
    return not any(len(row) > column and row[column] != "" for row in rows)


def _spanning(fields: Sequence[Cell], width: int) -> list[str] | None:
    """Return headings that span several columns, filled in to the right; None for a line that is a mere title."""
    filled = [index for index, field in enumerate(fields) if field != ""]
    if over := _over_all(fields):
        return [over] * width
    if not filled or filled[-1] == 0 or (len(filled) == _KEY_AND_VALUE and filled == [0, 1]):
        return None
    found, current = [], ""
    for column in range(width):
        current = str(fields[column] if column < len(fields) else "") or current
        found.append(current)
    return found


def _over_all(fields: Sequence[Cell]) -> str:
    """Return a lone cell that says what all the runs below it hold, such as 'Deviation [µm]', or nothing."""
    filled = [index for index, field in enumerate(fields) if field != ""]
    meaning = meaning_of(str(fields[0])) if filled == [0] else None
    return str(fields[0]) if meaning is not None and meaning.unit is not None and meaning.unit.inside else ""


def _title(facts: dict[str, str], fields: Sequence[Cell]) -> None:
    """Keep a title line ``key: value``, or a key and a value in two cells, as a fact."""
    filled = [str(field) for field in fields if field != ""]
    if len(filled) == _KEY_AND_VALUE and ":" not in filled[0][:-1]:
        _add_fact(facts, filled[0].rstrip(":= "), filled[1])
    elif (match := _TITLE_FACT.fullmatch(" ".join(filled))) is not None:
        _add_fact(facts, match["key"], match["value"])


def _end(grid: Grid, first: int, width: int) -> tuple[int, tuple[str, ...]]:
    """Return the index behind the last row: text behind an empty line, and sums below the rows, are no readings."""
    last = grid.size
    while last > first and grid.is_blank(last - 1):
        last -= 1
    end = last
    for index in range(last - 1, first - 1, -1):
        if grid.is_blank(index) or is_summary(grid.fields(index)):
            end = index
        elif len(fields := grid.fields(index)) == width and is_row(fields):
            break
    else:
        return last, ()
    left = grid.next_filled(end)
    if left >= last:
        return last, ()
    text = " ".join(str(field) for field in grid.fields(left) if field != "")
    return end, (f"what stands below the table, from line {left + 1} on, is left out: {shown(text)}",)
