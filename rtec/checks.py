"""Checks of single values that faces make before a number enters the inside."""

from __future__ import annotations

import math
from numbers import Integral, Real

from rtec.errors import ArgumentError


def number_within(name: str, value: object, low: float, high: float, *, unit: str = "") -> float:
    """Return ``value`` as a float if it is a number from ``low`` to ``high``.

    Raises
    ------
    ArgumentError
        Not a real number, not finite, or outside the interval.

    Examples
    --------
    >>> number_within("target_mm", 12, -100.0, 100.0, unit="mm")
    12.0
    """
    allowed = f"a number from {low:g} to {high:g}{' ' + unit if unit else ''}"
    if isinstance(value, bool) or not isinstance(value, Real):
        raise ArgumentError(name, repr(value)[:60], allowed)
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not low <= number <= high:
        raise ArgumentError(name, number, allowed)
    return number


def whole_within(name: str, value: object, low: int, high: int, *, unit: str = "") -> int:
    """Return ``value`` as an int if it is a whole number from ``low`` to ``high``.

    Raises
    ------
    ArgumentError
        Not a whole number, or outside the interval.

    Examples
    --------
    >>> whole_within("samples", 3, 0, 1000)
    3
    """
    allowed = f"a whole number from {low} to {high}{' ' + unit if unit else ''}"
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise ArgumentError(name, repr(value)[:60], allowed)
    if not low <= int(value) <= high:
        raise ArgumentError(name, int(value), allowed)
    return int(value)
