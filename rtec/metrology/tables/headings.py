"""What the heading of a column means: by its name where the file keeps to ours, else by the sense of its words.

A *meaning* is a guess with a strength; between two columns `rtec.metrology.tables.placing` decides.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import IntEnum

from rtec.metrology.columns import (
    ColumnUnit,
    axis_of_heading,
    column_unit,
    quantity_of_heading,
    spelled_unit,
    units_lacking,
)
from rtec.metrology.tables.words import (
    ACTUAL,
    ANOTHER_ERROR,
    DEVIATION,
    DIRECTION,
    FILLERS,
    OTHERS,
    POSITION,
    RUN,
    STATISTIC,
    TARGET,
    TEMPERATURE,
    TIME,
    plain_words,
)

_BRACKETS = re.compile(r"[\[({<]([^\[\](){}<>]*)[\])}>]")
_BEHIND = re.compile(r"^(?P<name>.*?)(?:\s*[/,;:]\s*|\s+in\s+|\s+-\s+|[_\s]+)(?P<unit>[^\s_,;]+)$", re.IGNORECASE)
_ANOTHER_AXIS = re.compile(r"position_[0-9]{1,2}", re.ASCII | re.IGNORECASE)
_NO_UNIT = ("run", "direction")
_AXIS_LETTERS = frozenset("xyzabcuvw")
_LINEAR_AXES = frozenset("xyz")


class Strength(IntEnum):
    """How sure a meaning is: some of the words are strange, all are known, or the heading is one of ours."""

    WEAK = 1
    STRONG = 2
    EXACT = 3


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a heading seems to say."""

    quantity: str
    """As in `rtec.metrology.columns`, or ``position``, which is a target or an actual position."""
    unit: ColumnUnit | None
    """With its factor; None where no unit is stated."""
    strength: Strength
    """How sure that is."""


def meaning_of(heading: str, unit_cell: str = "") -> Meaning | None:
    """Return what a heading seems to say, or None; a unit that does not belong to the quantity is none of its own.

    Examples
    --------
    >>> found = meaning_of("Abweichung (µm)")
    >>> found.quantity, found.unit.factor, found.strength.name
    ('deviation', 0.001, 'STRONG')
    >>> meaning_of("dir").quantity, meaning_of("Position", "mm").unit.inside, meaning_of("operator")
    ('direction', 'mm', None)
    >>> meaning_of("target_mm").strength.name, meaning_of("mean error [µm]")
    ('EXACT', None)
    """
    if (ours := quantity_of_heading(heading)) is not None:
        return Meaning(*ours, Strength.EXACT)
    if axis_of_heading(heading) is not None:
        return None  # where another axis stood: kept under its heading, as `rtec.dataset` wants it
    if _ANOTHER_AXIS.fullmatch(heading.strip()) is not None and units_lacking(heading) is not None:
        return Meaning(heading.strip().lower(), None, Strength.EXACT)
    name, unit = named_and_unit(heading)
    unit = unit or unit_below(unit_cell)
    words = plain_words(name)
    quantity = _quantity(words, unit)
    if quantity is None:
        return None
    strange = [word for word in words if not (_is_known(word) or word.isdigit() or len(word) == 1)]
    strength = Strength.STRONG if not strange or quantity.startswith("temperature") else Strength.WEAK
    if quantity in _NO_UNIT:
        return None if unit else Meaning(quantity, ColumnUnit("", 1.0), strength)
    if units_lacking(heading) is not None and not unit:
        strength = Strength.EXACT
    return Meaning(quantity, column_unit(quantity, unit) if unit else None, strength)


def named_and_unit(heading: str) -> tuple[str, str | None]:
    """Return a heading without its unit, and the unit as `spelled_unit` returns it.

    Examples
    --------
    >>> named_and_unit("Position [mm]"), named_and_unit("Error_um"), named_and_unit("X axis (old)")
    (('Position', 'mm'), ('Error', 'um'), ('X axis (old)', None))
    """
    for bracket in _BRACKETS.finditer(heading):
        if (unit := spelled_unit(bracket[1])) is not None:
            return f"{heading[: bracket.start()]} {heading[bracket.end() :]}".strip(), unit
    text = heading.strip()
    if (parts := _BEHIND.match(text)) is not None and (unit := spelled_unit(parts["unit"])) is not None:
        # a lone letter behind a name is the axis, unless a sign says that it is a unit
        if len(parts["unit"]) > 1 or text[len(parts["name"]) :].strip()[0] in "/,;:_":
            return parts["name"].strip(), unit
    return text, None


