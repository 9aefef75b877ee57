"""Traces of Sinumerik Operate as XML (Diagnostics, Trace).

======================================  =============================================================================
element                                 holds
======================================  =============================================================================
``traceSession``                        the whole; some programs write ``traceDataRoot``
``traceDisplaySetup`` / ``signal``      ``name``, ``description``, colours
``traceData`` / ``dataFrame``           a recording: ``frameHeader`` (``startTime``), ``dataSignal``, ``rec``
``dataSignal``                          ``id`` (``f1``), ``name`` (``/Nck/!SD/nckServoDataActPos1stEnc64 [u1, 1]``),
                                        ``description``, ``interval``
``rec``                                 ``time`` in s, and a value for each ``id`` that was sampled then
======================================  =============================================================================

By programs in public that read such files, not by files: elements and attributes, times in s, names of actual
position, control deviation, current, torque and load, ``true`` and ``false`` of binary signals, a NaN written as the
whole number of its bits (9218868437227405312 and above). Units are those of the display: mm, A, Nm. The name holds
the number of an axis, not its letter.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

import numpy as np

from rtec.errors import FileFormatError
from rtec.metrology.controller_logs.channels import Channel, letter_in, table_of_channels, unit_of_axis
from rtec.metrology.plain_numbers import shown
from rtec.metrology.tables.choices import ColumnChoices
from rtec.metrology.tables.table import Table

_ROOT = re.compile(r"<(?:traceSession|traceDataRoot)[\s>]")
_MEANINGS = (
    (r"ActPos1stEnc|EncPos1", "actual", ""),
    (r"(?:Cmd|Des|Set(?:point)?)Pos|PosCmd|PosSetp", "target", ""),
    (r"CtrlDev|ControlDev", "deviation", ""),
    (r"ActPos2ndEnc", "actual", ""),
    (r"ContDev", "contdev", ""),
    (r"ActCurr", "current", "a"),
    (r"(?:Cmd|Act)Torque", "torque", "nm"),
    (r"DrvLoad", "utilisation", "percent"),
)
"""What a name holds, with quantity and unit; no unit for that of the axis."""
_NUMBER_OF_AXIS = re.compile(r"\[\s*u?\d+\s*[,;]\s*(\d+)\s*\]")
_LETTERS = "xyzabcuvw"
_NAN_BITS = 9.2188e18
"""From here on a number is the bits of a NaN."""
_MOST_VALUES = 30_000_000


@dataclass(slots=True)
class _Recording:
    """A ``dataFrame`` while it is read."""

    signals: dict[str, dict[str, str]] = field(default_factory=dict)
    times: dict[str, list[float]] = field(default_factory=dict)
    values: dict[str, list[float]] = field(default_factory=dict)


def is_sinumerik_trace(text: str) -> bool:
    """Return whether a text is such a trace, by its first element.

    Examples
    --------
    >>> is_sinumerik_trace('<?xml version="1.0"?><traceSession version="2">'), is_sinumerik_trace("<html>")
    (True, False)
    """
    return text.lstrip()[:1] == "<" and _ROOT.search(text[:10_000]) is not None


def read_sinumerik_trace(source: str | Path, text: str, choices: ColumnChoices) -> Table:
    """Return the samples of such a trace as a table; several recordings are runs.

    Raises
    ------
    FileFormatError
        XML that is broken or cut off, a document type (entities are not read), no signals or no samples, a value that
        is no number, recordings of different signals.

    Examples
    --------
    >>> text = ('<traceSession><traceData><dataFrame>'
    ...         '<dataSignal id="f1" name="/Nck/!SD/nckServoDataActPos1stEnc64 [u1, 2]" description="AX2:Y1"/>'
    ...         '<rec time="0" f1="1.5"/><rec time="0.002" f1="2.5"/></dataFrame></traceData></traceSession>')
    >>> table = read_sinumerik_trace("x.xml", text, ColumnChoices())
    >>> table.headings, table.numbers.tolist()
    (('actual_y_mm', 'time_s'), [[1.5, 0.0], [2.5, 0.002]])
    """
    recordings = [one for one in _recordings(source, text) if any(one.values.values())]
    if not recordings:
        raise FileFormatError(source, None, "no samples", "a trace with elements 'dataSignal' and 'rec'")
    notes: list[str] = []
    tables = [_table(source, one, choices, notes if not number else []) for number, one in enumerate(recordings)]
    if len(tables) == 1:
        return tables[0]
    if len({table.headings for table in tables}) > 1:
        raise FileFormatError(source, None, "recordings of different signals", "one recording a file")
    first = tables[0]
    runs = np.repeat(np.arange(1.0, len(tables) + 1.0), [len(table.lines) for table in tables])
    numbers = np.vstack([table.numbers for table in tables if table.numbers is not None])
    return Table(
        source=first.source,
        facts=first.facts,
        headings=(*first.headings, "run"),
        units=(*first.units, ""),
        above=(*first.above, ""),
        heading_line=0,
        lines=range(1, runs.size + 1),
        numbers=np.column_stack([numbers, runs]),
        notes=(*first.notes, f"{len(tables)} recordings, each taken for a run"),
    )


def _recordings(source: str | Path, text: str) -> list[_Recording]:
    found: list[_Recording] = []
    parser = expat.ParserCreate(encoding="utf-8")
    total = 0

    def document_type(*_: object) -> None:
        raise FileFormatError(source, parser.CurrentLineNumber, "a document type (DTD)", "a trace without one")

    def element(name: str, attributes: dict[str, str]) -> None:
        nonlocal total
        if name == "dataFrame":
            found.append(_Recording())
        elif name == "dataSignal" and found and "id" in attributes:
            found[-1].signals[attributes["id"]] = attributes
        elif name == "rec" and found:
            total += len(attributes)
            if total > _MOST_VALUES:
                raise FileFormatError(source, None, f"more than {_MOST_VALUES} values", "a shorter trace")
            _keep(source, parser.CurrentLineNumber, found[-1], attributes)

    parser.StartDoctypeDeclHandler = document_type
    parser.StartElementHandler = element
    try:
        parser.Parse(text.encode(), True)
    except expat.ExpatError as error:
        problem = f"broken XML ({expat.ErrorString(error.code)})"
        raise FileFormatError(source, error.lineno, problem, "a whole trace; the file may be cut off") from None
    return found


def _keep(source: str | Path, line: int, recording: _Recording, attributes: dict[str, str]) -> None:
    """Add the values of a ``rec`` to those of its recording."""
    time_s = _number(source, line, attributes.get("time", ""))
    for name, value in attributes.items():
        if name in recording.signals:
            number = _number(source, line, value)
            if math.isfinite(number):
                recording.times.setdefault(name, []).append(time_s)
                recording.values.setdefault(name, []).append(number)


def _number(source: str | Path, line: int, text: str) -> float:
    if text in ("true", "false"):
        return float(text == "true")
    try:
        number = float(text)
    except ValueError:
        raise FileFormatError(source, line, f"{shown(text)} is not a number", "numbers in 'rec'") from None
    return math.nan if abs(number) >= _NAN_BITS else number


def _table(source: str | Path, recording: _Recording, choices: ColumnChoices, notes: list[str]) -> Table:
    channels, letters = [], {}  # type: list[Channel], dict[str, str]
    quantities = {_meaning(one)[0] for one in recording.signals.values()}
    for key, signal in recording.signals.items():
        if key not in recording.values:
            continue
        name = signal.get("name", key)
        quantity, unit = _meaning(signal)
        letter, guessed = _axis(signal)
        values = np.array(recording.values[key])
        time_s = np.array(recording.times[key])
        if time_s.size < 2 or not (np.diff(time_s) > 0.0).all():
            raise FileFormatError(source, None, f"times of {shown(name)} do not rise", "a trace in order of time")
        if quantity == "deviation":  # the file has target less actual
            values = -values
            quantity = "ctrldev" if {"target", "actual"} <= quantities else quantity
            notes.append(f"took {shown(name)} for target less actual")
        if quantity and guessed:
            letters[guessed] = letter
        unit = (unit or unit_of_axis(letter)) if quantity else ""
        channels.append(Channel(name=name, values=values, time_s=time_s, quantity=quantity, unit=unit, axis=letter))
    units = {f"{one.quantity} in {one.unit}" for one in channels if one.quantity}
    if units:
        notes.append(f"took {', '.join(sorted(units))}: the file states no units")
    if letters:
        notes.append(
            f"took {', '.join(f'axis {n} for {letter}' for n, letter in sorted(letters.items()))}, by number"
        )
    return table_of_channels(source, channels, choices, facts={}, notes=notes)


def _meaning(signal: dict[str, str]) -> tuple[str, str]:
    name = signal.get("name", "")
    return next(((what, unit) for word, what, unit in _MEANINGS if re.search(word, name)), ("", ""))


def _axis(signal: dict[str, str]) -> tuple[str, str]:
    """Return the letter of an axis, and its number where the letter is guessed by it."""
    said = re.search(r"AX\d+:([A-Z])\d*", signal.get("description", ""))
    letter = said[1].lower() if said is not None else letter_in(signal.get("description", ""))
    number = _NUMBER_OF_AXIS.search(signal.get("name", ""))
    if letter or number is None or not 1 <= int(number[1]) <= len(_LETTERS):
        return letter, ""
    return _LETTERS[int(number[1]) - 1], number[1]
