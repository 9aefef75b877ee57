"""Names of units: what each is of another, and which one is meant by a name that is nearly right."""

from __future__ import annotations

import difflib
import functools
import re
from typing import Any

from rtec.units.table import UNITS

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

_MET = {
    "Hz": "Hz kHz MHz",
    "s": "s ms us ns min h",
    "mm": "mm um inch m",
    "deg": "deg rad arcsec",
    "um": "um mm",
    "mm/s": "mm/s mm/min m/min m/s inch/min",
    "mm/s^2": "mm/s^2 m/s^2",
    "mm/s^3": "mm/s^3 m/s^3",
    "percent": "percent %",
    "1/s": "1/s 1/min",
    "Hz/s": "Hz/s kHz/s MHz/s GHz/s",
}
COMMON = {
    target: {name: UNITS[name].factor / UNITS[target].factor for name in names.split()}
    for target, names in _MET.items()
}
"""Units that nearly every command meets: read without the unit library, which takes 0.4 s to load."""
_SYMBOLS = ("Hz kHz MHz GHz s ms us ns ps min h mm um nm m cm km inch in deg rad arcsec arcmin rev rpm count counts "
            "N A mA V W kg K Pa hPa bar mbar percent ppm degC degF reading").split()  # fmt: skip
"""Symbols of which people get the case of a letter wrong."""
_IN_ANY_CASE = {symbol.casefold(): symbol for symbol in _SYMBOLS}


@functools.cache
def _registry() -> Any:
    import pint  # noqa: PLC0415 - 0.4 s, needed only where a quantity is read

    registry: Any = pint.UnitRegistry(cache_folder=None)
    return registry


def _spelled(text: str) -> str:
    """Return a unit as the unit library spells it."""
    plain = _POWER.sub(r"**\1", text.strip().replace("²", "^2"))
    plain = _REVOLUTION.sub("revolution", plain)
    # a temperature in a product is a difference of temperatures
    return _DEGREES.sub(r"delta_deg\1", plain) if re.search("[*/]", plain) else plain


@functools.cache
def factor_between(unit: str, target: str) -> float | None:
    """Return the factor from ``unit`` to ``target``, or None where they differ in dimension or are unknown."""
    common = 1.0 if unit == target else COMMON.get(target, {}).get(unit)
    if common is not None:
        return common
    if not _same_angles_and_numbers(unit, target):
        return None
    import pint  # noqa: PLC0415 - as above

    try:
        return float(_registry().Quantity(f"1 * {_spelled(unit)}").to(_spelled(target)).magnitude)
    except (pint.errors.PintError, ValueError, TypeError, AttributeError):
        return None


def _is_unit(unit: str) -> bool:
    import pint  # noqa: PLC0415 - as above

    if _powers(unit) is None:
        return False
    try:
        _registry().Quantity(f"1 * {_spelled(unit)}")
    except (pint.errors.PintError, ValueError, TypeError, AttributeError):
        return False
    return True


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


def suggested_unit(unit: str, target: str) -> str | None:
    """Return the unit that is meant by one in letters of another case or by one that is misspelled, or None.

    Letters count: mHz is a billionth of MHz. What the unit library would take and a machine never has is asked about.

    >>> [suggested_unit(unit, "Hz") for unit in ("khz", "mHz", "kherz", "kHz", "mm")]
    ['kHz', 'MHz', 'kHz', None, None]
    """
    common = COMMON.get(target, {target: 1.0})
    if unit in common:
        return None

    def in_its_case(match: re.Match[str]) -> str:
        return match[0] if match[0] in _SYMBOLS else _IN_ANY_CASE.get(match[0].casefold(), match[0])

    cased = re.sub(r"[A-Za-z]+", in_its_case, unit)
    if cased != unit and factor_between(cased, target) is not None:
        return cased
    if factor_between(unit, target) is not None or _is_unit(unit):
        return None
    known = {symbol.casefold(): symbol for symbol in common}
    near = difflib.get_close_matches(unit.casefold(), known, n=1, cutoff=0.6)
    return known[near[0]] if near else None
