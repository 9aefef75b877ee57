"""Quantities as people write them ("500kHz", "50 inch/min", "2 us"), turned into the numbers of the inside.

Inside, time is int64 picoseconds and position is float64 millimetres or int64 counts. Units exist only at the edges:
the command line, TOML files and reports. The text is split into one number and one unit before the unit library sees
it, so that an expression such as ``9**9**9 Hz`` is refused and never evaluated.
"""

from __future__ import annotations

import decimal
import functools
import math
import re
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from rtec.errors import ArgumentError

PS_PER_S = 1_000_000_000_000
"""Picoseconds in one second."""
LONGEST_RUN_PS = 50 * 86_400 * PS_PER_S
"""Longest run, 50 days: beyond 53 days lies the kernels' "never"."""
MM_PER_INCH = 25.4
"""Millimetres in one inch, exact."""

_QUANTITY = re.compile(
    r"\s*(?P<number>[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d{1,4})?)"
    r"\s*(?P<unit>(?:1/)?[A-Za-zµμ°%][A-Za-zµμ°%/*()^²\d ]{0,30})?\s*"
)
_POWER = re.compile(r"\^?([23])")
_SYMBOL = re.compile(r"([A-Za-zµμ°%]+(?:_[A-Za-z]+)?)(?:\^?([23])|²)?|1(?=/)|[*/()]")
_ANGLES = frozenset(
    {"deg", "degree", "degrees", "°", "rad", "radian", "radians", "mrad", "urad", "µrad", "μrad"}
    | {"mas", "arcmin", "arcsec", "rev", "revolution", "revolutions", "turn", "turns", "rpm"}
)
_NUMBERS = frozenset(("count", "counts", "reading", "readings"))
_BETWEEN = frozenset("*/)")
_REVOLUTION = re.compile(r"\brev\b")
_DEGREES = re.compile(r"\bdeg([CF])\b")
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
SHARE = Kind("share", "percent", "2 %, 2 percent")
SWEEP = Kind("change of a frequency", "Hz/s", "100 MHz/s, 5 kHz/s")
RATE = Kind("rate", "1/s", "16.7 1/s, 1000 1/min")


