"""Quantities as people write them ("500kHz", "50 inch/min", "2 us"), turned into the numbers of the inside.

Inside, time is int64 picoseconds and position is float64 millimetres or int64 counts. Units exist only at the edges:
the command line, TOML files and reports. The text is split into one number and one unit before the unit library sees
it, so that an expression such as ``9**9**9 Hz`` is refused and never evaluated.
"""

from __future__ import annotations

import functools
import math
import re
from dataclasses import dataclass
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
    r"\s*(?P<unit>(?:1/)?[A-Za-zµμ°%][A-Za-zµμ°%/^²\d ]{0,30})?\s*"
)
_POWER = re.compile(r"\^?([23])")


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
RATE = Kind("rate", "1/s", "16.7 1/s, 1000 1/min")


_COMMON = {
    "Hz": {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "mm": {"mm": 1.0, "um": 1e-3, "inch": MM_PER_INCH},
    "deg": {"deg": 1.0},
}
"""Units that nearly every command meets: read without the unit library, which takes 0.2 s to load."""


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
    import pint  # noqa: PLC0415 - as above

    def spelled(text: str) -> str:
        return _POWER.sub(r"**\1", text.strip().replace("²", "^2"))

    try:
        return float(_registry().Quantity(f"1 * {spelled(unit)}").to(spelled(target)).magnitude)
    except (pint.errors.PintError, ValueError, TypeError, AttributeError):
        return None


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
