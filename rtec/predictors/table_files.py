"""Tables of errors as files: CSV, and the compensation files of LinuxCNC.

The CSV has ``#`` comments, one header line and one row a position::

    # errors of the z axis, actual minus target
    position_inch,forward_um,reverse_um
    1.0,13.4,84.2
    2.0,15.1,86.0

A column is a quantity, ``_`` and a unit (mm, um or inch). Without a column ``reverse`` the table is uni-directional,
and a comment ``# backlash: 70 um`` says how far the reverse curve lies above the forward curve.
"""

from __future__ import annotations

import math
import re
from enum import Enum
from pathlib import Path

import numpy as np

from rtec.errors import ArgumentError, FileFormatError, nearest
from rtec.io import read_text, write_lines
from rtec.predictors._columns import LARGEST, Floats, first_disorder
from rtec.predictors.tables import BidirectionalTable, UnidirectionalTable
from rtec.units import LENGTH, UNITS, parse_quantity

LARGEST_FILE = 16_000_000
"""Largest file read, in bytes: several hundred thousand positions."""
QUANTITIES = ("position", "forward", "reverse")
"""The columns of a table: position, error forward, error in reverse."""
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_BACKLASH = re.compile(r"#\s*backlash\s*:\s*(.*)", re.IGNORECASE)


class LengthUnit(Enum):
    """Units of length in a table file; the value is the unit in millimetres."""

    MM = UNITS["mm"].factor
    UM = UNITS["um"].factor
    INCH = UNITS["inch"].factor


class CompensationKind(Enum):
    """What the second and third column of a LinuxCNC compensation file hold (``COMP_FILE_TYPE``)."""

    POSITIONS = 0
    """The positions reached, forward and reverse: the error is position minus nominal."""
    TRIMS = 1
    """Nominal minus the position reached: the error is the negative."""


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
            rows.append(_row(path, number, line.split(","), [name for name, _ in header]))
            lines.append(number)
    if not header:
        raise FileFormatError(path, None, "no header line", "a header such as position_mm,forward_um,reverse_um")
    columns = _columns(path, rows, lines, header)
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
    return BidirectionalTable.on_grid(columns["position"], columns["forward"], columns["reverse"])


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


def read_linuxcnc_table(
    path: str | Path, *, unit: LengthUnit, kind: CompensationKind = CompensationKind.POSITIONS
) -> BidirectionalTable:
    r"""Read a compensation file of LinuxCNC: nominal, forward, reverse on each line.

    Parameters
    ----------
    path
        The file: three numbers a line, separated by blanks, without comments.
    unit
        The machine's unit of length; the file does not say it.
    kind
        ``COMP_FILE_TYPE`` of the machine's INI file.

    Raises
    ------
    FileFormatError
        The file cannot be read, a line is no triple of numbers (LinuxCNC itself would silently stop there), or the
        nominal positions do not ascend.

    References
    ----------
    LinuxCNC, INI configuration, ``[JOINT_n]``: ``COMP_FILE`` and ``COMP_FILE_TYPE``.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "z.comp"
    ...     _ = path.write_text("0.0 0.0 -0.001\n10.0 10.002 9.999\n")
    ...     table = read_linuxcnc_table(path, unit=LengthUnit.MM)
    >>> table.error_mm(10.0, [+1, -1]).round(9)
    array([ 0.002, -0.001])
    """
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, line in enumerate(read_text(path, most_bytes=LARGEST_FILE).rstrip().splitlines(), start=1):
        rows.append(_row(path, number, line.split(), ["nominal", "forward", "reverse"]))
        lines.append(number)
    header = [(name, unit) for name in QUANTITIES]
    columns = _columns(path, rows, lines, header)
    nominal, forward, reverse = (columns[name] for name in QUANTITIES)
    if kind is CompensationKind.POSITIONS:
        return BidirectionalTable.on_grid(nominal, forward - nominal, reverse - nominal)
    return BidirectionalTable.on_grid(nominal, -forward, -reverse)


def _row(path: str | Path, number: int, cells: list[str], names: list[str]) -> list[float]:
    """Return the numbers of a line, one for each name."""
    if len(cells) != len(names):
        raise FileFormatError(path, number, f"a row of {len(cells)}", f"{len(names)} numbers: {', '.join(names)}")
    values = []
    for cell, name in zip(cells, names, strict=True):
        word = cell.strip()
        if not word:
            raise FileFormatError(path, number, f"{name} is missing", "a decimal number")
        if not _NUMBER.fullmatch(word) or not math.isfinite(value := float(word)):
            raise FileFormatError(path, number, f"{name}: {word[:40]!r}", "a finite decimal number")
        values.append(value)
    return values


def _columns(
    path: str | Path, rows: list[list[float]], lines: list[int], header: list[tuple[str, LengthUnit]]
) -> dict[str, Floats]:
    """Return each quantity in mm, after a check of size and order that names the line."""
    if len(rows) < 2:
        raise FileFormatError(path, None, f"a table of {len(rows)} positions", "at least two positions")
    table = np.array(rows) * np.array([unit.value for _, unit in header])
    bad = np.argwhere(~(np.abs(table) <= LARGEST))
    if bad.size:
        row, place = bad[0].tolist()
        raise FileFormatError(
            path, lines[row], f"{header[place][0]}: {rows[row][place]:g}", f"at most {LARGEST:g} mm either way"
        )
    columns = {name: table[:, place] for place, (name, _) in enumerate(header)}
    index = first_disorder(columns["position"])
    if index is not None:
        place = [name for name, _ in header].index("position")
        problem = f"position {rows[index][place]:.15g} after {rows[index - 1][place]:.15g}"
        raise FileFormatError(path, lines[index], problem, "strictly ascending positions, each once")
    return columns
