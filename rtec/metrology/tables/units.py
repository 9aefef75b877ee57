"""Units as people write them in headings, and what they are of each quantity."""

from __future__ import annotations

from rtec.metrology.columns import ColumnUnit, column_units
from rtec.units import UNITS, Heading

_BY_SPELLING = {
    spelling: unit.column
    for unit in UNITS.values()
    if unit.heading is not Heading.NONE
    for spelling in (unit.column, *unit.words)
}
SPELLINGS = frozenset(_BY_SPELLING) | {spelling.replace("u", "µ") for spelling in _BY_SPELLING if spelling[0] == "u"}
"""All the ways in which units are written, in small letters."""

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
    return column_units(known, Heading.OURS, Heading.OTHERS).get(unit)
