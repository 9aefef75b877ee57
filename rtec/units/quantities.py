"""Quantities as people write them ("500kHz", "50 inch/min", "2 us"), turned into the internal units.

Inside, time is int64 picoseconds and position is float64 millimetres or int64 counts. Units exist only at the edges:
the command line, TOML files and reports. The text is split into one number and one unit before the unit library sees
it, so that an expression such as ``9**9**9 Hz`` is refused and never evaluated.
"""

from __future__ import annotations

import decimal
import math
import re
from dataclasses import dataclass
from fractions import Fraction

from rtec.errors import ArgumentError
from rtec.units._time_kernels import PS_PER_S
from rtec.units.factors import COMMON, factor_between, suggested_unit

LONGEST_RUN_PS = 50 * 86_400 * PS_PER_S
"""Longest run, 50 days: beyond 53 days lies the kernels' "never"."""

_DIGITS = r"\d+(?:_\d+)*"
NUMBER = rf"[+-]?(?:{_DIGITS}(?:\.(?:{_DIGITS})?)?|\.{_DIGITS})(?:[eE][+-]?\d{{1,4}})?"
"""A number as a regular expression: 5, -0.5, .5, 1e5, 100_000."""
_QUANTITY = re.compile(
    rf"\s*(?P<number>{NUMBER})(?P<space>\s*)(?P<unit>(?:1/)?[A-Za-zµμ°%][A-Za-zµμ°%/*()^²\d ]{{0,30}})?\s*"
)
_LONGEST_NUMBER = 60


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of quantity: the unit it has inside, and examples that an error message shows."""

    name: str
    unit: str
    examples: str


FREQUENCY = Kind("frequency", "Hz", "500kHz, 30 kHz, 12 MHz")
TIME = Kind("time", "s", "2 us, 5ns, 1 ms, 6 s")
LENGTH = Kind("length", "mm", "1um, 0.25 inch, 6.35 mm")
SPEED = Kind("speed", "mm/s", "50 inch/min, 7 m/min, 20 mm/s")
ACCELERATION = Kind("acceleration", "mm/s^2", "500 mm/s^2, 0.5 m/s^2")
JERK = Kind("jerk", "mm/s^3", "5000 mm/s^3, 5 m/s^3")
ANGLE = Kind("angle", "deg", "10deg, 0.1 rad")
SHARE = Kind("share", "percent", "2%, 0.5 %, 2 percent")
SWEEP = Kind("change of a frequency", "Hz/s", "100 MHz/s, 5 kHz/s")
RATE = Kind("rate", "1/s", "16.7 1/s, 1000 1/min")


def parse_quantity(text: str, kind: Kind, *, name: str) -> float:
    """Read a quantity with its unit and return it in the unit of ``kind``.

    Parameters
    ----------
    text
        One number and one unit, as in ``"50 inch/min"``, ``"1e5 Hz"``, ``"100_000 Hz"``. A bare number is refused.
    kind
        What is expected; its ``unit`` is the unit of the result.
    name
        The option or key, for the error message.

    Raises
    ------
    ArgumentError
        No number, no unit, a unit of another dimension or one that is misspelled (the right one is suggested), or a
        value that is not finite.

    Examples
    --------
    >>> parse_quantity("500kHz", FREQUENCY, name="--frequency")
    500000.0
    >>> round(parse_quantity("50 inch/min", SPEED, name="feed"), 6)
    21.166667
    """
    article = "an" if kind.name[0] in "aeiou" else "a"
    allowed = f"{article} {kind.name} with its unit, such as {kind.examples}"
    number, factor = _number_and_factor(text, kind.unit, name, allowed)
    return _finite(float(number) * factor, text, name, allowed)


def parse_in(text: str, unit: str, *, name: str, inside: float = 1.0) -> float:
    """Read a quantity in any unit of the dimension of ``unit``, rounding once.

    The same text gives the same number wherever it is read, and what :func:`written` writes comes back bit for bit.

    Parameters
    ----------
    text
        One number and one unit. A bare number is refused.
    unit
        In which people expect it.
    name
        The option or key, for the error message.
    inside
        The result is the number in ``unit`` divided by this.

    Raises
    ------
    ArgumentError
        As `parse_quantity`.

    Examples
    --------
    >>> parse_in("12.3 um", "um", name="backlash", inside=1000.0), parse_in("0.25 inch", "mm", name="period")
    (0.0123, 6.35)
    >>> parse_in("20 ppm", "um/m", name="scale", inside=1e6)
    2e-05
    """
    exact = parse_exact(text, unit, name=name) / Fraction(inside)
    return _finite(_rounded(exact), text, name, _in_unit(unit))


def parse_exact(text: str, unit: str, *, name: str) -> Fraction:
    """Read a quantity as :func:`parse_in` does, without rounding.

    Examples
    --------
    >>> parse_exact("33.333 MHz", "Hz", name="clock")
    Fraction(33333000, 1)
    """
    number, factor = _number_and_factor(text, unit, name, _in_unit(unit))
    return Fraction(number) * Fraction(repr(factor))


def _in_unit(unit: str) -> str:
    return f"a number with its unit, such as '1.5 {unit}'"


def _finite(value: float, text: str, name: str, allowed: str) -> float:
    if not math.isfinite(value):
        raise ArgumentError(name, repr(text[:60]), allowed, "the value is not finite")
    return value


def _number_and_factor(text: str, target: str, name: str, allowed: str) -> tuple[str, float]:
    """Split a quantity into its number and the factor from its unit to ``target``; the one place that reads both.

    Raises
    ------
    ArgumentError
        What is no quantity of that dimension; a unit that is nearly right is suggested and never taken.
    """
    if not isinstance(text, str):
        raise ArgumentError(name, repr(text)[:60], allowed, "write the unit behind the number, in quotes")
    match = _QUANTITY.fullmatch(text) if len(text) <= 2 * _LONGEST_NUMBER else None
    if match is None or len(match["number"]) > _LONGEST_NUMBER:
        hint = "write a decimal point, no comma" if re.search(r"\d,\d", text[:60]) else ""
        raise ArgumentError(name, repr(text[:60]), allowed, hint)
    if match["unit"] is None:
        units = ", ".join(COMMON.get(target, (target,)))
        hint = f"write the unit behind the number: {units}"
        raise ArgumentError(name, repr(text[:60]), allowed, hint, problem="has no unit")
    unit = match["unit"].strip()
    suggested = suggested_unit(unit, target)
    factor = factor_between(unit, target)
    if suggested is not None or factor is None:
        hint = "" if suggested is None else f"did you mean '{match['number']}{match['space']}{suggested}'?"
        if factor is not None:
            hint += f" {text.strip()} would be {float(match['number']) * factor:g} {target}"
        raise ArgumentError(name, repr(text[:60]), allowed, hint)
    return match["number"], factor


def _rounded(exact: Fraction) -> float:
    try:
        return float(exact)
    except OverflowError:
        return math.inf


def written(value: float, unit: str, *, inside: float = 1.0) -> str:
    """Return the shortest text that :func:`parse_in` reads back as the same number.

    Parameters
    ----------
    value
        Finite; in internal units.
    unit
        In which people read it.
    inside
        The number in ``unit`` is ``value`` times this.

    Raises
    ------
    ArgumentError
        A value that is not finite.

    Examples
    --------
    >>> written(0.0123, "um", inside=1000.0), written(1 / 3, "mm")
    ('12.3 um', '0.3333333333333333 mm')
    """
    if not math.isfinite(value):
        raise ArgumentError("value", value, "a finite number")
    exact = Fraction(value) * Fraction(inside)
    for digits in range(15, 25):
        number = decimal.Context(prec=digits).divide(exact.numerator, exact.denominator).normalize()
        if _rounded(Fraction(number) / Fraction(inside)) == value:
            break
    return f"{number:f} {unit}" if -7 < number.adjusted() < 16 else f"{number:e} {unit}"


def seconds_to_ps(seconds: float, *, name: str) -> int:
    """Return ``seconds`` as whole picoseconds.

    Raises
    ------
    ArgumentError
        Beyond 100 days, where int64 picoseconds end.

    Examples
    --------
    >>> seconds_to_ps(2e-6, name="pulse")
    2000000
    """
    if not abs(seconds) <= 8.64e6:
        raise ArgumentError(name, f"{seconds} s", "at most 100 days (time is int64 picoseconds)")
    return round(seconds * PS_PER_S)


def parse_time_ps(text: str, *, name: str) -> int:
    """Read a time with its unit and return whole picoseconds.

    Examples
    --------
    >>> parse_time_ps("5ns", name="--jitter")
    5000
    """
    return seconds_to_ps(parse_quantity(text, TIME, name=name), name=name)
