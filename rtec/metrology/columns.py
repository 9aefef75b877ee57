"""Columns of a measurement: which quantity a heading names, and the factor from its unit to the unit inside."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from rtec.units import UNITS, Heading


@dataclass(frozen=True, slots=True)
class ColumnUnit:
    """A unit as a heading spells it: the unit inside, and inside = (value + offset) * factor."""

    inside: str
    factor: float
    offset: float = 0.0


_POSITION = ("length", "angle", "revolutions", "counts")
_DIMENSIONS = {
    "time": ("time",),
    "target": _POSITION,
    "actual": _POSITION,
    "deviation": _POSITION,
    "velocity": ("speed", "angular speed"),
    "feed": ("speed", "angular speed"),
    "temperature": ("temperature",),
    "force": ("force",),
    "current": ("current",),
    "voltage": ("voltage",),
    "torque": ("torque",),
    "pressure": ("pressure",),
    "humidity": ("share",),
}
"""What the quantities of a measurement file may be measured in."""
_INSIDE = {unit.dimension: unit.column for unit in reversed(UNITS.values())}
"""The first unit of each dimension is the one inside."""
_NONE = {"": ColumnUnit("", 1.0)}


def column_units(quantity: str, *headings: Heading) -> dict[str, ColumnUnit]:
    """Return the units of a quantity in the headings of such files."""
    return {
        unit.column: ColumnUnit(_INSIDE[unit.dimension], unit.factor, unit.offset)
        for unit in UNITS.values()
        if unit.dimension in _DIMENSIONS.get(quantity, ()) and unit.heading in headings
    }


_DEG_S_PER_RPM = 6.0
UNITS_OF_QUANTITY = {"run": _NONE, "direction": _NONE} | {
    quantity: column_units(quantity, Heading.OURS) for quantity in _DIMENSIONS
}
UNITS_OF_QUANTITY["spindle"] = {
    name: ColumnUnit("rpm", unit.factor / _DEG_S_PER_RPM)
    for name, unit in UNITS_OF_QUANTITY["velocity"].items()
    if unit.inside == "deg_s"
}
"""Quantities of a measurement file and the units their headings may carry; the unit inside is one of them too."""

_SYNONYMS = {"command": "target"}
_AXIS = re.compile(r"position_([0-9]{1,2})(?:_([a-z]+))?", re.ASCII)
MOST_AXES = 15
"""That a machine on a bus has (`rtec.link`)."""
_ANY_UNIT = re.compile(r"[a-z][a-z0-9]{0,15}", re.ASCII)
"""Of a load: a mass, a force, a torque or a share of what is rated, whatever the file says."""
_BY_SPELLING = {
    spelling: unit.column
    for unit in UNITS.values()
    if unit.heading is not Heading.NONE
    for spelling in (unit.column, *unit.words)
}
SPELLINGS = frozenset(_BY_SPELLING) | {spelling.replace("u", "µ") for spelling in _BY_SPELLING if spelling[0] == "u"}
"""All the ways in which units are written, in small letters."""

_PLACES = ("target", "actual", "deviation", "position")


def quantity_of_heading(heading: str) -> tuple[str, ColumnUnit] | None:
    """Return the quantity and unit that a heading names, or None where it names none.

    Parameters
    ----------
    heading
        Quantity, ``_``, unit, without regard to case. ``command`` is another word for ``target``;
        ``temperature_NAME_degc`` is a quantity of its own for each name, ``temperature_NAME_c`` the same;
        ``load_UNIT`` has any unit.

    Examples
    --------
    >>> quantity_of_heading("command_inch")
    ('target', ColumnUnit(inside='mm', factor=25.4, offset=0.0))
    >>> quantity_of_heading("temperature_nut_degF")[0]
    'temperature_nut'
    >>> quantity_of_heading("pulse_v") is None
    True
    """
    text = heading.strip().lower()
    if text in _SYNONYMS:
        text = _SYNONYMS[text]
    if text in ("run", "direction"):
        return text, _NONE[""]
    first, _, unit = text.partition("_")
    name = first = _SYNONYMS.get(first, first)
    if first == "temperature" and "_" in unit:
        inner, _, unit = unit.rpartition("_")
        name = f"temperature_{inner}"
        unit = f"deg{unit}" if unit in ("c", "f") else unit
    if first == "load" and _ANY_UNIT.fullmatch(unit):
        return "load", ColumnUnit(unit, 1.0)
    found = UNITS_OF_QUANTITY.get(first, {}).get(unit) if unit else None
    return None if found is None else (name, found)


def channel_of_heading(heading: str) -> tuple[str, ColumnUnit]:
    """Return the name of a column of no known quantity, and its unit, which may be none.

    Examples
    --------
    >>> channel_of_heading("ch3_um")
    ('ch3', ColumnUnit(inside='mm', factor=0.001, offset=0.0))
    >>> channel_of_heading("Count")
    ('count', ColumnUnit(inside='', factor=1.0, offset=0.0))
    """
    text = heading.strip().lower()
    name, _, last = text.rpartition("_")
    column = spelled_unit(last) if name else None
    unit = next((unit for unit in UNITS.values() if unit.column == column), None)
    if unit is None:
        return text, _NONE[""]
    return name, ColumnUnit(_INSIDE[unit.dimension], unit.factor, unit.offset)


def axis_of_heading(heading: str) -> tuple[int, ColumnUnit] | None:
    """Return the number of the axis whose position a heading names, and its unit; None where it names none.

    Such columns tell where the other axes of a machine stood, with the names of `rtec.predictors.Model.inputs`.

    Parameters
    ----------
    heading
        ``position_NUMBER_UNIT``, without regard to case; a number from 1 to 15, a unit of length.

    Examples
    --------
    >>> axis_of_heading("Position_2_inch")
    (2, ColumnUnit(inside='mm', factor=25.4, offset=0.0))
    >>> axis_of_heading("position_2_deg") is axis_of_heading("position_16_mm") is None
    True
    """
    found = _AXIS.fullmatch(heading.strip().lower())
    unit = UNITS_OF_QUANTITY["target"].get(found[2] or "") if found else None
    if found is None or unit is None or unit.inside != "mm" or not 1 <= int(found[1]) <= MOST_AXES:
        return None
    return int(found[1]), unit


def units_lacking(heading: str) -> str | None:
    """Return the headings that were probably meant where ``heading`` is a bare quantity that needs a unit.

    Examples
    --------
    >>> units_lacking("time")
    'time_s, time_ms, time_us, time_min, time_h'
    >>> units_lacking("pulse") is None
    True
    """
    text = heading.strip().lower()
    units: Iterable[str] | None = UNITS_OF_QUANTITY.get(_SYNONYMS.get(text, text))
    if units is None and (axis := _AXIS.fullmatch(text)) and not axis[2]:
        units = [unit for unit, what in UNITS_OF_QUANTITY["target"].items() if what.inside == "mm"]
    if units is None or "" in units:
        return None
    return ", ".join(f"{text}_{unit}" for unit in units)


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

    The unit is as `spelled_unit` returns it; the quantity ``position`` stands for target or actual.

    Examples
    --------
    >>> column_unit("deviation", "um"), column_unit("time", "um")
    (ColumnUnit(inside='mm', factor=0.001, offset=0.0), None)
    """
    first = quantity.partition("_")[0]
    known = "target" if first in _PLACES else first
    return column_units(known, Heading.OURS, Heading.OTHERS).get(unit)