def contradicting_units(heading: str, unit_cell: str = "") -> tuple[str, str] | None:
    """Return two units that a heading states, or a heading and the row of units below it, where they differ.

    Examples
    --------
    >>> contradicting_units("Error [µm]", "mm"), contradicting_units("Error [µm]", "(µm)")
    (('um', 'mm'), None)
    >>> contradicting_units("deviation_um [mm]"), contradicting_units("deviation_um (µm)")
    (('um', 'mm'), None)
    """
    name, unit = named_and_unit(heading)
    brackets = [spelled_unit(bracket[1]) for bracket in _BRACKETS.finditer(heading)]
    units = [_suffix(name), *brackets, _suffix(heading) or unit, unit_below(unit_cell)]
    stated = [unit for unit in units if unit]
    return next(((stated[0], other) for other in stated if other != stated[0]), None)


def _suffix(heading: str) -> str | None:
    """Return the unit behind the underscore of a heading that is one of ours."""
    ours = quantity_of_heading(heading)
    return heading.rpartition("_")[2].lower() if ours is not None and ours[1].inside else None


def unit_below(cell: str) -> str | None:
    """Return the unit that stands in a row of units, with or without brackets, or None."""
    bare = cell.strip()
    return spelled_unit(bare) or (spelled_unit(bare[1:-1]) if len(bare) > 2 and bare[0] in "[(" else None)


def _is_known(word: str) -> bool:
    groups = (DEVIATION, ACTUAL, TARGET, POSITION, DIRECTION, RUN, TIME, TEMPERATURE, FILLERS, *OTHERS.values())
    return any(word in group for group in groups)


def _quantity(words: list[str], unit: str | None) -> str | None:
    """Return the quantity that words name; a unit decides where a word could be several things."""
    said = set(words)
    if not said or said & STATISTIC or said & ANOTHER_ERROR:
        return None
    if words == ["command"] and not _fits("target", unit):
        return None  # a commanded voltage is no target: kept under its heading, as `rtec train --dynamic` wants it
    if said & TARGET and said & ACTUAL and not said & DEVIATION:
        return _difference(words)
    alone = len(words) == 1 and unit is not None
    of_drive = {name: said & group and not said & TARGET and _fits(name, unit) for name, group in OTHERS.items()}
    rules = {
        _temperature(words): unit in ("degc", "degf") or (said & TEMPERATURE and unit in (None, "k")),
        "deviation": said & DEVIATION,
        "direction": said & DIRECTION,
        **of_drive,
        "time": said & TIME or (alone and words[0] == "t" and _fits("time", unit)),
        "run": said & RUN,
        "actual": said & ACTUAL,
        "target": said & TARGET,
        "position": said & POSITION or _is_axis(words, unit),
    }
    return next((quantity for quantity, is_it in rules.items() if is_it), None)


def _is_axis(words: list[str], unit: str | None) -> bool:
    """Return whether a heading is the letter of an axis: without a unit, only those of the three linear ones."""
    letters = _LINEAR_AXES if unit is None else _AXIS_LETTERS
    return len(words) == 1 and words[0] in letters and _fits("position", unit)


def _fits(quantity: str, unit: str | None) -> bool:
    return unit is None or column_unit(quantity, unit) is not None


def _temperature(words: list[str]) -> str:
    """Return the quantity of a temperature: what is left of its words is its name."""
    name = [word for word in words if word not in TEMPERATURE and word.isascii() and word.isalnum()]
    return "_".join(["temperature", *name])


def _difference(words: list[str]) -> str | None:
    """Return ``deviation`` for *actual minus target*; the other way round it is none."""
    first = next(word for word in words if word in TARGET or word in ACTUAL)
    return "deviation" if first in ACTUAL else None
