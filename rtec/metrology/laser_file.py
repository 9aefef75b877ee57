"""The data file of the laser system: seven columns in inch, degrees Fahrenheit and inches of mercury.

======================================  =========================================================
column                                  meaning
======================================  =========================================================
Position                                target, inch, in machine coordinates
LasRead                                 the laser's reading since it was zeroed, inch; it falls as the axis advances
LinearError                             actual minus target, inch: -LasRead - (Position - position of the zero)
Status                                  0 in every printed row; the thesis does not say what other numbers mean
AirTemp, AirPress, MatTemp              degF, inHg, degF
======================================  =========================================================

The file names neither run nor direction. A pass goes through the targets one way; the target at which the axis turns
is read twice in a row, once from each side (thesis, Appendix B), and so a pass ends there.

References
----------
Thesis, section 2.3, Table 2-3; section 4.2, Figure 4.4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rtec.errors import ArgumentError, FileFormatError
from rtec.io import write_lines
from rtec.metrology.plain_numbers import PLAIN_NUMBER, plain_numbers, shown
from rtec.metrology.readings import Floats, Integers, Readings
from rtec.units import MM_PER_INCH

COLUMNS = ("Position", "LasRead", "LinearError", "Status", "AirTemp", "AirPress", "MatTemp")
"""Headings of the columns, as printed."""

KPA_PER_INHG = 3.386389
"""Kilopascals in one inch of mercury at 0 degC (BIPM and NIST SP 811 give 3.386 389)."""

_HEADER = "".join(COLUMNS).lower()
_MAX_PREFACE_LINES = 200
_AGREE_INCH = 1.5e-5
"""How far the three length columns may disagree: half of the last digit of each, doubled."""
_REFERENCE_DEGF = 68.0
_REFERENCE_INHG = 29.92


@dataclass(frozen=True, slots=True)
class _Pass:
    """One way through the targets: rows first..last-1, its direction and its repeat number."""

    first: int
    last: int
    direction: int
    run: int


def is_laser_file(text: str) -> bool:
    r"""Return True where the text holds the header of a laser file.

    Examples
    --------
    >>> is_laser_file("Position LasRead LinearError Status AirTempAirPress\n MatTemp\n 1.0 0 0 0 70 29 71")
    True
    >>> is_laser_file("target_mm,actual_mm")
    False
    """
    return _find_header(text.split("\n", _MAX_PREFACE_LINES + 2)) is not None


def _find_header(lines: list[str]) -> int | None:
    """Return the index of the line after the header, which may be wrapped and its words run together."""
    for start, line in enumerate(lines[:_MAX_PREFACE_LINES]):
        if not line.lstrip()[:8].lower().startswith("position"):
            continue
        words = ""
        for after in range(start, min(start + len(COLUMNS), len(lines))):
            words += "".join(lines[after][:400].split()).lower()
            if words == _HEADER:
                return after + 1
    return None


def readings_of_text(path: str | Path, text: str) -> Readings:
    r"""Return the readings in the text of a data file of the laser system.

    Text before the header is passed over; the header may be wrapped over lines, or its words run together.

    Returns
    -------
    Readings
        In mm, degC and kPa, with run and direction deduced from the order of the positions.

    Raises
    ------
    FileFormatError
        No header, a row that is not seven finite numbers, length columns that contradict each other, a file cut off
        in the middle of a line or of a pass.

    Notes
    -----
    A file that ends after a whole pass of a single direction cannot be told from a unidirectional test.

    Examples
    --------
    >>> r = readings_of_text("z.dat", "Position LasRead LinearError Status AirTempAirPress\n MatTemp\n"
    ...                               "  1.00000  0.000010 -0.000010 0 70.37 29.25 71.49\n"
    ...                               "  2.00000 -0.999691 -0.000309 0 70.36 29.25 71.49\n")
    >>> (r.deviation_mm * 1e3).round(3).tolist(), r.direction.tolist(), r.run.tolist()
    ([-0.254, -7.849], [1, 1], [1, 1])
    """
    lines = text.split("\n")
    start = _find_header(lines)
    if start is None:
        raise FileFormatError(
            path, None, f"no header of a laser file in the first {_MAX_PREFACE_LINES} lines", " ".join(COLUMNS)
        )
    numbers = [index for index in range(start, len(lines)) if lines[index].strip()]
    if not numbers:
        raise FileFormatError(path, start, "no reading follows the header", "at least two rows")
    _refuse_cut_line(path, lines, numbers)
    rows = plain_numbers(lines[start:], len(COLUMNS), None)
    if rows is None or not _is_status(rows[:, 3]).all():
        rows = np.array([_row(path, index + 1, lines[index]) for index in numbers])
    line_of_row = np.array(numbers, dtype=np.int64) + 1
    position = rows[:, 0]
    _refuse_contradiction(path, rows, line_of_row)
    passes = _split_passes(path, position, line_of_row)
    _refuse_cut_pass(path, position, passes, line_of_row)
    lengths = [one.last - one.first for one in passes]
    return Readings(
        target_mm=position * MM_PER_INCH,
        deviation_mm=rows[:, 2] * MM_PER_INCH,
        direction=np.repeat(np.array([one.direction for one in passes], dtype=np.int8), lengths),
        run=np.repeat(np.array([one.run for one in passes], dtype=np.int64), lengths),
        status=rows[:, 3].astype(np.int64),
        air_temperature_degc=(rows[:, 4] - 32.0) / 1.8,
        air_pressure_kpa=rows[:, 5] * KPA_PER_INHG,
        material_temperature_degc=(rows[:, 6] - 32.0) / 1.8,
    )


def _is_status(value: float | Floats) -> Any:
    return (np.round(value) == value) & (np.abs(value) < 2**31)


def _row(path: str | Path, line: int, text: str) -> list[float]:
    fields = text.split()
    if len(fields) != len(COLUMNS):
        raise FileFormatError(
            path, line, f"{len(fields)} columns", f"{len(COLUMNS)} numbers ({' '.join(COLUMNS)}), the readings only"
        )
    values = []
    for name, field in zip(COLUMNS, fields, strict=True):
        if len(field) > 60 or PLAIN_NUMBER.fullmatch(field) is None or not math.isfinite(float(field)):
            raise FileFormatError(path, line, f"{name} {shown(field)} is not a finite number", "a decimal number")
        values.append(float(field))
    if not _is_status(values[3]):
        raise FileFormatError(path, line, f"Status {shown(fields[3])} is not a whole number", "a whole number")
    return values


def _refuse_cut_line(path: str | Path, lines: list[str], numbers: list[int]) -> None:
    """Refuse a last line that lacks columns, or its line end and the last digits of MatTemp."""
    last = numbers[-1]
    fields = lines[last].split()
    before = lines[numbers[-2]].split() if len(numbers) > 1 else fields
    unended = last == len(lines) - 1
    short = unended and bool(before) and bool(fields) and _decimals(fields[-1]) < _decimals(before[-1])
    if len(fields) < len(COLUMNS) or short:
        problem = "the file is cut off in the middle of this line"
        raise FileFormatError(path, last + 1, problem, f"{len(COLUMNS)} complete columns; copy the file again")


def _decimals(field: str) -> int:
    return len(field.partition(".")[2])


def _refuse_contradiction(path: str | Path, rows: Floats, line_of_row: Integers) -> None:
    """Refuse a row whose LasRead, LinearError and Position do not belong together."""
    zero = rows[:, 0] + rows[:, 1] + rows[:, 2]
    away = np.abs(zero - np.median(zero))
    if (bad := np.flatnonzero(away > _AGREE_INCH)).size:
        row = bad[0]
        problem = f"LasRead, LinearError and Position disagree by {away[row]:.6f} inch"
        allowed = "LinearError = -LasRead - (Position - position of the laser's zero)"
        raise FileFormatError(path, int(line_of_row[row]), problem, allowed)


def _split_passes(path: str | Path, position: Floats, line_of_row: Integers) -> list[_Pass]:
    """Split the rows where the axis turns: a target met twice in a row, or a step the other way."""
    steps = np.sign(np.diff(position)).astype(np.int64)
    if not steps.any():
        raise FileFormatError(
            path, int(line_of_row[0]), "the position never changes", "at least two targets in a row"
        )
    passes: list[_Pass] = []
    runs = {1: 0, -1: 0}
    first = 0
    while first < position.size:
        last = first + 1
        if last < position.size and steps[first] != 0:
            direction = int(steps[first])
            while last < position.size and steps[last - 1] == direction:
                last += 1
        else:
            # a single reading: after a turn it is approached from the other side, after a jump back as before
            turned = first > 0 and steps[first - 1] == 0
            direction = -passes[-1].direction if turned else passes[-1].direction if passes else 1
        runs[direction] += 1
        passes.append(_Pass(first, last, direction, runs[direction]))
        first = last
    return passes


def _refuse_cut_pass(path: str | Path, position: Floats, passes: list[_Pass], line_of_row: Integers) -> None:
    """Refuse passes that do not all meet the same targets, and a last run without its second direction."""
    targets = np.unique(position)
    for one in passes:
        lacking = np.setdiff1d(targets, position[one.first : one.last])
        if lacking.size:
            way = "forward" if one.direction > 0 else "reverse"
            problem = (
                f"the {way} pass of run {one.run} ends here and lacks {lacking.size} of {targets.size} targets "
                f"(first: {lacking[0] if one.direction > 0 else lacking[-1]:.5f} inch)"
            )
            raise FileFormatError(path, int(line_of_row[one.last - 1]), problem, "every target in every pass")
    forward = sum(one.direction > 0 for one in passes)
    backward = len(passes) - forward
    if backward and forward and forward != backward:
        run = max(forward, backward)
        way = "reverse" if backward < forward else "forward"
        problem = f"the file ends before the {way} pass of run {run}"
        raise FileFormatError(path, int(line_of_row[-1]), problem, "both directions in every run")


def write_laser_file(path: str | Path, readings: Readings) -> None:
    """Write readings as the laser system does, one row each in the order given.

    Parameters
    ----------
    path
        The file, replaced where it exists.
    readings
        Readings in the order in which they were taken; run and direction are not written, they follow from the order.
        The laser is zeroed at the first target. Surroundings that were not recorded are written as the reference
        conditions, 68.00 degF (20 degC, ISO 1) and 29.92 inHg.

    Raises
    ------
    ArgumentError
        A number too wide for its column.
    OutputError
        The file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "z.dat"
    >>> r = Readings(target_mm=[25.4, 50.8], deviation_mm=[0, 0.0254], direction=[1, 1], run=[1, 1])
    >>> write_laser_file(file, r)
    >>> print(file.read_text().splitlines()[2])
         2.00000     -1.001000      0.001000      0 68.00 29.92    68.00
    """
    position = np.round(readings.target_mm / MM_PER_INCH, 5) + 0.0
    error = np.round(readings.deviation_mm / MM_PER_INCH, 6) + 0.0
    laser = np.round(-(error + position - position[0]), 6) + 0.0
    if max(np.abs(position).max(), np.abs(laser).max(), np.abs(error).max()) >= 10_000:
        raise ArgumentError("readings", "a length of 10000 inch or more", "lengths that fit the columns of the file")
    status = np.zeros(readings.size, np.int64) if readings.status is None else readings.status
    columns = [
        position,
        laser,
        error,
        status,
        _degf(readings.air_temperature_degc, readings.size),
        np.full(readings.size, _REFERENCE_INHG)
        if readings.air_pressure_kpa is None
        else readings.air_pressure_kpa / KPA_PER_INHG,
        _degf(readings.material_temperature_degc, readings.size),
    ]
    rows = zip(*(column.tolist() for column in columns), strict=True)
    header = "Position       LasRead   LinearError Status AirTemp AirPress MatTemp"
    lines = ("%12.5f %13.6f %13.6f %6d %5.2f %5.2f %8.2f" % row for row in rows)  # noqa: UP031 - columns, read at once
    write_lines(path, [header, *lines])


def _degf(degc: Floats | None, size: int) -> Floats:
    return np.full(size, _REFERENCE_DEGF) if degc is None else degc * 1.8 + 32.0
