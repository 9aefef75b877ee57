"""Columns in memory as a table: a mapping of headings to values, or a data frame of any library."""

from __future__ import annotations

import datetime
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec.errors import ArgumentError
from rtec.metrology.tables.cells import Cell
from rtec.metrology.tables.table import MAX_COLUMNS, Table

SOURCE = "data"
"""What messages call it."""
_MOST_MISSING = 2_000_000
"""Cells of a table with text or gaps, each of which is looked at by itself."""


def is_frame(source: object) -> bool:
    """Return whether something is a mapping of columns, or a data frame.

    Examples
    --------
    >>> is_frame({"target_mm": [0.0]}), is_frame("z_axis.csv")
    (True, False)
    """
    return isinstance(source, Mapping) or (hasattr(source, "columns") and hasattr(source, "__getitem__"))


def table_of_columns(source: Any) -> Table:
    """Return a mapping of columns, or a data frame, as a table whose rows are counted from 1.

    Raises
    ------
    ArgumentError
        No columns, two of one name, or columns of another shape than (rows,).

    Examples
    --------
    >>> table_of_columns({"target_mm": [0.0, 5.0], "deviation_um": [1, 2]}).numbers.tolist()
    [[0.0, 1.0], [5.0, 2.0]]
    """
    named = [(str(name).strip(), _values(str(name), given)) for name, given in _columns(source)]
    names = [name for name, _ in named]
    if not names or len(names) > MAX_COLUMNS:
        raise ArgumentError(SOURCE, f"{len(names)} columns", f"1 to {MAX_COLUMNS} columns, by their headings")
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise ArgumentError(SOURCE, f"column {twice!r} twice", "each name once")
    sizes = {name: values.size for name, values in named}
    rows = next(iter(sizes.values()))
    if len(set(sizes.values())) > 1 or rows == 0:
        shown = ", ".join(f"{name}: {size}" for name, size in list(sizes.items())[:8])
        raise ArgumentError(SOURCE, f"rows of columns: {shown}", "columns of one length, with rows")
    plain = all(values.dtype.kind == "f" and np.isfinite(values).all() for _, values in named)
    numbers = np.column_stack([values for _, values in named]) if plain else None
    cells: list[list[Cell]] | None = None
    if not plain:
        if len(names) * rows > _MOST_MISSING:
            allowed = f"finite numbers, or at most {_MOST_MISSING} cells"
            raise ArgumentError(SOURCE, f"{len(names) * rows} cells with text or gaps among them", allowed)
        cells = [list(row) for row in zip(*(_cells(values) for _, values in named), strict=True)]
    return Table(
        source=SOURCE,
        facts={},
        headings=tuple(names),
        units=("",) * len(names),
        above=("",) * len(names),
        heading_line=0,
        rows=cells,
        lines=range(1, rows + 1),
        numbers=numbers,
    )


def _columns(source: Any) -> Iterable[tuple[object, Any]]:
    if isinstance(source, Mapping):
        return source.items()
    names = list(source.columns)
    if len(set(map(str, names))) < len(names):
        twice = next(str(name) for name in names if names.count(name) > 1)
        raise ArgumentError(SOURCE, f"column {twice!r} twice", "each name once")
    index: Any = getattr(source, "index", None)
    named = [] if getattr(index, "name", None) is None else [(index.name, index)]
    return [*named, *((name, source[name]) for name in names)]


def _values(name: str, given: Any) -> NDArray[Any]:
    """Return a column as numbers, shape (rows,), or as objects where one of them is none."""
    values = np.asarray(given)
    if values.ndim != 1:
        raise ArgumentError(SOURCE, f"column {name[:60]!r} of shape {values.shape}", "columns of shape (rows,)")
    if values.dtype.kind in "iufb":
        return values.astype(np.float64)
    if values.dtype.kind == "m":
        return values.astype("timedelta64[ns]").astype(np.float64) / 1e9
    if values.dtype.kind == "M":
        return np.array([str(one) for one in values.astype("datetime64[us]")], dtype=object)
    return values.astype(object)


def _cells(values: NDArray[Any]) -> list[Cell]:
    return [_cell(value) for value in values.tolist()]


def _cell(value: object) -> Cell:
    """Return a cell as a table of text has it; what is missing is empty."""
    if value is None or value != value or str(value) in ("NaT", "<NA>"):  # noqa: PLR0124 - a NaN is not itself
        return ""
    if isinstance(value, bool | np.bool_):
        return float(value)
    if isinstance(value, int | float | np.integer | np.floating):
        return float(value)
    if isinstance(value, datetime.datetime):
        return value.isoformat(sep=" ")
    return str(value)
