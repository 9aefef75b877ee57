"""Recordings of Beckhoff TwinCAT Scope, exported as CSV.

A few lines about the file (``Name``, ``File``, ``Starttime of export``), an empty one, a block of lines about the
channels, an empty one, and the samples. A line of the block has a key in each time column and a value in each
channel:

======================  ==========================================================================================
key                     holds
======================  ==========================================================================================
``Name``                of the channel; a cell ``Name`` stands over a column of times, which serves the channels
                        to its right up to the next
``SymbolName``          ``Axes.Axis X.NcToPlc.ActPos``
``SampleTime[ms]``
``Unit``                ``mm (Length)``, or ``(None)``
======================  ==========================================================================================

Times are ms since the first sample, or with *Full Timestamp* a FILETIME (100 ns since 1601); slower channels end
earlier; a line ``EOF`` may end the file. Columns are separated by tabs or semicolons.

Seen in exports of TwinCAT 3 Scope 3.4: layout, both decimal marks, one or several time columns, ``EOF``. By the
maker's documentation only: the full time stamp, exports of TwinCAT 2 (``StartRecord``). Names and units of NC axes
are by documentation, too: ``SetPos``, ``ActPos``, ``PosDiff`` in the unit of the axis.
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np

from rtec.errors import FileFormatError
from rtec.metrology.columns import column_unit, spelled_unit
from rtec.metrology.controller_logs.channels import Channel, Floats, letter_in, table_of_channels, unit_of_axis
from rtec.metrology.plain_numbers import shown
from rtec.metrology.tables.choices import ColumnChoices
from rtec.metrology.tables.table import Table

_FIRST = re.compile(r"Name([\t;,|])[^\n]*\nFile\1[^\n]*\n(?:Starttime of export|StartRecord)\1")
_MEANINGS = (
    (r"(?i)(?:set|cmd|command|target|soll)_?(?:pos|lage)|position_?command", "target", "mm"),
    (r"(?i)(?:act|actual|feedback|ist)_?(?:pos|lage)|position_?actual", "actual", "mm"),
    (r"(?i)posdiff|lagdist|lag_?error|followingerror|schlepp", "deviation", "mm"),
    (r"(?i)(?:act|actual)_?velo", "velocity", "mm_s"),
    (r"(?i)(?:act|actual)_?curr|current_?actual|currentact", "current", "a"),
    (r"(?i)(?:act|actual)_?torque|torque_?actual", "torque", "nm"),
)
"""What a name holds, with quantity and the unit where none is stated."""
_FILETIME = 1e15
"""Times above are FILETIME, of which this many make a second:"""
_TICKS_A_SECOND = 1e7
_LEAST_LINES = 4


def is_twincat_scope(text: str) -> bool:
    r"""Return whether a text is such an export, by its first three lines.

    Examples
    --------
    >>> is_twincat_scope("Name\tx\nFile\tx.csv\nStarttime of export\t13\n"), is_twincat_scope("Name,target_mm\n")
    (True, False)
    """
    return _FIRST.match(text.lstrip()[:5000]) is not None


def read_twincat_scope(source: str | Path, text: str, choices: ColumnChoices) -> Table:
    r"""Return the samples of such an export as a table.

    Raises
    ------
    FileFormatError
        No block of channels, no samples, a row of another length than the block, a cell that is no number, times that
        do not rise, or no times at all.

    Examples
    --------
    >>> text = ("Name\tx\nFile\tx.csv\nStarttime of export\t13\n\nName\tSetPos\tActPos\nSampleTime[ms]\t1\t1\n"
    ...         "Unit\tmm (Length)\tmm (Length)\n\n0\t1,5\t1,25\n1\t2,5\t2,25\n")
    >>> table = read_twincat_scope("x.csv", text, ColumnChoices())
    >>> table.headings, table.numbers.tolist()
    (('target_mm', 'actual_mm', 'time_s'), [[1.5, 1.25, 0.0], [2.5, 2.25, 0.001]])
    """
    lines = text.strip("\n").split("\n")
    separator = lines[0].lstrip()[4]
    start = next((i for i in range(3, len(lines)) if lines[i].startswith(f"Name{separator}")), None)
    if start is None:
        raise FileFormatError(
            source, None, "no block of channels", "lines 'Name', 'SymbolName', ... above the samples"
        )
    first = next((i for i in range(start, len(lines)) if re.match(r"\s*-?\d", lines[i])), len(lines))
    block = [line.rstrip("\r").split(separator) for line in lines[start:first] if line.strip()]
    names = block[0]
    clocks = [column for column, cell in enumerate(names) if cell.strip() == "Name"]
    about = {row[0].strip(): row for row in block}
    numbers = _numbers(source, lines, first, separator, len(names))
    channels: list[Channel] = []
    notes = [f"a recording of TwinCAT Scope: {len(names) - len(clocks)} channels"]
    assumed = set()
    for clock, following in pairwise([*clocks, len(names)]):
        for column in range(clock + 1, following):
            if not names[column].strip():
                continue
            channel, said = _channel(source, names[column].strip(), column, clock, about, numbers)
            channels.append(channel)
            if not said and channel.quantity:
                assumed.add(f"{channel.name} in {channel.unit.replace('_', '/')}")
            if channel.quantity == "deviation":
                notes.append(f"took {shown(channel.name)} for target less actual")
    if assumed:
        few = ", ".join(sorted(assumed)[:4]) + (", ..." if len(assumed) > 4 else "")
        notes.append(f"took {few}: the file states no units for them")
    channels = _one_deviation(channels)
    return table_of_channels(source, channels, choices, facts=_facts(lines[:start], separator), notes=notes)


def _numbers(source: str | Path, lines: list[str], first: int, separator: str, width: int) -> Floats:
    """Return all cells, shape (rows, width); NaN stands for an empty one."""
    rows: list[list[float]] = []
    for index in range(first, len(lines)):
        line = lines[index].rstrip("\r")
        if not line.strip() or line.strip() == "EOF":
            continue
        cells = line.split(separator)
        if len(cells) > width and not any(cell.strip() for cell in cells[width:]):
            cells = cells[:width]
        if len(cells) > width:
            raise FileFormatError(source, index + 1, f"{len(cells)} cells", f"{width}, as the channels above")
        cells += [""] * (width - len(cells))
        try:
            rows.append([float(cell.replace(",", ".")) if cell.strip() else np.nan for cell in cells])
        except ValueError:
            wrong = next(cell for cell in cells if cell.strip() and not _is_number(cell))
            raise FileFormatError(source, index + 1, f"{shown(wrong)} is not a number", "numbers") from None
    if len(rows) < 2:
        raise FileFormatError(source, None, f"{len(rows)} rows of samples", "two or more")
    return np.array(rows)


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _channel(
    source: str | Path, name: str, column: int, clock: int, about: dict[str, list[str]], numbers: Floats
) -> tuple[Channel, bool]:
    """Return a channel, and whether the file states its unit."""

    def of(key: str) -> str:
        row = about.get(key, [])
        return row[column].strip() if column < len(row) else ""

    times, values = numbers[:, clock], numbers[:, column]
    there = np.isfinite(times) & np.isfinite(values)
    times, values = times[there], values[there]
    if times.size < 2 or not (np.diff(times) > 0.0).all():
        allowed = "an export with time columns, whose times rise"
        raise FileFormatError(source, None, f"the times of {shown(name)} do not rise", allowed)
    full = abs(times[0]) > _FILETIME
    time_s = (times - np.nanmin(numbers[:, clock])) / _TICKS_A_SECOND if full else times / 1e3
    text = f"{name} {of('SymbolName')}"
    quantity, unit = next(((what, unit) for word, what, unit in _MEANINGS if re.search(word, text)), ("", ""))
    letter = letter_in(name) or letter_in(of("SymbolName")) if quantity else ""
    stated = spelled_unit(of("Unit").partition("(")[0].strip()) if of("Unit") else None
    known = column_unit(quantity, stated) if quantity and stated is not None else None
    if known is not None:
        return Channel(name=name, values=_signed(quantity, known.factor * values), time_s=time_s, quantity=quantity,
                       unit=known.inside, axis=letter), True  # fmt: skip
    unit = unit.replace("mm", unit_of_axis(letter)) if letter else unit
    return Channel(name=name, values=_signed(quantity, values), time_s=time_s, quantity=quantity, unit=unit,
                   axis=letter), False  # fmt: skip


def _signed(quantity: str, values: Floats) -> Floats:
    return -values if quantity == "deviation" else values


def _one_deviation(channels: list[Channel]) -> list[Channel]:
    """Return channels without the lag of an axis that has both positions: it is their difference."""
    whole = {
        axis
        for axis in {one.axis for one in channels}
        if {"target", "actual"} <= {one.quantity for one in channels if one.axis == axis}
    }
    return [one for one in channels if one.quantity != "deviation" or one.axis not in whole]


def _facts(lines: list[str], separator: str) -> dict[str, str]:
    rows = [line.rstrip("\r").split(separator) for line in lines if line.strip()]
    return {"name": rows[0][1].strip()} if rows and len(rows[0]) > 1 else {}
