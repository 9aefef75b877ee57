"""Checks of single values that faces make before a number enters the inside."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from numbers import Integral, Real
from typing import Any

from rtec.errors import ArgumentError
from rtec.readable import hertz_text, time_text
from rtec.units import NUMBER

_UNITS = {
    "ps": "ps", "s": "s", "hz": "Hz", "hz_s": "Hz/s", "mm": "mm", "um": "um", "mm_s": "mm/s", "mm_s2": "mm/s^2",
    "mm_s3": "mm/s^3", "inch": "inch", "deg": "deg", "counts": "counts", "steps": "steps", "sigma": "sigma",
}  # fmt: skip
"""The unit that is meant by the last words of a name."""
_WRITTEN = re.compile(rf"\s*(?P<number>{NUMBER})\s*(?P<unit>[^\s\d]\S*)?\s*")
"""A quantity as people write it."""
_SCALED: dict[str, Callable[[Any], str]] = {"Hz": hertz_text, "ps": time_text}
"""Units in which numbers are large: how people read them."""


def number_within(name: str, value: object, low: float, high: float, *, unit: str = "") -> float:
    """Return ``value`` as a float if it is a number from ``low`` to ``high``.

    Parameters
    ----------
    name
        Of the argument, for the message.
    value
        What the caller gave.
    low, high
        Both are allowed.
    unit
        Of the three, for the message; the one that ends the name, as in ``feed_mm_s``, where nothing is said.

    Raises
    ------
    ArgumentError
        Not a real number, not finite, or outside the interval.

    Examples
    --------
    >>> number_within("target_mm", 12, -100.0, 100.0)
    12.0
    >>> number_within("clock_hz", 2e9, 1.0, 1e9)
    Traceback (most recent call last):
        ...
    rtec.errors.ArgumentError: clock_hz: 2 GHz is too large; use 1 Hz to 1 GHz
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        allowed = f"a number from {_interval(low, high, unit or _unit_of(name))}"
        raise ArgumentError(name, repr(value)[:60], allowed)
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not low <= number <= high:
        raise outside(name, number, low, high, unit=unit)
    return number


def whole_within(name: str, value: object, low: int, high: int, *, unit: str = "") -> int:
    """Return ``value`` as an int if it is a whole number from ``low`` to ``high``.

    Parameters
    ----------
    name, value, low, high, unit
        As of `number_within`.

    Raises
    ------
    ArgumentError
        Not a whole number, or outside the interval.

    Examples
    --------
    >>> whole_within("samples", 3, 0, 1000)
    3
    """
    if isinstance(value, bool) or not isinstance(value, Integral):
        allowed = f"a whole number from {_interval(low, high, unit or _unit_of(name))}"
        raise ArgumentError(name, repr(value)[:60], allowed)
    if not low <= int(value) <= high:
        raise outside(name, int(value), low, high, unit=unit)
    return int(value)


def one_of_types(name: str, value: object, *types: type) -> None:
    """Check that a part is of one of these types.

    Parameters
    ----------
    name, value
        As of `number_within`.
    types
        Any of them is allowed.

    Raises
    ------
    ArgumentError
        Of another type.

    Examples
    --------
    >>> one_of_types("name", 3, str)
    Traceback (most recent call last):
        ...
    rtec.errors.ArgumentError: name: 3 is not valid; use str
    """
    if not isinstance(value, types):
        allowed = " or ".join("None" if one is type(None) else one.__name__ for one in types)
        raise ArgumentError(name, repr(value)[:60], allowed)


def outside(name: str, value: float, low: float, high: float, *, unit: str = "") -> ArgumentError:
    """Return the error of a number that is not between two others.

    Parameters
    ----------
    name, value, low, high, unit
        As of `number_within`.

    Examples
    --------
    >>> str(outside("--axis", 16, 1, 15)), str(outside("start_mm", -5.0, 0.0, 100.0))
    ('--axis: 16 is too large; use 1 to 15', 'start_mm: -5 mm is too small; use 0 to 100 mm')
    """
    unit = unit or _unit_of(name)
    problem = "is too small" if value < low else "is too large" if value > high else "is no number"
    error = ArgumentError(name, _with_unit(value, unit), _interval(low, high, unit), problem=problem)
    error.interval = (value, low, high, unit)
    return error


def as_written(error: ArgumentError, name: str, text: str) -> ArgumentError:
    """Return an error under the user's name for the argument, its number in the unit that the user wrote.

    Parameters
    ----------
    error
        As a face raised it.
    name, text
        The argument and its value, as the user wrote them.

    Examples
    --------
    >>> str(as_written(outside("gate_margin", -0.05, 0.0, 100.0), "--gate-margin", "-5%"))
    '--gate-margin: -5 % is too small; use 0 to 10000 %'
    >>> str(as_written(outside("pulse_ps", 3_600 * 10**12, 0, 2_000_000), "--pulse", "1 h"))
    '--pulse: 1 h is too large; use 0 ps to 2 us'
    >>> str(as_written(ArgumentError("span_mm", "5e-05 mm", "a length from 1 um on"), "--span", "50nm"))
    '--span: 50nm is not valid; use a length from 1 um on'
    """
    written = _WRITTEN.fullmatch(text)
    if error.interval is not None and written is not None:
        value, low, high, unit = error.interval
        scale = float(written["number"]) / value if value else math.nan
        if written["unit"] and 0.0 < scale < math.inf and _parted(unit)[0] not in _SCALED:
            return outside(name, scale * value, scale * low, scale * high, unit=written["unit"])
    if _WRITTEN.fullmatch(str(error.value)) is not None:
        return ArgumentError(name, text, error.allowed, error.hint, problem=error.problem)
    return error.of(name)


def _interval(low: float, high: float, unit: str) -> str:
    name, remark = _parted(unit)
    first = _with_unit(low, name if name in _SCALED else "")
    return f"{first} to {_with_unit(high, name)} {remark}".rstrip()


def _with_unit(value: float, unit: str) -> str:
    """Return a number for people; a frequency or a time of the signal path in a unit that suits its size."""
    name, _ = _parted(unit)
    if name in _SCALED and math.isfinite(value):
        return _SCALED[name](value)
    return f"{value if isinstance(value, int) else format(value, '.10g')} {name}".rstrip()


def _parted(unit: str) -> tuple[str, str]:
    """Return a unit and the remark in parentheses behind it; either may be empty."""
    name, bracket, remark = unit.partition("(")
    return name.rstrip(), bracket + remark


def _unit_of(name: str) -> str:
    words = name.split(" ", maxsplit=1)[0].split("_")
    ends = ("_".join(words[at:]) for at in range(1, len(words)))
    return next((_UNITS[end] for end in ends if end in _UNITS), "")
