"""Units as people write them in headings, and what they are of each quantity."""

from __future__ import annotations

import math

from rtec.metrology.columns import UNITS_OF_QUANTITY, ColumnUnit
from rtec.units import MM_PER_INCH

_SPELLINGS = {
    "mm": ("millimeter", "millimetre", "millimeters", "millimetres"),
    "um": ("micron", "microns", "mikron", "mikrometer", "micrometer", "micrometre", "mue", "mu", "my"),
    "nm": ("nanometer", "nanometre", "n m", "n*m", "n·m"),
    "m": ("meter", "metre"),
    "inch": ("in", "inches", "zoll", "in."),
    "thou": ("mil", "mils"),
    "uinch": ("uin", "uin.", "microinch", "microinches", "micro inch", "uinches"),
    "deg": ("°", "degree", "degrees", "grad"),
    "rad": ("radian", "radians"),
    "mrad": (),
    "urad": (),
    "arcmin": (),
    "arcsec": ("arc sec", "arc-sec", "arcseconds", "arc seconds", "winkelsekunden"),
    "rev": ("revs", "revolution", "revolutions", "turn", "turns", "umdr", "u"),
    "count": ("counts", "cts", "inc", "incs", "increments", "inkremente", "ticks", "lsb"),
    "s": ("sec", "secs", "second", "seconds", "sek", "sekunden"),
    "ms": ("msec", "milliseconds"),
    "us": ("usec",),
    "min": ("minutes", "minuten"),
    "h": ("hr", "hrs", "hours"),
    "degc": ("°c", "c", "deg c", "celsius", "grad c", "oc"),
    "degf": ("°f", "f", "deg f", "fahrenheit"),
    "k": ("kelvin",),
    "n": ("newton",),
    "kn": (),
    "a": ("amp", "amps", "ampere"),
    "ma": (),
    "v": ("volt", "volts"),
    "mv": (),
    "hpa": (),
    "mbar": (),
    "pa": (),
    "kpa": (),
    "bar": (),
    "mmhg": ("torr",),
    "inhg": (),
    "percent": ("%", "% rh", "%rh", "% rf", "%rf", "rh"),
    "mm_s": ("mm/s", "mm/sec"),
    "mm_min": ("mm/min",),
    "m_min": ("m/min",),
    "m_s": ("m/s",),
    "inch_min": ("in/min", "inch/min", "ipm"),
    "deg_s": ("°/s", "deg/s"),
    "rad_s": ("rad/s",),
    "rpm": ("1/min", "u/min", "rev/min", "min-1", "min^-1"),
}
_BY_SPELLING = {spelling: unit for unit, others in _SPELLINGS.items() for spelling in (unit, *others)}
SPELLINGS = frozenset(_BY_SPELLING) | {spelling.replace("u", "µ") for spelling in _BY_SPELLING if spelling[0] == "u"}
"""All the ways in which units are written, in small letters."""

_MORE = {
    "position": {
        "thou": ColumnUnit("mm", MM_PER_INCH / 1000.0),
        "uinch": ColumnUnit("mm", MM_PER_INCH / 1e6),
        "mrad": ColumnUnit("deg", 0.18 / math.pi),
        "urad": ColumnUnit("deg", 0.18e-3 / math.pi),
        "arcmin": ColumnUnit("deg", 1.0 / 60.0),
    },
    "force": {"kn": ColumnUnit("n", 1e3)},
    "current": {"ma": ColumnUnit("a", 1e-3)},
    "voltage": {"mv": ColumnUnit("v", 1e-3)},
    "pressure": {
        "kpa": ColumnUnit("hpa", 10.0),
        "mmhg": ColumnUnit("hpa", 1.33322387415),
        "inhg": ColumnUnit("hpa", 33.86389),
    },
}
_POSITIONS = ("target", "actual", "deviation", "position")


def spelled_unit(text: str) -> str | None:
    """Return the unit that a text is, whatever way it is spelled, or None.

    Examples
    --------
    >>> spelled_unit("µm"), spelled_unit("°C"), spelled_unit("Zoll"), spelled_unit("axis 1")
    ('um', 'degc', 'inch', None)
    >>> spelled_unit("µ"), spelled_unit("u")
    ('um', 'rev')
    """
    if text.strip(" []") in ("µ", "μ"):
        return "um"
    plain = " ".join(text.replace("µ", "u").replace("μ", "u").lower().split()).removesuffix("]").removeprefix("[")
    return _BY_SPELLING.get(plain.strip())


def column_unit(quantity: str, unit: str) -> ColumnUnit | None:
    """Return a unit of a quantity with its factor, or None where the quantity has no such unit.

    Parameters
    ----------
    quantity
        ``target``, ``temperature_nut``, ...; ``position`` stands for target or actual.
    unit
        As `spelled_unit` returns it.

    Examples
    --------
    >>> column_unit("deviation", "um"), column_unit("time", "um")
    (ColumnUnit(inside='mm', factor=0.001, offset=0.0), None)
    """
    first = quantity.partition("_")[0]
    known = "target" if first in _POSITIONS else first
    more = _MORE.get("position" if first in _POSITIONS else first, {})
    return UNITS_OF_QUANTITY.get(known, {}).get(unit) or more.get(unit)
