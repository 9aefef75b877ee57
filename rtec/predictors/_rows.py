"""Reading rows of numbers from text files, with errors that name file and line."""

from __future__ import annotations

import math
import re
from enum import Enum
from pathlib import Path

import numpy as np

from rtec.errors import FileFormatError
from rtec.predictors._columns import LARGEST, Floats, first_disorder
from rtec.predictors.tables import BidirectionalTable
from rtec.units import UNITS

LARGEST_FILE = 16_000_000
"""Largest file read, in bytes: several hundred thousand positions."""

QUANTITIES = ("position", "forward", "reverse")
"""The columns of a table: position, error forward, error in reverse."""

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)


class LengthUnit(Enum):
    """Units of length in a table file; the value is the unit in millimetres."""

    MM = UNITS["mm"].factor
    UM = UNITS["um"].factor
    INCH = UNITS["inch"].factor


def row_of(path: str | Path, number: int, cells: list[str], names: list[str]) -> list[float]:
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


def columns_of(
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


def bidirectional(positions: Floats, forward: Floats, reverse: Floats) -> BidirectionalTable:
    """Return the table of two errors at the same positions."""
    return BidirectionalTable(
        forward_positions_mm=positions,
        forward_errors_mm=forward,
        reverse_positions_mm=positions,
        reverse_errors_mm=reverse,
    )
