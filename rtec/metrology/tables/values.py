"""From the cells of placed columns to numbers in the units inside, row by row where something is wrong or missing."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rtec.errors import FileFormatError
from rtec.metrology.columns import ColumnUnit, units_lacking
from rtec.metrology.measurement import Cells
from rtec.metrology.plain_numbers import plain_numbers, shown
from rtec.metrology.readings import Floats
from rtec.metrology.tables.cells import Cell, decimal_marks, direction_of, is_missing, number_of, run_of
from rtec.metrology.tables.choices import IGNORE
from rtec.metrology.tables.placing import Placed
from rtec.metrology.tables.table import Table
from rtec.metrology.tables.times import is_date_or_clock, seconds_since_first
from rtec.metrology.tables.words import plain_words

_SAMPLE = 2000
_NEEDED = ("target", "actual", "deviation", "direction", "run", "time")
_A_NUMBER = "a decimal number, such as -20.01852 or 1e-3"
_A_DIRECTION = "+1 or -1, + or -, forward or backward"
_MERGED = ("target", "run", "direction")
_MOST_NAMED = 3
_EITHER_WAY = frozenset(("cw", "ccw", "left", "right", "l", "r", "out", "return", "outward"))
_NUMBERS = frozenset("nr no n num number nummer messung measurement meas set series".split())


class Values:
    """The cells of a table, with those rows left out that lack a reading.

    Parameters
    ----------
    table, placed
        The table, and what its columns are.
    decimal
        The decimal mark, where the user states it.
    passes
        Columns of a wide table: numbers, in which a missing cell leaves out no row.
    gaps
        As of `ColumnChoices`.
    """

    def __init__(
        self,
        table: Table,
        placed: Placed,
        decimal: str | None,
        passes: Sequence[int] = (),
        *,
        gaps: bool = False,
    ) -> None:
        self.table, self.placed, self.passes, self.gaps = table, placed, passes, gaps
        self.notes: list[str] = []
        self.left_out: set[int] = set(placed.ignored)
        self.numbers = self._quickly(decimal)
        self.rows: list[list[Cell]] = []
        self.lines: Sequence[int] = ()
        self.mark = "."
        if self.numbers is not None:
            self.lines = table.lines or _numbered(table.text, table.first_line)
            return
        self.rows, self.lines = table.cells()
        if not self.rows:
            problem = "no row follows the header"
            raise table.refused(problem, "one row for each reading")
        self._fill_merged()
        self._skip_missing()
        self.mark = decimal or self._decimal()

    def _quickly(self, decimal: str | None) -> NDArray[np.float64] | None:
        """Return all cells in one sweep where they are numbers with nothing strange between them."""
        table, width = self.table, len(self.table.headings)
        if table.rows is not None or table.numbers is not None:
            return table.numbers
        few = [text.split(table.separator) for text in table.text[:_SAMPLE] if text.strip()]
        apart = table.separator == ","
        marks = decimal_marks((cell.strip() for row in few for cell in row), commas_apart=apart)
        if decimal is None and len(marks) > 1:
            return None
        if decimal != ",":
            found = plain_numbers(table.text, width, table.separator)
            if found is not None or apart:
                return found
        if decimal is None and marks != {","}:
            return None
        if any("." in text for text in table.text):
            return None  # between thousands, or a muddle: cell by cell
        return plain_numbers([text.replace(",", ".") for text in table.text], width, table.separator)

    def _fill_merged(self) -> None:
        """Fill empty cells below a target, run or direction that was written once for several rows."""
        for column, (quantity, _) in self.placed.columns.items():
            filled = [row for row, cells in enumerate(self.rows) if cells[column] != ""]
            gaps = {after - before for before, after in pairwise([*filled, len(self.rows)])}
            if quantity not in _MERGED or filled[:1] != [0] or len(filled) == 1 or len(gaps) != 1 or gaps == {1}:
                continue
            for row, cells in enumerate(self.rows):
                cells[column] = cells[column] if cells[column] != "" else self.rows[row - 1][column]
            heading = shown(self.table.headings[column])
            self.notes.append(f"empty cells of column {heading} are taken for those above: {len(filled)} are filled")

    def _skip_missing(self) -> None:
        """Leave out the rows that lack a reading, and columns that lack nearly all of them."""
        missing: dict[int, list[int]] = {}
        for column, (quantity, _) in self.placed.columns.items():
            if self._may_lack(quantity) and any(_holds(cells[column]) for cells in self.rows):
                continue
            signs = quantity == "direction" and any(cells[column] == "+" for cells in self.rows)
            rows = [row for row, cells in enumerate(self.rows) if is_missing(cells[column], signs=signs)]
            if 2 * len(rows) <= len(self.rows):
                missing[column] = rows
            elif quantity.partition("_")[0] in _NEEDED:
                self._refuse_gaps(column, rows)
            else:
                self.left_out.add(column)
                heading = shown(self.table.headings[column])
                self.notes.append(
                    f"column {heading} is not used: {len(rows)} of its {len(self.rows)} cells are empty"
                )
        skipped = sorted({row for rows in missing.values() for row in rows})
        if not skipped:
            return
        if len(skipped) == len(self.rows):
            self._refuse_gaps(*next((column, rows) for column, rows in missing.items() if rows))
        first = skipped[0]
        where = ", ".join(str(self.lines[row]) for row in skipped[:_MOST_NAMED])
        column = next(column for column, rows in missing.items() if first in rows)
        what = "is empty" if not str(self.rows[first][column]) else f"is {shown(str(self.rows[first][column]))}"
        self.notes.append(
            f"{len(skipped)} of {len(self.rows)} rows are left out, because a cell is empty: "
            f"line {where}{', ...' if len(skipped) > _MOST_NAMED else ''} ({self.table.called(column)} {what})"
        )
        kept = sorted(set(range(len(self.rows))) - set(skipped))
        self.rows = [self.rows[row] for row in kept]
        self.lines = [self.lines[row] for row in kept]

    def _may_lack(self, quantity: str) -> bool:
        """Return whether values of a quantity may be missing."""
        return self.gaps and quantity.startswith("temperature")

    def _refuse_gaps(self, column: int, rows: Sequence[int]) -> None:
        heading = self.table.called(column)
        many = f", as in {len(rows)} of {len(self.rows)} rows" if len(self.rows) > 1 else ""
        problem, allowed = (
            f"{heading} is empty{many}",
            "a value in every row (cells that were merged are to be filled)",
        )
        raise FileFormatError(self.table.source, self.lines[rows[0]], problem, allowed)

    def _decimal(self) -> str:
        """Return the decimal mark of the table; ask where both are possible."""
        columns = [column for column in (*self.placed.columns, *self.passes) if column not in self.left_out]
        columns = [
            column for column in columns if self.placed.columns.get(column, ("", None))[0] not in ("time", "run")
        ]
        apart = self.table.separator == "," and bool(self.table.text)
        marks = decimal_marks((cells[column] for cells in self.rows for column in columns), commas_apart=apart)
        if len(marks) == 1:
            return next(iter(marks))
        marked = (
            cell
            for cells in self.rows
            for column in columns
            if isinstance(cell := cells[column], str) and ("," in cell or (marks and "." in cell))
        )
        example = shown(next(marked, ""))
        if marks:
            sign = "comma" if "," in example else "point"
            problem = f"{example} may have a decimal {sign}, or a {sign} between thousands"
            raise FileFormatError(
                self.table.source, None, problem, "--decimal comma or --decimal point, to say which"
            )
        problem = f"numbers with a decimal point, and numbers with a decimal comma, such as {example}"
        raise FileFormatError(self.table.source, None, problem, "one of them throughout; --decimal says which")

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(self.rows) if self.numbers is None else len(self.numbers)

    def column(self, index: int) -> Floats:
        """Return a column that is placed, in its unit inside, shape (rows,).

        Raises
        ------
        FileFormatError
            A cell that the quantity does not allow, with its line.
        """
        quantity, unit = self.placed.columns[index]
        assert unit is not None  # noqa: S101 - times of dates are read by `time`
        if quantity == "direction" and (told := self._told_by_motion(index)) is not None:
            return told
        if self.numbers is not None:
            raw = self.numbers[:, index].copy()
        else:
            raw = np.array([self._number(row, index, quantity) for row in range(len(self.rows))])
        return self._inside(index, quantity, unit, raw)

    def _told_by_motion(self, index: int) -> Floats | None:
        """Return directions with names that are unknown or stand for either, where the order of the targets tells."""
        numbers = self.numbers
        names = (
            [_text(cells[index]) for cells in self.rows] if numbers is None else [f"{n:g}" for n in numbers[:, index]]
        )
        if all(
            name.strip().lower() not in _EITHER_WAY and direction_of(name) is not None
            for name in dict.fromkeys(names)
        ):
            return None
        columns = {quantity: column for column, (quantity, _) in self.placed.columns.items()}
        position = columns.get("target", columns.get("actual"))
        if position is None:
            return None
        run = self.column(columns["run"]) if "run" in columns else np.ones(len(names))
        told = ways_by_motion(names, self.column(position), run)
        if told is None:
            return None
        forward = next(name for name, way in told.items() if way > 0)
        heading = shown(self.table.headings[index])
        self.notes.append(f"took {shown(forward)} in column {heading} for forward: there the targets ascend")
        return np.array([float(told[name]) for name in names])

    def _inside(self, index: int, quantity: str, unit: ColumnUnit, raw: Floats) -> Floats:
        known = raw[np.isfinite(raw)] if self._may_lack(quantity) else raw
        if (outside := _outside_range(quantity, unit, known)) is not None:
            row, allowed = outside
            problem = f"{self.table.called(index)} {raw[row]:g} is not valid"
            allowed += self._or_ignore(index, quantity)
            raise FileFormatError(self.table.source, self.lines[row], problem, allowed)
        return (raw + unit.offset) * unit.factor

    def _number(self, row: int, index: int, quantity: str) -> float:
        cell = self.rows[row][index]
        found: float | None
        allowed = _A_NUMBER
        if quantity == "direction":
            found, allowed = direction_of(cell), _A_DIRECTION
            found = number_of(cell, self.mark) if found is None else found
        else:
            found = run_of(cell) if quantity == "run" else number_of(cell, self.mark)
        if found is None and self._may_lack(quantity) and not _holds(cell):
            return math.nan
        if found is None:
            heading, text = self.table.called(index), str(cell)
            kind = (
                f"{heading} {shown(text)} is {'no direction' if quantity == 'direction' else 'not a finite number'}"
            )
            allowed += self._or_ignore(index, quantity)
            raise FileFormatError(self.table.source, self.lines[row], kind, allowed)
        return found

    def _or_ignore(self, index: int, quantity: str) -> str:
        """Return what to do where a column was taken for a direction or a run, and is none."""
        told = ", and the order of the targets tells" if quantity == "direction" else ""
        guessed = quantity in ("direction", "run") and self.table.headings[index].lower() != quantity
        return f"; {self.table.as_choice(index, IGNORE)} leaves it out{told}" if guessed else ""

    def pass_column(self, index: int, factor: float) -> tuple[Floats, NDArray[np.bool_]]:
        """Return a column of a wide table times a factor, and which of its cells hold a reading, shape (rows,)."""
        if self.numbers is not None:
            return self.numbers[:, index] * factor, np.ones(len(self.numbers), dtype=np.bool_)
        there = np.array([not is_missing(cells[index]) for cells in self.rows])
        values = [self._number(row, index, "") if there[row] else 0.0 for row in range(len(self.rows))]
        return np.array(values) * factor, there

    def time(self, indices: Sequence[int]) -> Floats:
        """Return the time in s of a column of dates or times of day, or of one of each together, shape (rows,)."""
        headings = [self.table.called(index) for index in indices]
        firsts = [str(self.rows[0][index]) for index in indices] if self.rows else []
        if not firsts or not all(is_date_or_clock(first) for first in firsts) or len(indices) > 2:
            problem = f"column {shown(headings[0])} has no unit"
            raise self.table.refused(problem, units_lacking("time") or "")
        if len(indices) == 2 and ":" in firsts[0] and ":" not in firsts[1]:
            indices = [indices[1], indices[0]]
        cells = [" ".join(str(row[index]).strip() for index in indices) for row in self.rows]
        seconds, notes = seconds_since_first(self.table.source, self.lines, headings[0], cells)
        self.notes += notes
        return seconds

    def unknown(self, index: int) -> Cells:
        """Return a column of no known quantity: numbers, or text where a cell is none, shape (rows,)."""
        if self.numbers is not None:
            return self.numbers[:, index].copy()
        heading = self.table.called(index)
        if self.gaps and (with_gaps := self._with_gaps(index)) is not None:
            return with_gaps
        for row, cells in enumerate(self.rows):
            if _is_no_number(cells[index]):
                problem = f"{heading} {shown(str(cells[index]))} is not finite"
                raise FileFormatError(self.table.source, self.lines[row], problem, "a finite number, or text")
        found = [number_of(cells[index], self.mark) for cells in self.rows]
        if all(value is not None for value in found):
            return np.array(found, dtype=np.float64)
        return np.array([_text(cells[index]) for cells in self.rows], dtype=np.str_)

    def _with_gaps(self, index: int) -> Floats | None:
        """Return a column of numbers with NaN where a cell holds none; None for a column of text."""
        there = [_holds(cells[index]) for cells in self.rows]
        found = [number_of(cells[index], self.mark) for cells in self.rows]
        if not any(there) or any(value is None and holds for value, holds in zip(found, there, strict=True)):
            return None
        return np.array([math.nan if value is None else value for value in found])


def _holds(cell: Cell) -> bool:
    """Return whether a cell holds something: a number that is finite, or text."""
    return not is_missing(cell) and not _is_no_number(cell)


def _text(cell: Cell) -> str:
    return cell if isinstance(cell, str) else f"{cell:.15g}"


def _is_no_number(cell: Cell) -> bool:
    """Return whether a cell holds what is left of a number that went wrong: nan, an infinity, or one too large."""
    if isinstance(cell, float):
        return not math.isfinite(cell)
    if cell.strip().lower().lstrip("+-") in ("nan", "inf", "infinity"):
        return True
    try:
        return math.isinf(float(cell)) if len(cell) < 60 and cell[-1:].isdigit() else False
    except ValueError:
        return False


def _outside_range(quantity: str, unit: ColumnUnit, raw: Floats) -> tuple[int, str] | None:
    """Return the first row that the meaning of the quantity does not allow, and what it allows."""
    if quantity == "direction":
        good, allowed = np.abs(raw) == 1, "+1 or -1"
    elif quantity == "run":
        good, allowed = (raw == np.round(raw)) & (np.abs(raw) < 2**31), "a whole number"
    else:
        with np.errstate(over="ignore"):
            good = np.isfinite((raw + unit.offset) * unit.factor)
        allowed = "a number that stays finite in " + unit.inside
    return None if good.all() else (int(np.flatnonzero(~good)[0]), allowed)


def _numbered(body: Sequence[str], first_line: int) -> Sequence[int]:
    """Return the line number of each row: a mere range, unless there are empty lines between the rows."""
    last = len(body)
    while last and not body[last - 1].strip():
        last -= 1
    rows: Iterable[str] = body[:last]
    if not any(not text or text.isspace() for text in rows):
        return range(first_line, first_line + last)
    return [line for line, text in enumerate(body, first_line) if text.strip()]


def ways_by_motion(names: Sequence[str], target: Floats, run: Floats) -> dict[str, int] | None:
    """Return the direction that each of two names stands for, or None where the targets do not tell.

    +1 for the name under which all targets of a run ascend, one after the other, −1 for the other. Names, targets and
    runs are those of the readings in their order.

    Examples
    --------
    >>> ways_by_motion(["A", "A", "B", "B"], np.array([0.0, 9, 9, 0]), np.ones(4))
    {'A': 1, 'B': -1}
    >>> ways_by_motion(["A", "B", "A", "B"], np.array([0.0, 0, 9, 9]), np.ones(4)) is None
    True
    """
    found: dict[str, set[int]] = {name: set() for name in names}
    if len(found) != 2:
        return None
    steps = np.sign(np.diff(target)).astype(int).tolist()
    same_run = (np.diff(run) == 0).tolist()
    for before, after, step, same in zip(names, names[1:], steps, same_run, strict=False):
        if before == after and same and step:
            found[after].add(step)
    told = {name: next(iter(steps)) for name, steps in found.items() if len(steps) == 1}
    return told if sorted(told.values()) == [-1, 1] else None


def counts_runs(heading: str, numbers: Floats, target: Floats) -> bool:
    """Return whether a column that is called a number counts runs: up from run to run, with several targets in each.

    ``Nr.`` may number the rows, the targets or the runs; numbers and targets have the shape (rows,), in order.

    Examples
    --------
    >>> target = np.array([0.0, 9, 0, 9])
    >>> counts_runs("Nr.", np.array([1.0, 1, 2, 2]), target), counts_runs("Nr.", np.array([1.0, 2, 3, 4]), target)
    (True, False)
    """
    if not (set(plain_words(heading)) <= _NUMBERS and (np.diff(numbers) >= 0).all() and np.ptp(numbers) > 0):
        return False
    runs = [target[numbers == one] for one in np.unique(numbers)]
    return bool((numbers == np.round(numbers)).all()) and all(np.ptp(places) > 0 for places in runs)
