"""Several tables in one file or sheet: one for each run or direction are joined, of different things asked about."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from rtec.errors import ArgumentError, FileFormatError
from rtec.metrology.plain_numbers import shown
from rtec.metrology.tables.cells import Cell, number_of
from rtec.metrology.tables.choices import ColumnChoices
from rtec.metrology.tables.headings import meaning_of
from rtec.metrology.tables.table import Table
from rtec.metrology.tables.wide import Pass, pass_of, passes_of
from rtec.metrology.tables.words import ACTUAL, BACKWARD, DEVIATION, FORWARD, RUN, TIME, plain_words

_READINGS = ("deviation", "actual", "force", "current", "torque", "voltage")
_FEWEST = 2
_ALIKE = 0.75
"""Share of the targets of all that each table has where each is a run."""
_PAGE = re.compile(r"(?:page|seite|blatt|sheet|feuille)\W*[0-9]*\W*(?:(?:of|von|/|sur)\W*[0-9]+)?", re.IGNORECASE)


def one_table(tables: Sequence[Table], choices: ColumnChoices) -> Table:
    """Return the table to be read: the only one with readings, the one that was chosen, or all of them joined.

    Raises
    ------
    FileFormatError
        Several that are of different things, or that nothing tells apart.
    ArgumentError
        A number that no table has.
    """
    found = [part for table in tables for part in _side_by_side(table, choices)]
    if choices.table is not None:
        if choices.table > len(found):
            numbers = "1" if len(found) == 1 else f"1 to {len(found)}"
            raise ArgumentError("--table", choices.table, f"{numbers} in {found[0].source}: {_listed(found)}")
        return found[choices.table - 1]
    if len(found) == 1:
        return found[0]
    good = [table for table in found if _has_readings(table, choices)]
    if not good:
        good = found
    left = [table for table in found if table not in good]
    note = (f"{_listed(left)}: not read, as it holds no readings",) if left else ()
    if len(good) > 1:
        joined = _joined(good, choices)
        if joined is None:
            problem = f"{len(found)} tables, and nothing says that they are runs of one test: {_listed(found)}"
            number = found.index(good[0]) + 1
            allowed = f"--table {number}, or another of them; or a column of runs, or 'Run 1' and so on above each"
            raise FileFormatError(found[0].source, good[1].first_line, problem, allowed)
        good = [joined]
    return replace(good[0], notes=(*good[0].notes, *note))


def _listed(tables: Sequence[Table]) -> str:
    names = [
        f"{shown(title)}, rows from line {table.first_line}"
        if title
        else f"rows from line {table.first_line} ({shown(', '.join(table.headings))})"
        for title, table in zip(_names(tables), tables, strict=True)
    ]
    return "; ".join(names[:4]) + ("; ..." if len(names) > 4 else "")


def _names(tables: Sequence[Table]) -> list[str]:
    """Return what the titles of each table say of it alone, without dates and times."""
    if len(tables) < _FEWEST:
        return [" ".join(table.titles[-1:]) for table in tables]
    most = max(len(table.titles) for table in tables[1:])
    titles = [table.titles[max(0, len(table.titles) - most) :] for table in tables]  # not those of the whole file
    shared = set(titles[0]).intersection(*titles[1:])
    return [
        ", ".join(line for line in lines if line not in shared and TIME.isdisjoint(plain_words(line)[:1]))
        for lines in titles
    ]


def _pass_named(title: str) -> Pass | None:
    """Return the pass that a title names, whatever follows it behind a colon or in brackets."""
    return pass_of(0, title) or pass_of(0, re.split(r"(?<=\d)\s*[:(,;]", title)[0])


def _quantities(table: Table, choices: ColumnChoices) -> list[str | None]:
    found: list[str | None] = []
    for index, (heading, unit) in enumerate(zip(table.headings, table.units, strict=True)):
        said = choices.of_column(index + 1, heading)
        meaning = None if said else meaning_of(heading, unit)
        found.append(said.partition("_")[0] if said else meaning.quantity if meaning else None)
    return found


def _has_readings(table: Table, choices: ColumnChoices) -> bool:
    """Return whether a table holds readings: not only targets and what was computed."""
    quantities = _quantities(table, choices)
    passes = _target(table, choices) is not None and passes_of(table.headings, table.above, frozenset())
    return bool(passes) or any(quantity in _READINGS for quantity in quantities) or quantities.count("position") > 1


def _side_by_side(table: Table, choices: ColumnChoices) -> list[Table]:
    """Return tables that stand side by side, as columns with the same headings again or an empty one between."""
    headings = [heading.strip().lower() for heading in table.headings]
    groups: list[list[int]] = [[]]
    for index, heading in enumerate(headings):
        if not heading or (groups[-1] and heading == headings[groups[-1][0]]):
            groups.append([])
        if heading:
            groups[-1].append(index)
    groups = [group for group in groups if group]
    if len(groups) < _FEWEST:
        return [table]
    parts = [_part(table, group) for group in groups]
    whole = [_has_readings(part, choices) and _target(part, choices) is not None for part in parts]
    if not all(whole):
        return [table]
    rows, lines = table.cells()
    found = []
    for part, group in zip(parts, groups, strict=True):
        own = [([row[index] for index in group], line) for row, line in zip(rows, lines, strict=True)]
        own = [(cells, line) for cells, line in own if any(cell != "" for cell in cells)]
        found.append(replace(part, rows=[cells for cells, _ in own], lines=[line for _, line in own]))
    return found


def _part(table: Table, group: Sequence[int]) -> Table:
    above = [table.above[index] for index in group]
    title = next((text for text in above if text), "")
    return replace(
        table,
        headings=tuple(table.headings[index] for index in group),
        units=tuple(table.units[index] for index in group),
        above=tuple("" if text == title else text for text in above),
        titles=(title,) if title else (),
    )


def _target(table: Table, choices: ColumnChoices) -> int | None:
    quantities = _quantities(table, choices)
    found = [index for name in ("target", "position") for index, one in enumerate(quantities) if one == name]
    return found[0] if found else None


def _joined(tables: Sequence[Table], choices: ColumnChoices) -> Table | None:
    """Return tables of one test below each other, with columns for what told them apart; None where nothing does."""
    first = tables[0]
    heads = {(tuple(heading.strip().lower() for heading in table.headings), table.units) for table in tables}
    if len(heads) > 1 or _target(first, choices) is None:
        return None
    titles = _names(tables)
    passes = _numbered([one for one in map(_pass_named, titles) if one is not None])
    if len({(one.run, one.direction) for one in passes}) == len(tables) and _name_passes_alone(titles, passes):
        return _of_passes(tables, titles, passes, choices)
    if all(not title or _PAGE.fullmatch(title.strip()) for title in titles[1:]):
        return _repeated(tables, choices, pages=any(titles))
    return None


def _name_passes_alone(titles: Sequence[str], passes: Sequence[Pass]) -> bool:
    """Return whether titles differ in nothing but run and direction: 'Axis 1' and 'Axis 2' are no runs."""
    rests = {
        frozenset(word for word in plain_words(title) if word.isalpha() and word not in FORWARD | BACKWARD)
        for title in (re.split(r"(?<=\d)\s*[:(,;]", title)[0] for title in titles)
    }
    rest = next(iter(rests))
    numbered = any(one.run is not None for one in passes) and any(map(str.isdigit, "".join(titles)))
    return len(rests) == 1 and (not numbered or not rest or bool(rest & RUN) or rest <= DEVIATION | ACTUAL)


def _repeated(tables: Sequence[Table], choices: ColumnChoices, *, pages: bool) -> Table | None:
    """Return tables that only repeat their headings below each other: a run each, or one table on several pages."""
    first, many = tables[0], len(tables)
    quantities = _quantities(first, choices)
    target = quantities.index("target" if "target" in quantities else "position")
    cells = [table.cells() for table in tables]
    where = [{_value(row[target]) for row in rows} for rows, _ in cells]
    runs_alike = all(len(one) >= _ALIKE * len(set().union(*where)) for one in where)
    wide = bool(passes_of(first.headings, first.above, frozenset()))
    if "run" not in quantities and runs_alike and not wide:
        numbers = [[float(number)] for number in range(1, many + 1)]
        return _below_each_other(tables, ["run"], numbers, f"took {many} tables for runs, in their order")
    named = [index for index, one in enumerate(quantities) if one in ("run", "direction", "target", "position")]
    keys = [{tuple(str(row[index]) for index in named) for row in rows} for rows, _ in cells]
    apart = sum(map(len, keys)) == len(set().union(*keys))
    pairs = zip(cells, tables[1:], strict=False)
    without_gap = all(lines[-1:] == [later.heading_line - 1] for (_, lines), later in pairs)
    if apart if wide or "run" in quantities else pages or without_gap:
        return _below_each_other(
            tables, [], [[] for _ in tables], f"took {many} tables with the same headings for one"
        )
    return None


def _numbered(passes: Sequence[Pass]) -> list[Pass]:
    """Return passes whose directions come again and again with the number of their run."""
    ways = [one.direction for one in passes]
    if any(one.run is not None or one.direction is None for one in passes) or len(set(ways)) == len(ways):
        return list(passes)
    return [replace(one, run=ways[: number + 1].count(one.direction)) for number, one in enumerate(passes)]


def _of_passes(
    tables: Sequence[Table], titles: Sequence[str], passes: Sequence[Pass], choices: ColumnChoices
) -> Table | None:
    """Return tables whose titles name a run or a direction below each other, with columns that hold it."""
    have = set(_quantities(tables[0], choices))
    names: list[str] = []
    added: list[list[Cell]] = [[] for _ in tables]
    for name, values in (("run", [one.run for one in passes]), ("direction", [one.direction for one in passes])):
        stated = all(value is not None for value in values)
        if stated and name not in have:
            names.append(name)
            for cell, value in zip(added, values, strict=True):
                cell.append(float(value or 0))
        elif not stated and any(value is not None for value in values):
            return None
    if not names and not have & {"run", "direction"}:
        return None
    said = ", ".join(shown(title) for title in titles[:3])
    note = f"took {len(tables)} tables for parts of one test: {said}{', ...' if len(tables) > 3 else ''}"
    return _below_each_other(tables, names, added, note)


def _below_each_other(
    tables: Sequence[Table], names: Sequence[str], added: Sequence[Sequence[Cell]], note: str
) -> Table:
    """Return the rows of tables below each other, each with cells of its table added."""
    first = tables[0]
    cells = [table.cells() for table in tables]
    more = ("",) * len(names)
    where = ", ".join(dict.fromkeys(f"line {table.first_line}" for table in tables[:3]))
    return replace(
        first,
        headings=(*first.headings, *names),
        units=(*first.units, *more),
        above=(*first.above, *more),
        rows=[[*row, *own] for (rows, _), own in zip(cells, added, strict=True) for row in rows],
        lines=[line for _, lines in cells for line in lines],
        text=[],
        notes=(*dict.fromkeys(text for table in tables for text in table.notes), f"{note} (rows from {where})"),
    )


def _value(cell: Cell) -> Cell:
    """Return what a cell holds as a number, so that 0 and 0.00 are the same target."""
    found = number_of(cell, "," if isinstance(cell, str) and "," in cell else ".")
    return cell if found is None else found
