"""Tables of errors as CSV files.

The CSV has ``#`` comments, one header line and one row a position::

    # errors of the z axis, actual minus target
    position_inch,forward_um,reverse_um
    1.0,13.4,84.2
    2.0,15.1,86.0

A column is a quantity, ``_`` and a unit (mm, um or inch). Without a column ``reverse`` the table is uni-directional,
and a comment ``# backlash: 70 um`` says how far the reverse curve lies above the forward curve.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from rtec.errors import ArgumentError, FileFormatError, nearest
from rtec.io import read_text, write_lines
from rtec.predictors._columns import LARGEST
from rtec.predictors._rows import LARGEST_FILE, QUANTITIES, LengthUnit, bidirectional, columns_of, row_of
from rtec.predictors.tables import BidirectionalTable, UnidirectionalTable
from rtec.units import LENGTH, parse_quantity

_BACKLASH = re.compile(r"#\s*backlash\s*:\s*(.*)", re.IGNORECASE)


def read_table(path: str | Path) -> UnidirectionalTable | BidirectionalTable:
    """Read a table of errors from CSV.

    Parameters
    ----------
    path
        The file; its format stands at the top of this module.

    Returns
    -------
    UnidirectionalTable or BidirectionalTable
        Bi-directional where there is a column ``reverse``.

    Raises
    ------
    FileFormatError
        The file cannot be read, or a line does not hold what it should: the line is named.

    Examples
    --------
    >>> import tempfile
    >>> table = BidirectionalTable.sampled_from(
    ...     UnidirectionalTable(positions_mm=[0, 10], errors_mm=[0, 0.002], backlash_mm=0.003), [0, 5, 10])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_table(table, Path(folder) / "z.csv")
    ...     read_table(Path(folder) / "z.csv") == table
    True
    """
    header: list[tuple[str, LengthUnit]] = []
    rows: list[list[float]] = []
    lines: list[int] = []
    backlash_mm: float | None = None
    for number, line in enumerate(read_text(path, most_bytes=LARGEST_FILE).splitlines(), start=1):
        if line.lstrip().startswith("#"):
            if match := _BACKLASH.match(line.strip()):
                backlash_mm = _backlash(path, number, match[1], backlash_mm)
        elif not line.strip():
            continue
        elif not header:
            header = _header(path, number, line)
        else:
            rows.append(row_of(path, number, line.split(","), [name for name, _ in header]))
            lines.append(number)
    if not header:
        raise FileFormatError(path, None, "no header line", "a header such as position_mm,forward_um,reverse_um")
    columns = columns_of(path, rows, lines, header)
    if "reverse" not in columns:
        if backlash_mm is None:
            raise FileFormatError(
                path, None, "neither a column reverse_... nor a backlash", "a line such as '# backlash: 70 um'"
            )
        return UnidirectionalTable(
            positions_mm=columns["position"], errors_mm=columns["forward"], backlash_mm=backlash_mm
        )
    if backlash_mm is not None:
        raise FileFormatError(path, None, "a column reverse_... and a backlash", "one of them")
    return bidirectional(columns["position"], columns["forward"], columns["reverse"])


def write_table(
    table: UnidirectionalTable | BidirectionalTable, path: str | Path, *, unit: LengthUnit = LengthUnit.MM
) -> None:
    """Write a table as CSV that ``read_table`` reads; in mm it reads back to the same numbers.

    Parameters
    ----------
    table
        The table; a bi-directional one with the same positions in both directions.
    path
        The file, replaced where it exists; after an error it is as it was.
    unit
        Unit of all columns.

    Raises
    ------
    ArgumentError
        The two directions have different positions.
    OutputError
        The file could not be written.

    Examples
    --------
    See ``read_table``.
    """
    suffix = unit.name.lower()
    comments = ["# error of the axis, actual minus target"]
    if isinstance(table, UnidirectionalTable):
        comments.append(f"# backlash: {table.backlash_mm!r} mm")
        header = f"position_{suffix},forward_{suffix}"
        columns = [table.positions_mm, table.errors_mm]
    else:
        if not np.array_equal(table.forward_positions_mm, table.reverse_positions_mm):
            raise ArgumentError(
                "table", "different positions in the two directions", "the same", "sample it with sampled_from first"
            )
        header = f"position_{suffix},forward_{suffix},reverse_{suffix}"
        columns = [table.forward_positions_mm, table.forward_errors_mm, table.reverse_errors_mm]
    rows = (",".join(map(repr, row)) for row in (np.column_stack(columns) / unit.value).tolist())
    write_lines(path, [*comments, header, *rows])


def _header(path: str | Path, number: int, line: str) -> list[tuple[str, LengthUnit]]:
    units = {unit.name.lower(): unit for unit in LengthUnit}
    known = [f"{quantity}_{unit}" for quantity in QUANTITIES for unit in units]
    found: list[tuple[str, LengthUnit]] = []
    for cell in line.split(","):
        word = cell.strip()
        if word not in known:
            raise FileFormatError(path, number, f"unknown column {word[:40]!r}", nearest(word[:40], known))
        quantity, unit = word.split("_")
        if any(quantity == other for other, _ in found):
            raise FileFormatError(path, number, f"two columns {quantity!r}", "one column of each quantity")
        found.append((quantity, units[unit]))
    for quantity in QUANTITIES[:2]:
        if all(quantity != other for other, _ in found):
            raise FileFormatError(path, number, f"no column {quantity}_...", "position, forward and reverse")
    return found


def _backlash(path: str | Path, number: int, text: str, known_mm: float | None) -> float:
    if known_mm is not None:
        raise FileFormatError(path, number, "a second backlash", "one line '# backlash: ...'")
    try:
        value_mm = parse_quantity(text, LENGTH, name="backlash")
    except ArgumentError as error:
        raise FileFormatError(path, number, f"backlash: {error.value}", error.allowed) from None
    if not abs(value_mm) <= LARGEST:
        raise FileFormatError(path, number, f"backlash: {value_mm:g} mm", f"at most {LARGEST:g} mm either way")
    return value_mm
