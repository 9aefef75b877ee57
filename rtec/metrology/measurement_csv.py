"""Measurement files (CSV): facts in ``# key: value`` lines, one header line, rows of numbers.

Everything is turned into the units of the inside when it is read: mm, s, mm/s, degC, N, A, V, Nm, degrees for angles;
revolutions and counts stay what they are. Numbers are read in one sweep; only where that fails are the rows looked at
one by one, to say which is wrong, or to read dates and times of day.
"""

from __future__ import annotations

import csv
import datetime
import math
import re
from collections.abc import Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from rtec.errors import FileFormatError
from rtec.metrology.columns import ColumnUnit, quantity_of_heading, units_lacking
from rtec.metrology.measurement import Column, Measurement
from rtec.metrology.readings import Floats
from rtec.metrology.text_file import plain_numbers, read_text, shown, write_lines

_MAX_COLUMNS = 1000
_FACT = re.compile(r"#\s*(?P<key>[^:]{1,80}?)\s*:\s*(?P<value>.*)")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_DATE = re.compile(r"[0-9]{4}-?[0-9]{2}-?[0-9]{2}[T ][0-9:]{2,8}.{0,20}", re.ASCII)
_DATED = "time", ColumnUnit("s", 1.0)
"""What a column ``time`` without a unit holds: dates with times of day (ISO 8601), in s since the first."""


def read_measurement(path: str | Path) -> Measurement:
    r"""Read a measurement file.

    Parameters
    ----------
    path
        The CSV file.

    Raises
    ------
    FileFormatError
        With the line: a number that is not finite or no number, a row of another length, a heading twice or two for
        the same quantity, a quantity without unit (but a time of dates), no header, no rows, binary data.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "x.csv"
    >>> _ = file.write_text("# screw_pitch: 0.25 inch\ntarget_inch,deviation_um,pulse_v\n1,2,0\n2,3,0\n")
    >>> m = read_measurement(file)
    >>> m.columns["target"].values.tolist(), list(m.unknown), m.facts["screw_pitch"]
    ([25.4, 50.8], ['pulse_v'], '0.25 inch')
    """
    lines = read_text(path).split("\n")
    facts, header = _read_facts(path, lines)
    headings = _split_header(path, header + 1, lines[header])
    body = lines[header + 1 :]
    known = _known_columns(path, header + 1, headings, _dated(headings, body))
    numbers = plain_numbers(body, len(headings), ",")
    if numbers is not None:
        table: list[NDArray[np.float64] | NDArray[np.str_]] = [column.copy() for column in numbers.T]
    else:
        table = _read_slowly(path, header + 2, body, headings, known)
    numbered = _numbered(body, header + 2)
    columns: dict[str, Column] = {}
    unknown: dict[str, NDArray[np.float64] | NDArray[np.str_]] = {}
    for heading, what, values in zip(headings, known, table, strict=True):
        if what is None:
            unknown[heading] = values
            continue
        quantity, unit = what
        raw = np.asarray(values, dtype=np.float64)
        if (outside := _outside_range(quantity, unit, raw)) is not None:
            row, allowed = outside
            raise FileFormatError(path, numbered[row], f"{heading} {raw[row]:g} is not allowed", allowed)
        columns[quantity] = Column(quantity, unit.inside, (raw + unit.offset) * unit.factor)
    return Measurement(
        source=str(path), facts=MappingProxyType(facts), columns=columns, unknown=unknown, lines=numbered
    )


def _numbered(body: list[str], first_line: int) -> Sequence[int]:
    """Return the line number of each row: a mere range, unless there are empty lines between the rows."""
    last = len(body)
    while last and not body[last - 1].strip():
        last -= 1
    if all(body[:last]) and not any(text.isspace() for text in body[:last]):
        return range(first_line, first_line + last)
    return [line for line, text in enumerate(body, first_line) if text.strip()]


def _read_facts(path: str | Path, lines: list[str]) -> tuple[dict[str, str], int]:
    """Return the facts and the index of the header line."""
    facts: dict[str, str] = {}
    for index, line in enumerate(lines):
        text = line.strip()
        if text.startswith("#"):
            if (match := _FACT.match(text)) is not None:
                key = match["key"].lower()
                facts[key] = f"{facts[key]}\n{match['value']}" if key in facts else match["value"]
        elif text:
            return facts, index
    raise FileFormatError(
        path, None, "no header line after the '#' lines", "a header line such as target_mm,actual_mm"
    )


def _fields(path: str | Path, line: int, text: str) -> list[str]:
    try:
        return next(csv.reader([text], strict=True))
    except csv.Error as error:
        raise FileFormatError(path, line, f"no row of a CSV file ({error})", "fields separated by commas") from None


def _split_header(path: str | Path, line: int, text: str) -> list[str]:
    headings = [field.strip() for field in _fields(path, line, text)]
    if len(headings) > _MAX_COLUMNS:
        raise FileFormatError(path, line, f"{len(headings)} columns", f"at most {_MAX_COLUMNS}")
    if any(_NUMBER.fullmatch(heading) for heading in headings):
        problem = f"no header line: {shown(text)} holds numbers"
        raise FileFormatError(path, line, problem, "a header line such as target_mm,actual_mm")
    if "" in headings:
        raise FileFormatError(
            path, line, f"column {headings.index('') + 1} has no heading", "a heading in every column"
        )
    return headings


