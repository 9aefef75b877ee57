"""A measurement in a notebook: read from a file, a data frame or a mapping of columns."""

from __future__ import annotations

import html
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.dataset.load import load_dataset
from rtec.effects import LIBRARY, Library
from rtec.errors import ArgumentError, unknown
from rtec.metrology import Measurement, column_choices, measurement_of_columns, read_measurement
from rtec.metrology.tables.frame import is_frame

Source: TypeAlias = Any
"""A path, a data frame of any library, or a mapping of headings to arrays of shape (rows,)."""
_FACTS = ("screw_pitch", "scale_signal_period", "counts_per_rev", "reference_temperature")


class Data:
    """A measurement; `read` makes it.

    Columns are those of the file, in the units inside (mm, deg, s, degC, N, A): ``data["target"]``.
    """

    def __init__(self, measurement: Measurement, facts: Mapping[str, str], observe: str | None) -> None:
        self.measurement = measurement
        self.facts, self.observe = dict(facts), observe

    def __len__(self) -> int:
        return self.measurement.rows

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return a column by its quantity or heading, shape (rows,)."""
        known: dict[str, Any] = {key: column.values for key, column in self.measurement.columns.items()}
        known |= self.measurement.unknown
        if name not in known:
            raise unknown("column", str(name)[:60], known)
        return np.asarray(known[name])

    @property
    def columns(self) -> tuple[str, ...]:
        """Headings: known quantities with their units inside, then the others."""
        return (*(column.heading for column in self.measurement.columns.values()), *self.measurement.unknown)

    def dataset(
        self, library: Library = LIBRARY, *, observe: str | None = None, like: Dataset | None = None
    ) -> Dataset:
        """Return it ready to be explained by the effects of a library."""
        wanted = observe if observe is not None or like is not None else self.observe
        return load_dataset(self.measurement, observe=wanted, like=like, facts=self.facts, library=library)

    def __repr__(self) -> str:
        """Return source, size and columns in a line."""
        return f"<rtec.Data {Path(self.measurement.source).name}: {len(self)} readings; {', '.join(self.columns)}>"

    def _repr_html_(self) -> str:
        rows = []
        for heading, values in zip(self.columns, self._values(), strict=True):
            ends = [f"{values.min():.6g}", f"{values.max():.6g}"] if values.dtype.kind == "f" else ["text", ""]
            rows.append("".join(f"<td>{html.escape(cell)}</td>" for cell in [heading, *ends]))
        head = f"<b>{html.escape(Path(self.measurement.source).name)}</b>: {len(self)} readings"
        body = "".join(f"<tr>{row}</tr>" for row in rows)
        return f"{head}<table><tr><th>column</th><th>from</th><th>to</th></tr>{body}</table>"

    def _values(self) -> list[NDArray[Any]]:
        known = [column.values for column in self.measurement.columns.values()]
        return [*known, *map(np.asarray, self.measurement.unknown.values())]


def read(
    source: Source,
    *,
    observe: str | None = None,
    columns: Mapping[str, str] | None = None,
    sheet: str | None = None,
    table: int | None = None,
    decimal: str | None = None,
    axis: str | None = None,
    **facts: str,
) -> Data:
    """Read a measurement.

    Parameters
    ----------
    source
        A path, a data frame (pandas, polars, ...), or a mapping of headings to arrays: ``{"target_mm": x,
        "deviation_um": y}``. A row in which a value is missing is left out, which is said.
    observe
        What is to be explained; ``deviation`` where it is known, else the one column of force, current, ...
    columns
        What a column is, where its heading does not say it: ``{"nominal": "target_mm", "note": "ignore"}``.
    sheet, table, decimal, axis
        As the options of `rtec diagnose`.
    facts
        ``screw_pitch="5 mm"``, ``scale_signal_period``, ``counts_per_rev``, ``reference_temperature``.

    Raises
    ------
    ArgumentError, FileFormatError
        A file or columns that are no measurement, or an option that is wrong.

    Examples
    --------
    >>> read({"target_mm": [0.0, 5.0, 9.0], "deviation_um": [1.0, 2.0, 4.0]})
    <rtec.Data data: 3 readings; target_mm, deviation_mm>
    """
    for name, said in facts.items():
        if name not in _FACTS:
            raise unknown("read", name, _FACTS, noun="fact of the axis")
        if not isinstance(said, str):
            raise ArgumentError(name, repr(said)[:60], "a text with its unit, such as '5 mm'")
    maps = [f"{heading}={meaning}" for heading, meaning in (columns or {}).items()]
    choices = column_choices(maps, sheet=sheet, table=table, decimal=decimal, axis=axis)
    if isinstance(source, str | Path):
        measurement = read_measurement(source, choices)
    elif is_frame(source):
        measurement = measurement_of_columns(source, choices)
    else:
        allowed = "a path, a data frame, or a mapping of headings to arrays"
        raise ArgumentError("source", repr(type(source).__name__), allowed)
    return Data(measurement, facts, observe)


def data_of(given: Data | Source) -> Data:
    """Return what was read, reading it where that was not done yet."""
    return given if isinstance(given, Data) else read(given)
