"""The measurement file (CSV) that rtec writes: facts in ``# key: value`` lines, one header line, rows of numbers."""

from __future__ import annotations

from pathlib import Path

from rtec.io import write_lines
from rtec.metrology.measurement import Cells, Measurement


def write_measurement(path: str | Path, measurement: Measurement) -> None:
    """Write a measurement in the internal units, the known columns first; it reads back to the same numbers.

    Raises
    ------
    OutputError
        The file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from rtec.metrology import Column
    >>> file = Path(tempfile.mkdtemp()) / "x.csv"
    >>> write_measurement(file, Measurement(source="", facts={"axis": "z"}, unknown={}, columns={
    ...     "target": Column("target", "mm", np.array([25.4]))}))
    >>> print(file.read_text().strip())
    # axis: z
    target_mm
    25.4
    """
    facts = [f"# {key}: {line}" for key, value in measurement.facts.items() for line in value.split("\n")]
    header = [column.heading for column in measurement.columns.values()] + [
        _quoted(name) for name in measurement.unknown
    ]
    columns = [_written(column.values) for column in measurement.columns.values()]
    columns += [_written(values) for values in measurement.unknown.values()]
    write_lines(path, [*facts, ",".join(header), *(",".join(row) for row in zip(*columns, strict=True))])


def _quoted(text: str) -> str:
    return '"' + text.replace('"', '""') + '"' if any(sign in text for sign in '",') else text


def _written(values: Cells) -> list[str]:
    if values.dtype.kind == "U":
        return [_quoted(str(value)) for value in values]
    return [str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value) for value in values.tolist()]