def _dated(headings: list[str], body: list[str]) -> str | None:
    """Return the heading ``time`` where a date stands below it, else None."""
    column = next((k for k, heading in enumerate(headings) if heading.lower() == "time"), None)
    first = next((text for text in body if text.strip()), "")
    fields = first.split(",")
    if column is None or column >= len(fields) or _DATE.fullmatch(fields[column].strip(' "')) is None:
        return None
    return headings[column]


def _known_columns(
    path: str | Path, line: int, headings: list[str], dated: str | None
) -> list[tuple[str, ColumnUnit] | None]:
    """Return what each heading names, refusing two for the same."""
    seen: dict[str, str] = {}
    known = []
    for heading in headings:
        what = _DATED if heading == dated else quantity_of_heading(heading)
        if what is None and (meant := units_lacking(heading)) is not None:
            raise FileFormatError(path, line, f"column {shown(heading)} has no unit", meant)
        key = heading.lower() if what is None else what[0]
        if key in seen:
            problem = f"columns {shown(seen[key])} and {shown(heading)} both hold {shown(key)}"
            raise FileFormatError(path, line, problem, "one column for each quantity")
        seen[key] = heading
        known.append(what)
    return known


def _read_slowly(
    path: str | Path,
    first_line: int,
    body: list[str],
    headings: list[str],
    known: list[tuple[str, ColumnUnit] | None],
) -> list[NDArray[np.float64] | NDArray[np.str_]]:
    """Read row by row: text in unknown columns is kept, anything else wrong is named with its line."""
    rows: list[list[str]] = []
    for line, text in enumerate(body, first_line):
        if not text.strip():
            continue
        fields = [field.strip() for field in _fields(path, line, text)]
        if len(fields) != len(headings):
            raise FileFormatError(
                path, line, f"{len(fields)} fields", f"{len(headings)}, one for each heading; the file may be cut off"
            )
        for heading, what, field in zip(headings, known, fields, strict=True):
            if what is _DATED:
                _check_date(path, line, heading, field, rows[0][headings.index(heading)] if rows else field)
            elif what is not None:
                _check_number(path, line, heading, field)
            elif field.lower().lstrip("+-") in ("nan", "inf", "infinity") or _overflows(field):
                raise FileFormatError(
                    path, line, f"{heading} {shown(field)} is not finite", "a finite number, or text"
                )
        rows.append(fields)
    if not rows:
        raise FileFormatError(path, first_line - 1, "no row follows the header", "one row for each reading")
    table: list[NDArray[np.float64] | NDArray[np.str_]] = []
    for what, column in zip(known, zip(*rows, strict=True), strict=True):
        if what is _DATED:
            table.append(_seconds(column))
            continue
        numeric = all(_NUMBER.fullmatch(field) for field in column)
        table.append(np.array([float(field) for field in column]) if numeric else np.array(column, dtype=np.str_))
    return table


def _seconds(dates: Sequence[str]) -> Floats:
    """Return seconds since the first of several dates."""
    moments = [datetime.datetime.fromisoformat(text) for text in dates]
    return np.array([(moment - moments[0]).total_seconds() for moment in moments])


def _check_date(path: str | Path, line: int, heading: str, field: str, first: str) -> None:
    """Refuse what is no date with a time of day, and a zone that only some of them state."""
    allowed = "a date with a time of day, such as 2026-11-22T14:05:09.250Z"
    try:
        zones = {datetime.datetime.fromisoformat(text).tzinfo is None for text in (field[:60], first[:60])}
    except ValueError:
        raise FileFormatError(path, line, f"{heading} {shown(field)} is no date", allowed) from None
    if len(zones) > 1:
        problem = f"{heading} {shown(field)} and {shown(first)}: only one of them states its time zone"
        raise FileFormatError(path, line, problem, "the time zone in every row, or in none")


def _overflows(field: str) -> bool:
    return _NUMBER.fullmatch(field) is not None and not math.isfinite(float(field))


def _check_number(path: str | Path, line: int, heading: str, field: str) -> None:
    if len(field) > 400 or _NUMBER.fullmatch(field) is None or not math.isfinite(float(field)):
        what = f"{heading} is empty" if not field else f"{heading} {shown(field)} is not a finite number"
        raise FileFormatError(path, line, what, "a decimal number, such as -20.01852 or 1e-3")


def _outside_range(quantity: str, unit: ColumnUnit, raw: Floats) -> tuple[int, str] | None:
    """Return the first row that the meaning of the quantity does not allow, and what it allows."""
    if quantity == "direction":
        good, allowed = np.abs(raw) == 1, "+1 or -1"
    elif quantity == "run":
        good, allowed = (raw == np.round(raw)) & (np.abs(raw) < 2**31), "a whole number"
    else:
        with np.errstate(over="ignore"):
            good, allowed = (
                np.isfinite((raw + unit.offset) * unit.factor),
                "a number that stays finite in " + unit.inside,
            )
    return None if good.all() else (int(np.flatnonzero(~good)[0]), allowed)


def write_measurement(path: str | Path, measurement: Measurement) -> None:
    """Write a measurement; it reads back to the same numbers.

    Parameters
    ----------
    path
        The CSV file, replaced where it exists.
    measurement
        Written in the units of the inside, the known columns first.

    Raises
    ------
    OutputError
        The file cannot be written.

    Examples
    --------
    >>> import tempfile
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


def _written(values: NDArray[np.float64] | NDArray[np.str_]) -> list[str]:
    if values.dtype.kind == "U":
        return [_quoted(str(value)) for value in values]
    return [str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value) for value in values.tolist()]
