"""Dates and times of day in cells, as seconds since the first reading."""

from __future__ import annotations

import datetime
import re
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from rtec.errors import FileFormatError
from rtec.metrology.plain_numbers import shown
from rtec.metrology.readings import Floats

_ISO = re.compile(r"[0-9]{4}-?[0-9]{2}-?[0-9]{2}[T ][0-9:]{2,8}.{0,20}", re.ASCII)
_CLOCK = re.compile(
    r"([0-9]{1,2}):([0-9]{2})(?::([0-9]{2})(?:[.,]([0-9]{1,9}))?)?\s*([ap]\.?m\.?)?", re.ASCII | re.IGNORECASE
)
_DAY = re.compile(r"([0-9]{1,4})([./-])([0-9]{1,2})\2([0-9]{1,4})", re.ASCII)
_DAY_S = 86_400.0
_ALLOWED = "a date with a time of day, such as 2026-11-22T14:05:09.250Z, or a time of day, such as 14:05:09"
_TWO_DIGIT_YEARS = 100


def is_date_or_clock(text: str) -> bool:
    """Return whether a cell holds a date with a time of day, a date, or a time of day.

    Examples
    --------
    >>> [is_date_or_clock(text) for text in ("2026-11-22T14:05:09Z", "14:05:09.5", "22.11.2026 14:05", "12", "5 s")]
    [True, True, True, False, False]
    """
    day, clock = _apart(text.strip()[:60])
    return _ISO.fullmatch(text.strip()[:60]) is not None or bool(day or clock)


def seconds_since_first(
    source: str, lines: Sequence[int], heading: str, cells: Sequence[str]
) -> tuple[Floats, list[str]]:
    """Return the seconds since the first of several dates or times of day, and what was taken for granted.

    Cells are ISO 8601, ``22.11.2026 14:05:09``, ``11/22/2026 2:05 PM``, or times of day alone, which go on over
    midnight; the rest is for messages.

    Raises
    ------
    FileFormatError
        A cell that is none, a time zone that only some state, days and months that cannot be told apart, dates
        without a time of day.

    Examples
    --------
    >>> seconds_since_first("x.csv", [2, 3], "Uhrzeit", ["23:59:59", "00:00:01,5"])
    (array([0. , 2.5]), ['Uhrzeit passes midnight'])
    """
    texts = [cell.strip() for cell in cells]
    if _ISO.fullmatch(texts[0][:60]) is not None:
        moments = [_iso(source, line, heading, text, texts[0]) for line, text in zip(lines, texts, strict=True)]
        return np.array([(moment - moments[0]).total_seconds() for moment in moments]), []
    parts = [_apart(text[:60]) for text in texts]
    has_day = parts[0][0] is not None
    for line, text, (day, clock) in zip(lines, texts, parts, strict=True):
        if clock is None or (day is not None) != has_day:
            raise FileFormatError(source, line, f"{heading} {shown(text)} is no date with a time of day", _ALLOWED)
    clocks = np.array([_seconds(source, line, heading, clock) for line, (_, clock) in zip(lines, parts, strict=True)])
    if not has_day:
        back = [after < before - _DAY_S / 2 for before, after in pairwise(clocks)]
        days = np.concatenate(([0], np.cumsum(back)))
        notes = [f"{heading} passes midnight"] if any(back) else []
        return clocks + days * _DAY_S - clocks[0], notes
    order, notes = _order(source, lines[0], heading, [day for day, _ in parts if day is not None])
    ordinals = np.array(
        [
            _ordinal(source, line, heading, day, order)
            for line, (day, _) in zip(lines, parts, strict=True)
            if day is not None
        ]
    )
    return (ordinals - ordinals[0]) * _DAY_S + clocks - clocks[0], notes


def _iso(source: str, line: int, heading: str, text: str, first: str) -> datetime.datetime:
    """Return a date with a time of day; refuse a zone that only some of them state."""
    try:
        moment, start = (datetime.datetime.fromisoformat(one[:60].replace(",", ".")) for one in (text, first))
    except ValueError:
        raise FileFormatError(source, line, f"{heading} {shown(text)} is no date", _ALLOWED) from None
    if (moment.tzinfo is None) != (start.tzinfo is None):
        problem = f"{heading} {shown(text)} and {shown(first)}: only one of them states its time zone"
        raise FileFormatError(source, line, problem, "the time zone in every row, or in none")
    return moment


def _apart(text: str) -> tuple[re.Match[str] | None, re.Match[str] | None]:
    """Return the day and the time of day in a text, each None where it has none; both None for anything else."""
    day_text, _, clock_text = text.replace("T", " ").partition(" ")
    day = _DAY.fullmatch(day_text)
    if day is None:
        return None, _CLOCK.fullmatch(text)
    clock = _CLOCK.fullmatch(clock_text.strip())
    return (None, None) if clock is None and clock_text.strip() else (day, clock)


def _seconds(source: str, line: int, heading: str, clock: re.Match[str] | None) -> float:
    assert clock is not None  # noqa: S101 - looked at by the caller
    hour, minute, second = int(clock[1]), int(clock[2]), int(clock[3] or 0)
    half = (clock[5] or "").lower().replace(".", "")
    if half and 1 <= hour <= 12:
        hour = hour % 12 + (12 if half == "pm" else 0)
    elif half:
        hour = 99
    if hour > 23 or minute > 59 or second > 60:
        raise FileFormatError(source, line, f"{heading} {shown(clock[0])} is no time of day", "00:00:00 to 23:59:59")
    return hour * 3600.0 + minute * 60.0 + second + float(f"0.{clock[4] or 0}")


def _order(source: str, line: int, heading: str, days: Sequence[re.Match[str]]) -> tuple[str, list[str]]:
    """Return whether dates are ``ymd``, ``dmy`` or ``mdy``; with slashes, only a number above 12 tells."""
    if len(days[0][1]) == 4:
        return "ymd", []
    if days[0][2] == ".":
        return "dmy", []
    first, second = max(int(day[1]) for day in days), max(int(day[3]) for day in days)
    if (first > 12) != (second > 12):
        order = "dmy" if first > second else "mdy"
        return order, [
            f"took {heading} {shown(days[0][0])} for {'day, month' if order == 'dmy' else 'month, day'}, year"
        ]
    if len({day[0] for day in days}) == 1:
        return "dmy", []  # all of one day: which it is makes no difference
    problem = f"{heading} {shown(days[0][0])} may be day/month or month/day"
    raise FileFormatError(source, line, problem, "dates such as 2026-11-22")


def _ordinal(source: str, line: int, heading: str, day: re.Match[str], order: str) -> int:
    numbers = dict(zip(order, (int(day[1]), int(day[3]), int(day[4])), strict=True))
    year = numbers["y"] + (2000 if numbers["y"] < _TWO_DIGIT_YEARS else 0)
    try:
        return datetime.date(year, numbers["m"], numbers["d"]).toordinal()
    except ValueError:
        raise FileFormatError(source, line, f"{heading} {shown(day[0])} is no date", _ALLOWED) from None
