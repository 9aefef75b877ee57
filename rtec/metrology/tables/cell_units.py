"""Units behind numbers in cells, such as ``12,5 mm``: taken off where they agree with each other and the heading."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from rtec.errors import FileFormatError
from rtec.metrology.columns import ColumnUnit, column_unit, quantity_of_heading
from rtec.metrology.plain_numbers import shown
from rtec.metrology.tables.cells import Cell, apart_from_unit, decimal_marks, is_missing, may_hold_units, number_of
from rtec.metrology.tables.choices import IGNORE, ColumnChoices
from rtec.metrology.tables.headings import contradicting_units, meaning_of, named_and_unit, unit_below
from rtec.metrology.tables.table import Table
from rtec.metrology.tables.wide import pass_of

_OTHERS = ("direction", "run")


def without_units(table: Table, choices: ColumnChoices) -> Table:
    """Return a table with bare numbers in its cells and units below the headings; that of a choice goes before.

    Raises
    ------
    FileFormatError
        A unit that is another than the heading's, cells without a unit below cells with one, or units of one column
        that are not of one kind.

    Examples
    --------
    >>> table = Table(source="x.csv", facts={}, headings=("Soll",), units=("",), above=("",), heading_line=1,
    ...               rows=[["1 mm"], ["900 µm"]], lines=[2, 3])
    >>> found = without_units(table, ColumnChoices())
    >>> found.rows, found.units, found.notes
    ([[1.0], [0.9]], ('mm',), ("column 'Soll' is in mm and um: all of it was turned into mm",))
    """
    if table.numbers is not None or (table.rows is None and not may_hold_units(table.text)):
        return table
    rows, lines = table.cells()
    units, notes = list(table.units), list(table.notes)
    changed: dict[int, list[Cell]] = {}
    for column, heading in enumerate(table.headings):
        choice = choices.of_column(column + 1, heading)
        if choice in (IGNORE, *_OTHERS) or not (choice or _may_be_length(heading, table.above[column])):
            continue
        parts = {
            row: found for row, cells in enumerate(rows) if (found := apart_from_unit(cells[column])) is not None
        }
        if not parts:
            continue
        names = list(dict.fromkeys(unit for _, unit in parts.values()))
        if choice is None:
            _refuse_others(table, column, parts, lines)
        if not (choice and quantity_of_heading(choice)) and not _stated(table, column):
            bare = [row for row, cells in enumerate(rows) if row not in parts and not is_missing(cells[column])]
            _refuse_bare(table, column, bare, rows, lines, names)
        changed[column] = [parts[row][0] if row in parts else cells[column] for row, cells in enumerate(rows)]
        if len(names) > 1:
            changed[column] = _in_one_unit(table, column, changed[column], parts, choices)
            notes.append(f"column {shown(heading)} is in {' and '.join(names)}: all of it was turned into {names[0]}")
        units[column] = units[column] or names[0]
    if not changed:
        return table
    new = [
        [changed[c][row] if c in changed else cell for c, cell in enumerate(rows[row])] for row in range(len(rows))
    ]
    return replace(table, rows=new, lines=lines, text=[], units=tuple(units), notes=tuple(notes))


def _may_be_length(heading: str, above: str) -> bool:
    """Return whether a column is one that is read, and holds numbers with a unit."""
    meaning = meaning_of(heading)
    return meaning.quantity not in _OTHERS if meaning is not None else pass_of(0, heading, above) is not None


def _stated(table: Table, column: int) -> str | None:
    heading = table.headings[column]
    ours = quantity_of_heading(heading)
    return unit_below(table.units[column]) or named_and_unit(heading)[1] or (heading if ours is not None else None)


def _refuse_others(table: Table, column: int, parts: Mapping[int, tuple[str, str]], lines: Sequence[int]) -> None:
    """Refuse a unit that is another than the one above the column."""
    heading, below = table.headings[column], unit_below(table.units[column])
    for row, (_, unit) in parts.items():
        units = contradicting_units(heading, unit) or ((below, unit) if below not in (None, unit) else None)
        if units is not None:
            problem = f"column {shown(heading)} states {units[0]}, and a cell of it {unit}"
            choice = f"; or {table.as_choice(column, 'QUANTITY_UNIT')}, such as deviation_um, says which"
            allowed = "one unit" + (choice if meaning_of(heading) is not None else "")
            raise FileFormatError(table.source, lines[row], problem, allowed)


def _refuse_bare(
    table: Table,
    column: int,
    bare: Sequence[int],
    rows: Sequence[Sequence[Cell]],
    lines: Sequence[int],
    names: Sequence[str],
) -> None:
    if bare:
        problem = (
            f"{table.called(column)} {shown(str(rows[bare[0]][column]))} has no unit; other cells have {names[0]}"
        )
        allowed = f"a unit in every cell or in the heading; or {table.as_choice(column, 'QUANTITY_UNIT')} for all"
        raise FileFormatError(table.source, lines[bare[0]], problem, allowed)


def _in_one_unit(
    table: Table,
    column: int,
    cells: Sequence[Cell],
    parts: Mapping[int, tuple[str, str]],
    choices: ColumnChoices,
) -> list[Cell]:
    """Return cells with different units as numbers in the unit of the first of them."""
    names = list(dict.fromkeys(unit for _, unit in parts.values()))
    found = {name: column_unit("position", name) for name in names}
    known: dict[str, ColumnUnit] = {name: unit for name, unit in found.items() if unit is not None}
    said = choices.of_column(column + 1, table.headings[column])
    ours = quantity_of_heading(said) if said else None
    if len(known) < len(names) or len({unit.inside for unit in known.values()}) > 1 or ours is not None:
        problem = f"cells of column {shown(table.headings[column])} are in {' and '.join(names)}"
        allowed = "one unit for all of them, or units of length alone, or of angle alone"
        raise table.refused(problem, allowed)
    marks = decimal_marks(number for number, _ in parts.values())
    if choices.decimal is None and len(marks) != 1:
        problem = f"{table.called(column)} {shown(cells[0] if isinstance(cells[0], str) else '')}: its decimal mark"
        raise table.refused(problem, "--decimal comma or --decimal point")
    mark = choices.decimal or next(iter(marks))
    base = known[names[0]].factor
    values = {row: number_of(number, mark) for row, (number, _) in parts.items()}
    numbers = {row: value for row, value in values.items() if value is not None}
    return [
        numbers[row] * known[parts[row][1]].factor / base if row in numbers else cell
        for row, cell in enumerate(cells)
    ]
