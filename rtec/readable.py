"""Numbers as people read them: the digits that the error allows, in a unit that suits the size.

For people only. Files, JSON and models keep the unit that a quantity has by contract, and all digits.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from rtec.units import PS_PER, UNITS, symbol

MISSING = "–"
"""Stands where a figure is not defined."""
_PLAIN = (-6, 9)
"""Powers of ten of a number that is written without an exponent."""
_DIGITS = 4
"""Of a number whose error is not known."""


@dataclass(frozen=True, slots=True)
class _Rung:
    """A unit, and which numbers read well in it: from least on, below most."""

    unit: str
    least: float
    most: float

    def of(self, other: _Rung) -> float:
        """Return how many of this unit the other is; one is a whole number of times the other."""
        ratio = UNITS[other.unit].factor / UNITS[self.unit].factor
        return float(round(ratio)) if ratio >= 1.0 else 1.0 / round(1.0 / ratio)


def _thousands(*units: str) -> tuple[_Rung, ...]:
    """Return a ladder of units that are a thousand times each other: 0.1 to 10 000 reads well, the ends are open."""
    last = len(units) - 1
    return tuple(
        _Rung(unit, 0.1 if k else 0.0, math.inf if k == last else 100.0 if k == 0 else 1e4)
        for k, unit in enumerate(units)
    )


_LADDERS = (
    _thousands("nm", "um", "mm", "m"),
    _thousands("mN", "N", "kN"),
    _thousands("mN*m", "N*m", "kN*m"),
    _thousands("uA", "mA", "A", "kA"),
    _thousands("uV", "mV", "V", "kV"),
    (_Rung("arcsec", 0.0, 600.0), _Rung("arcmin", 1.0, 60.0), _Rung("deg", 0.1, math.inf)),
    (
        *_thousands("ns", "us", "ms", "s")[:3],
        _Rung("s", 0.1, 600.0),
        _Rung("min", 1.0, 180.0),
        _Rung("h", 1.0, math.inf),
    ),
)
"""Units of one dimension, ascending."""
_RUNGS = {rung.unit: (ladder, k) for ladder in _LADDERS for k, rung in enumerate(ladder)}


def suited_unit(size: float, unit: str) -> tuple[str, float]:
    """Return the unit that suits a size, and the factor to it.

    A number that reads well stays in its unit; of a quotient the upper unit is changed.

    Parameters
    ----------
    size
        Of the quantity, in ``unit``; 0 and what is not finite leave the unit as it is.
    unit
        As in files.

    Returns
    -------
    tuple
        The unit, and by what a number in ``unit`` is multiplied.

    Examples
    --------
    >>> suited_unit(765752.0, "arcsec"), suited_unit(0.02, "mm"), suited_unit(6.35, "mm")
    (('deg', 0.0002777777777777778), ('um', 1000.0), ('mm', 1.0))
    >>> suited_unit(0.0008, "A/(deg/s)"), suited_unit(5e4, "count"), suited_unit(9000.0, "s")[0]
    (('mA/(deg/s)', 1000.0), ('count', 1.0), 'min')
    """
    upper, stroke, lower = unit.partition("/")
    # degrees a second are no arc minutes a second to anybody
    known = _RUNGS.get(upper) if not (stroke and upper == "deg") else None
    if known is None or not math.isfinite(size) or size == 0.0:
        return unit, 1.0
    ladder, k = known
    own = ladder[k]
    while abs(size) * ladder[k].of(own) >= ladder[k].most:
        k += 1
    while abs(size) * ladder[k].of(own) < ladder[k].least:
        k -= 1
    return ladder[k].unit + stroke + lower, ladder[k].of(own)


def quantity_text(
    value: float, unit: str = "", error: float | None = None, *, digits: int = _DIGITS, size: float | None = None
) -> str:
    """Return a quantity with its standard error in a unit that suits both.

    Parameters
    ----------
    value
        In ``unit``.
    unit
        As in files; empty for a pure number.
    error
        Standard error, in ``unit``; None, 0 or not finite where it is not known.
    digits
        Of a value whose error is not known; zeros at its end are left out.
    size
        Of the quantity with which it shares its unit, in ``unit``; None: its own.

    Returns
    -------
    str
        Two digits of the error and the value to the same decimal place.

    Examples
    --------
    >>> quantity_text(12.3456, "um", 0.234), quantity_text(24.0), quantity_text(0.5, "ms", 40.0)
    ('12.35 ± 0.23 µm', '24', '0 ± 40 ms')
    >>> quantity_text(765752.0, "arcsec", 5123.0), quantity_text(0.01234, "um"), quantity_text(1.5, "ms", 0.0996)
    ('212.7 ± 1.4 deg', '12.34 nm', '1.50 ± 0.10 ms')
    """
    if not math.isfinite(value):
        return MISSING
    unit, factor = suited_unit(_size(value, error) if size is None else size, unit)
    tail = f" {symbol(unit)}" if unit else ""
    if error is not None and 0.0 < error < math.inf:
        return _with_error(value * factor, error * factor) + tail
    return _shortened(rounded(value * factor, digits)) + tail


def common_size(pairs: Iterable[tuple[float, float | None]]) -> float:
    """Return the size of several quantities with their errors that are to share a unit: that of the largest.

    Examples
    --------
    >>> common_size([(3.0, 0.1), (-8.0, None), (0.0, 0.5)])
    8.0
    """
    return max((_size(value, error) for value, error in pairs if math.isfinite(value)), default=0.0)


def _size(value: float, error: float | None) -> float:
    return max(abs(value), error) if error is not None and 0.0 < error < math.inf else abs(value)


def _with_error(value: float, error: float) -> str:
    """Return value ± error, rounded to two digits of the error; very large and small ones with a power of ten."""
    last = _power(error, 2) - 1
    top = max(last, _power(value, 2) if value else last)
    power = 0 if _PLAIN[0] - 4 <= last and top <= _PLAIN[1] else top
    decimals = max(power - last, 0)
    mantissas = (round(x / 10.0**power, power - last) + 0.0 for x in (value, error))
    number, spread = (f"{x:.{decimals}f}".replace("-", "−") for x in mantissas)
    return f"{number} ± {spread}" if power == 0 else f"({number} ± {spread})e{power:+03d}"


def _power(value: float, digits: int) -> int:
    """Return the power of ten of a number once it is rounded to so many digits."""
    return int(f"{value:.{digits - 1}e}".partition("e")[2])


def _shortened(text: str) -> str:
    number, e, power = text.partition("e")
    return (number.rstrip("0").rstrip(".") if "." in number else number) + e + power


def rounded(value: float, digits: int) -> str:
    """Return a number with so many digits, without an exponent where that can be read.

    Examples
    --------
    >>> rounded(1234.6, 3), rounded(0.0123456, 3), rounded(9.996, 3), rounded(1.2e-9, 3), rounded(-0.0, 3)
    ('1235', '0.0123', '10.0', '1.20e-09', '0')
    """
    if not math.isfinite(value):
        return MISSING
    if value == 0.0:
        return "0"
    power = _power(value, digits)
    text = f"{value:.{max(digits - 1 - power, 0)}f}" if _PLAIN[0] < power < _PLAIN[1] else f"{value:.{digits - 1}e}"
    return "−" + text[1:] if value < 0.0 else text


def time_text(time_ps: int | None) -> str:
    """Return a time of the signal path for people.

    Examples
    --------
    >>> time_text(1_620_500), time_text(60), time_text(None)
    ('1.6205 us', '60 ps', 'none')
    """
    if time_ps is None:
        return "none"
    for unit, ps in PS_PER.items():
        if abs(time_ps) >= ps > 1:
            return f"{time_ps / ps:.6g} {unit}"
    return f"{time_ps} ps"


def hertz_text(hertz: float, digits: int = 6) -> str:
    """Return a frequency for people, with so many digits.

    Examples
    --------
    >>> hertz_text(500e3), hertz_text(27_777.8), hertz_text(27_777.8, 3), hertz_text(400.0)
    ('500 kHz', '27.7778 kHz', '27.8 kHz', '400 Hz')
    """
    for unit in ("THz", "GHz", "MHz", "kHz"):
        if hertz >= UNITS[unit].factor:
            return f"{hertz / UNITS[unit].factor:.{digits}g} {unit}"
    return f"{hertz:.{digits}g} Hz"


def printable(text: str) -> str:
    r"""Return text of one line without signs that cannot be shown.

    Examples
    --------
    >>> printable("z axis\x00\ud800, 1 inch")
    'z axis��, 1 inch'
    """
    return "".join(sign if sign.isprintable() else "\ufffd" for sign in " ".join(text.split()))
