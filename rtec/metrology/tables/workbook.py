"""A sheet of a workbook (.xlsx) as a table; of its formulas only the values that were saved with them."""

from __future__ import annotations

import datetime
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from rtec.errors import ArgumentError, FileFormatError, RtecError, nearest
from rtec.metrology.plain_numbers import shown
from rtec.metrology.tables.cells import Cell, looks_like_number
from rtec.metrology.tables.layout import tables_of_grid
from rtec.metrology.tables.table import MAX_COLUMNS, Table

_ZIP, _OLE = b"PK\x03\x04", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
_MOST_ENTRIES = 10_000
_MOST_BYTES = 1 << 27
"""Once unpacked: the cells of such a sheet take some 700 MB."""
_SAVE_AS = "a workbook saved as .xlsx without a password, or a sheet saved as CSV"


def is_workbook(path: str | Path) -> bool:
    """Return whether a file is a workbook of any kind, or another archive, by its first bytes.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "x.csv"
    >>> _ = file.write_text("target_mm")
    >>> is_workbook(file)
    False
    """
    try:
        with Path(path).open("rb") as file:
            return file.read(8).startswith((_ZIP, _OLE))
    except OSError:
        return False  # said when it is read


def tables_of_workbook(path: str | Path, sheet: str | None) -> list[Table]:
    """Return the tables in a sheet of a workbook; None for the only one that holds a table.

    Raises
    ------
    FileFormatError
        No workbook, one with a password or too large, several sheets with a table, a formula without a value.
    ArgumentError
        There is no such sheet.
    """
    _check(path)
    with Path(path).open("rb") as file, _opened(path, file, values=True) as book:
        name, rows = _chosen(path, book, sheet)
    width = max(map(len, rows), default=0)
    if any(len(row) < width or None in row for row in rows):  # what seems to be empty may be a formula
        with Path(path).open("rb") as file, _opened(path, file, values=False) as book:
            _refuse_formulas(path, book[name], rows)
    return tables_of_grid(f"{path} [{name}]", rows)


@contextmanager
def _opened(path: str | Path, file: IO[bytes], *, values: bool) -> Iterator[Any]:
    """Open a workbook, for its values or for its formulas; given as a file, for its name may end in anything."""
    from openpyxl import load_workbook  # noqa: PLC0415 - 0.2 s, for workbooks only

    book = None
    try:
        book = load_workbook(file, read_only=True, data_only=values, keep_links=False)
        yield book
    except RtecError:
        raise
    except Exception as error:  # of a damaged archive the library raises whatever its parts raise
        reason = f"this workbook cannot be read ({type(error).__name__})"
        raise FileFormatError(path, None, reason, _SAVE_AS) from None
    finally:
        if book is not None:
            book.close()


def _check(path: str | Path) -> None:
    """Refuse what is no workbook of today, is encrypted, or would become too large."""
    with Path(path).open("rb") as file:
        if file.read(8) == _OLE:
            problem = "an old workbook (.xls), or one with a password"
            raise FileFormatError(path, None, problem, _SAVE_AS)
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError):
        raise FileFormatError(path, None, "this archive is damaged", _SAVE_AS) from None
    names = {entry.filename for entry in entries}
    if any(entry.flag_bits & 1 for entry in entries):
        raise FileFormatError(path, None, "this archive is encrypted", _SAVE_AS)
    if "xl/workbook.xml" not in names:
        kind = "an OpenDocument file" if "mimetype" in names else "an archive"
        raise FileFormatError(path, None, f"this is {kind}, no .xlsx workbook", _SAVE_AS)
    size = sum(entry.file_size for entry in entries)
    if size > _MOST_BYTES or len(entries) > _MOST_ENTRIES:
        problem = f"{size} bytes in {len(entries)} parts, once unpacked"
        raise FileFormatError(path, None, problem, f"at most {_MOST_BYTES} bytes in {_MOST_ENTRIES} parts")


def _chosen(path: str | Path, book: Any, sheet: str | None) -> tuple[str, list[list[Cell | None]]]:
    """Return the name and the rows of the sheet that is asked for, or of the only one with numbers in it."""
    sheets = {each.title: each for each in book.worksheets}
    if sheet is not None:
        found = next((title for title in sheets if title.lower() == sheet.strip().lower()), None)
        if found is None:
            raise ArgumentError("--sheet", repr(sheet[:60]), _listed(sheets), nearest(sheet, sheets))
        return found, _rows(sheets[found])
    shown_sheets = {title: each for title, each in sheets.items() if each.sheet_state == "visible"}
    tables = {title: rows for title, each in shown_sheets.items() if _has_table(rows := _rows(each))}
    if len(tables) > 1:
        problem = f"{len(tables)} sheets hold a table: {_listed(tables)}"
        raise FileFormatError(path, None, problem, f"--sheet {shown(next(iter(tables)))}, or another of them")
    if not tables:
        raise FileFormatError(path, None, "no sheet holds a table", "headings, and rows of numbers below them")
    return next(iter(tables.items()))


def _listed(sheets: dict[str, Any]) -> str:
    names = ", ".join(sheets)
    return names if len(names) <= 200 else names[:197] + "..."


def _has_table(rows: list[list[Cell | None]]) -> bool:
    return sum(any(isinstance(cell, float) or (cell and looks_like_number(cell)) for cell in row) for row in rows) > 1


def _rows(sheet: Any) -> list[list[Cell | None]]:
    """Return the rows of a sheet: numbers, texts, and None for an empty cell, without the empty ones at the end."""
    rows: list[list[Cell | None]] = []
    filled = 0
    for row in sheet.iter_rows(values_only=True, max_col=MAX_COLUMNS):
        cells = [_cell(value) for value in row]
        while cells and cells[-1] is None:
            cells.pop()
        rows.append(cells)
        filled = len(rows) if cells else filled
    return rows[:filled]


def _cell(value: Any) -> Cell | None:
    if value is None or isinstance(value, float):
        return value
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, int):
        return float(value)
    if isinstance(value, datetime.datetime | datetime.date | datetime.time):
        return value.isoformat()
    if isinstance(value, datetime.timedelta):
        return value.total_seconds()
    return str(value)


def _refuse_formulas(path: str | Path, sheet: Any, rows: list[list[Cell | None]]) -> None:
    """Refuse a formula whose value was not saved with it: the cell would seem to be empty."""
    from openpyxl.utils import get_column_letter  # noqa: PLC0415 - as above

    for number, row in enumerate(sheet.iter_rows(values_only=True, max_col=MAX_COLUMNS)):
        for column, value in enumerate(row):
            seen = number < len(rows) and column < len(rows[number])
            if isinstance(value, str) and value.startswith("=") and (not seen or rows[number][column] is None):
                where = f"{get_column_letter(column + 1)}{number + 1}"
                problem = f"cell {where} holds the formula {shown(value)} without a value"
                allowed = "the workbook saved again by a program that computes it, or the values alone"
                raise FileFormatError(f"{path} [{sheet.title}]", None, problem, allowed)