_COMMON = {
    "Hz": {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "mm": {"mm": 1.0, "um": 1e-3, "inch": MM_PER_INCH, "m": 1e3},
    "deg": {"deg": 1.0},
    "um": {"um": 1.0, "mm": 1e3},
    "mm/s": {"mm/s": 1.0, "inch/min": MM_PER_INCH / 60.0},
    "mm/s^2": {"mm/s^2": 1.0},
    "percent": {"percent": 1.0, "%": 1.0},
    "1/s": {"1/s": 1.0},
    "Hz/s": {"Hz/s": 1.0, "kHz/s": 1e3, "MHz/s": 1e6, "GHz/s": 1e9},
}
"""Units that nearly every command meets: read without the unit library, which takes 0.4 s to load."""


@functools.cache
def _registry() -> Any:
    import pint  # noqa: PLC0415 - 0.4 s, needed only where a quantity is read

    registry: Any = pint.UnitRegistry(cache_folder=None)
    return registry


@functools.cache
def _factor(unit: str, target: str) -> float | None:
    """Return the factor from ``unit`` to ``target``, or None where they differ in dimension or are unknown."""
    common = _COMMON.get(target, {}).get(unit)
    if common is not None:
        return common
    if not _same_angles_and_numbers(unit, target):
        return None
    import pint  # noqa: PLC0415 - as above

    def spelled(text: str) -> str:
        plain = _POWER.sub(r"**\1", text.strip().replace("²", "^2"))
        plain = _REVOLUTION.sub("revolution", plain)
        # a temperature in a product is a difference of temperatures
        return _DEGREES.sub(r"delta_deg\1", plain) if re.search("[*/]", plain) else plain

    try:
        return float(_registry().Quantity(f"1 * {spelled(unit)}").to(spelled(target)).magnitude)
    except (pint.errors.PintError, ValueError, TypeError, AttributeError):
        return None


def _same_angles_and_numbers(unit: str, target: str) -> bool:
    """Return whether two units hold the same powers of angles and of things counted; false for what is no unit.

    To the unit library both are pure numbers, so that 5 counts would be 286 degrees.
    """
    powers = _powers(unit), _powers(target)
    if powers[0] is None or powers[1] is None:
        return False
    for kind in (_ANGLES, _NUMBERS):
        sums = [sum(power for symbol, power in of_unit if symbol in kind) for of_unit in powers if of_unit]
        if sums[0] != sums[-1]:
            return False
    return True


def _powers(unit: str) -> list[tuple[str, int]] | None:
    """Return the symbols of a unit with their powers; None for what is no product of symbols.

    >>> _powers("A/(deg/s^2)")
    [('A', 1), ('deg', -1), ('s', 2)]
    """
    text = "".join(unit.split()) if re.search(r"\s[*/]|[*/]\s", unit) else unit.strip().replace(" ", "*")
    found: list[tuple[str, int]] = []
    groups, sign, expects, at = [1], 1, True, 0
    while at < len(text):
        match = _SYMBOL.match(text, at)
        if match is None:
            return None
        at, part = match.end(), match[0]
        if expects != (part not in _BETWEEN) or (part == ")" and len(groups) == 1):
            return None
        if part == "(":
            groups.append(sign)
        elif part == ")":
            groups.pop()
        elif part in _BETWEEN:
            sign, expects = (-groups[-1] if part == "/" else groups[-1]), True
        else:
            expects = False
            if match[1]:
                found.append((match[1], sign * (2 if part.endswith("²") else int(match[2] or 1))))
    return None if expects or len(groups) > 1 else found


def parse_quantity(text: str, kind: Kind, *, name: str) -> float:
    """Read a quantity with its unit and return it in the unit of ``kind``.

    Parameters
    ----------
    text
        One number and one unit, as in ``"50 inch/min"``. A bare number is refused.
    kind
        What is expected; its ``unit`` is the unit of the result.
    name
        The option or key, for the error message.

    Returns
    -------
    float
        The finite value in ``kind.unit``.

    Raises
    ------
    ArgumentError
        No number, no unit, a unit of another dimension, or a value that is not finite.

    Examples
    --------
    >>> parse_quantity("500kHz", FREQUENCY, name="--frequency")
    500000.0
    >>> round(parse_quantity("50 inch/min", SPEED, name="feed"), 6)
    21.166667
    """
    article = "an" if kind.name[0] in "aeiou" else "a"
    allowed = f"{article} {kind.name} with its unit, such as {kind.examples}"
    if not isinstance(text, str):
        raise ArgumentError(name, text, allowed, "write the unit behind the number, in quotes")
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise ArgumentError(name, repr(text[:60]), allowed)
    if match["unit"] is None:
        raise ArgumentError(name, repr(text), allowed, "write the unit behind the number")
    factor = _factor(match["unit"].strip(), kind.unit)
    if factor is None:
        raise ArgumentError(name, repr(text), allowed)
    value = float(match["number"]) * factor
    if not math.isfinite(value):
        raise ArgumentError(name, repr(text), allowed, "the value is not finite")
    return value


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

    Returns
    -------
    float
        Finite.

    Raises
    ------
    ArgumentError
        No number, no unit, a unit of another dimension, or a value that is not finite.

    Examples
    --------
    >>> parse_in("12.3 um", "um", name="backlash", inside=1000.0), parse_in("0.25 inch", "mm", name="period")
    (0.0123, 6.35)
    >>> parse_in("20 ppm", "um/m", name="scale", inside=1e6)
    2e-05
    """
    allowed = f"a number with its unit, such as '1.5 {unit}'"
    if not isinstance(text, str):
        raise ArgumentError(name, repr(text)[:60], allowed, "write the unit behind the number, in quotes")
    match = _QUANTITY.fullmatch(text) if len(text) <= 2 * _LONGEST_NUMBER else None
    if match is None or len(match["number"]) > _LONGEST_NUMBER:
        raise ArgumentError(name, repr(text[:60]), allowed)
    if match["unit"] is None:
        raise ArgumentError(name, repr(text[:60]), allowed, "write the unit behind the number")
    given = match["unit"].strip()
    factor = 1.0 if given == unit else _factor(given, unit)
    if factor is None:
        raise ArgumentError(name, repr(text[:60]), allowed)
    value = _rounded(Fraction(match["number"]) * Fraction(repr(factor)) / Fraction(inside))
    if not math.isfinite(value):
        raise ArgumentError(name, repr(text[:60]), allowed, "the value is not finite")
    return value


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
        Finite; in units of the inside.
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
