"""A sheet of a workbook (.xlsx) as a table; of its formulas only the values that were saved with them."""

from __future__ import annotations

import datetime
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rtec.errors import ArgumentError, FileFormatError, nearest
from rtec.metrology.tables.cells import Cell, looks_like_number
from rtec.metrology.tables.layout import MAX_COLUMNS, Table, table_of_grid
from rtec.metrology.text_file import MAX_BYTES, shown

_ZIP, _OLE = b"PK\x03\x04", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
_MOST_ENTRIES = 10_000
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


def table_of_workbook(path: str | Path, sheet: str | None) -> Table:
    """Return the table in a sheet of a workbook.

    Parameters
    ----------
    path
        The .xlsx file.
    sheet
        Its sheet; None where only one of them holds a table.

    Raises
    ------
    FileFormatError
        No workbook, one with a password or too large, several sheets with a table, a formula without a value.
    ArgumentError
        There is no such sheet.
    """
    _check(path)
    openpyxl = _openpyxl(path)
    try:
        book = openpyxl.load_workbook(path, read_only=True, data_only=True, keep_links=False)
    except Exception as error:  # of a damaged archive the library raises whatever its parts raise
        reason = f"this workbook cannot be read ({type(error).__name__})"
        raise FileFormatError(path, None, reason, _SAVE_AS) from None
    try:
        name, rows = _chosen(path, book, sheet)
        _refuse_formulas(path, openpyxl, name, rows)
        return table_of_grid(f"{path} [{name}]", rows)
    finally:
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
    if size > MAX_BYTES or len(entries) > _MOST_ENTRIES:
        problem = f"{size} bytes in {len(entries)} parts, once unpacked"
        raise FileFormatError(path, None, problem, f"at most {MAX_BYTES} bytes in {_MOST_ENTRIES} parts")


def _openpyxl(path: str | Path) -> Any:
    try:
        import openpyxl  # noqa: PLC0415 - optional, and slow to load
    except ImportError:
        allowed = "the library openpyxl beside rtec: python -m pip install 'rtec[xlsx]'; or a sheet saved as CSV"
        raise FileFormatError(path, None, "workbooks need a library that is not installed", allowed) from None
    return openpyxl


def _chosen(path: str | Path, book: Any, sheet: str | None) -> tuple[str, list[list[Cell | None]]]:
    """Return the name and the rows of the sheet that is asked for, or of the only one with numbers in it."""
    sheets = {each.title: each for each in book.worksheets}
    if sheet is not None:
        found = next((title for title in sheets if title.lower() == sheet.strip().lower()), None)
        if found is None:
            raise ArgumentError("--sheet", repr(sheet[:60]), _listed(sheets), nearest(sheet, sheets))
        return found, _rows(path, sheets[found])
    shown_sheets = {title: each for title, each in sheets.items() if each.sheet_state == "visible"}
    tables = {title: rows for title, each in shown_sheets.items() if _has_table(rows := _rows(path, each))}
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


def _rows(path: str | Path, sheet: Any) -> list[list[Cell | None]]:
    return [list(row) for row in _cells(path, sheet)]


def _cells(path: str | Path, sheet: Any) -> Iterator[list[Cell | None]]:
    """Yield the rows of a sheet: numbers, texts, and None for an empty cell; empty rows at the end are left out."""
    empty = 0
    try:
        for row in sheet.iter_rows(values_only=True, max_col=MAX_COLUMNS):
            cells = [_cell(value) for value in row]
            while cells and cells[-1] is None:
                cells.pop()
            if not cells:
                empty += 1
                continue
            yield from ([] for _ in range(empty))
            empty = 0
            yield cells
    except FileFormatError:
        raise
    except Exception as error:  # as where the workbook is opened
        problem = f"sheet {shown(sheet.title)} cannot be read ({type(error).__name__})"
        raise FileFormatError(path, None, problem, _SAVE_AS) from None


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


def _refuse_formulas(path: str | Path, openpyxl: Any, name: str, rows: list[list[Cell | None]]) -> None:
    """Refuse a formula whose value was not saved with it: the cell would seem to be empty."""
    width = max(map(len, rows), default=0)
    if all(len(row) == width and None not in row for row in rows):
        return
    book = openpyxl.load_workbook(path, read_only=True, data_only=False, keep_links=False)
    try:
        for number, row in enumerate(book[name].iter_rows(values_only=True, max_col=MAX_COLUMNS)):
            for column, value in enumerate(row):
                formula = isinstance(value, str) and value.startswith("=")
                seen = number < len(rows) and column < len(rows[number])
                if formula and (not seen or rows[number][column] is None):
                    where = f"{openpyxl.utils.get_column_letter(column + 1)}{number + 1}"
                    problem = f"cell {where} holds the formula {shown(str(value))} without a value"
                    allowed = "the workbook saved again by a program that computes it, or the values alone"
                    raise FileFormatError(f"{path} [{name}]", None, problem, allowed)
    finally:
        book.close()
