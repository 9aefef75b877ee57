"""Which column of a table is what: our own headings first, then what the user said, then the sense of the words.

Nothing is guessed in silence: what was taken for something is noted, and where a column looks like a target, an
actual position, a deviation or a direction and cannot be placed, the user is asked.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from rtec.errors import ArgumentError, meant
from rtec.metrology.columns import ColumnUnit, axis_of_heading, column_unit, quantity_of_heading, units_lacking
from rtec.metrology.plain_numbers import shown
from rtec.metrology.tables.choices import IGNORE, ColumnChoices
from rtec.metrology.tables.headings import (
    Meaning,
    Strength,
    contradicting_units,
    meaning_of,
    named_and_unit,
    unit_below,
)
from rtec.metrology.tables.table import Table

_WORDS = {
    "target": "the target",
    "actual": "the actual position",
    "deviation": "the deviation",
    "direction": "the direction of approach",
    "run": "the number of the run",
    "position": "a position",
}
_DRIVE = ("force", "current", "torque", "voltage")
_EXAMPLES = {"target": "target_mm", "actual": "actual_mm", "deviation": "deviation_um", "position": "target_mm"}


@dataclass(frozen=True, slots=True)
class Placed:
    """What the columns of a table are."""

    columns: Mapping[int, tuple[str, ColumnUnit | None]]
    """Quantity and unit by the index of the column; the unit is None for a time that dates have to tell."""
    ignored: frozenset[int]
    """Indices of columns that the user wants left out."""
    notes: tuple[str, ...]
    """What was taken for what."""


def place(table: Table, choices: ColumnChoices, passes: frozenset[int] = frozenset()) -> Placed:
    """Return what the columns of a table are, but for ``passes``, those of a wide table.

    Raises
    ------
    FileFormatError
        A unit that is missing or contradicts another one, two columns for the same, a target, position or deviation
        that cannot be placed.
    ArgumentError
        A choice for a column that the table has not.
    """
    said, ignored = _said(table, choices)
    meanings: dict[int, Meaning] = {}
    for index, heading in enumerate(table.headings):
        if index in ignored or index in passes:
            continue
        meaning = said.get(index) or meaning_of(heading, table.units[index])
        if index not in said:
            _refuse_contradiction(table, index)
        if meaning is not None:
            meanings[index] = meaning
    meanings = _with_roles(meanings, has_passes=bool(passes))
    chosen = _strongest(table, meanings, said)
    _refuse_unplaced(table, meanings, chosen, has_passes=bool(passes))
    notes = [_taken(table, index, meaning) for index, meaning in chosen.items() if meaning.strength < Strength.EXACT]
    columns = {index: (meaning.quantity, meaning.unit) for index, meaning in chosen.items()}
    notes += [
        f"column {shown(table.headings[index])} is not used: it looks like {_words(meaning.quantity)}, without a unit"
        for index, meaning in meanings.items()
        if index not in chosen and meaning.unit is None
    ]
    return Placed(columns, ignored, tuple(notes))


def _said(table: Table, choices: ColumnChoices) -> tuple[dict[int, Meaning], frozenset[int]]:
    said: dict[int, Meaning] = {}
    ignored = set()
    used = set()
    for index, heading in enumerate(table.headings):
        text = choices.of_column(index + 1, heading)
        if text is None:
            continue
        used |= {heading.strip().lower(), f"column {index + 1}"}
        if text == IGNORE:
            ignored.add(index)
            continue
        said[index] = _chosen_meaning(table, index, text)
    for key in choices.columns:
        if key not in used and not choices.of_several:
            have = ", ".join(table.headings)
            allowed = f"a heading of {table.source}: {have if len(have) <= 200 else have[:197] + '...'}"
            raise ArgumentError("--map", repr(key[:60]), allowed, meant(key, table.headings))
    return said, frozenset(ignored)


def _chosen_meaning(table: Table, index: int, text: str) -> Meaning:
    """Return what the user said of one column; the unit is that of the file where it was not said."""
    if (ours := quantity_of_heading(text)) is not None:
        return Meaning(*ours, Strength.EXACT)
    if (axis := axis_of_heading(text)) is not None:
        return Meaning(text, axis[1], Strength.EXACT)
    quantity = "target" if text == "command" else text
    unit = named_and_unit(table.headings[index])[1] or unit_below(table.units[index])
    found = None if unit is None else column_unit(quantity, unit)
    if found is None and quantity != "time":
        allowed = f"it with a unit, such as {units_lacking(quantity) or quantity + '_degc'}"
        raise ArgumentError("--map", repr(f"{table.headings[index]}={text}"), allowed, "the file states none")
    return Meaning(quantity, found, Strength.EXACT)


def _refuse_contradiction(table: Table, index: int) -> None:
    if (units := contradicting_units(table.headings[index], table.units[index])) is not None:
        problem = f"column {shown(table.headings[index])} states {' and '.join(units)}"
        allowed = f"one unit; or {table.as_choice(index, 'QUANTITY_UNIT')}, such as deviation_um, says which"
        raise table.refused(problem, allowed)


def _with_roles(meanings: dict[int, Meaning], *, has_passes: bool) -> dict[int, Meaning]:
    """Return the meanings with every position made a target or an actual position.

    A position beside a deviation, an actual position or the passes of a wide table is the target; beside a target, or
    with nothing to compare it to, it is where the axis was.
    """
    have = {meaning.quantity for meaning in meanings.values()}
    compared = has_passes or bool(have & {"deviation", "actual"})
    role = "target" if compared and "target" not in have else "actual"
    return {
        index: Meaning(role, meaning.unit, min(meaning.strength, Strength.STRONG))
        if meaning.quantity == "position"
        else meaning
        for index, meaning in meanings.items()
    }


def _strongest(table: Table, meanings: dict[int, Meaning], said: Mapping[int, Meaning]) -> dict[int, Meaning]:
    """Return the column of each quantity: the one that says it most clearly."""
    chosen: dict[int, Meaning] = {}
    for quantity in dict.fromkeys(meaning.quantity for meaning in meanings.values()):
        claims = [index for index, meaning in meanings.items() if meaning.quantity == quantity]
        usable = [index for index in claims if meanings[index].unit is not None or quantity == "time"]
        exact = [index for index in claims if meanings[index].strength is Strength.EXACT and index not in said]
        bare = next((index for index in exact if meanings[index].unit is None), None)
        if bare is not None and quantity != "time":
            heading = table.headings[bare]
            units = units_lacking(heading) or ""
            choice = table.as_choice(bare, units.partition(",")[0])
            allowed = f"{units}; {choice} says so without a change of the file"
            raise table.refused(f"column {shown(heading)} has no unit", allowed)
        best = max((meanings[index].strength for index in usable), default=None)
        top = [index for index in usable if meanings[index].strength is best]
        if quantity == "time" and all(meanings[index].unit is None for index in usable):
            top = [index for index in usable if meanings[index].strength > Strength.WEAK] or top
        if len(top) > 1 and (quantity != "time" or any(meanings[index].unit is not None for index in top)):
            _refuse_two(table, top, quantity)
        for index in top:  # a date and a time of day are one time
            chosen[index] = meanings[index]
    return dict(sorted(chosen.items()))


def _refuse_two(table: Table, top: list[int], quantity: str) -> None:
    first, second = (table.headings[index] for index in top[:2])
    problem = f"columns {shown(first)} and {shown(second)} both hold {shown(quantity)}"
    allowed = f"one column for each quantity; {table.as_choice(top[1], IGNORE)} leaves one out"
    raise table.refused(problem, allowed)


def _refuse_unplaced(
    table: Table, meanings: dict[int, Meaning], chosen: dict[int, Meaning], *, has_passes: bool
) -> None:
    """Ask about a column that looks like what the table lacks, and states no unit."""
    have = {meaning.quantity for meaning in chosen.values()}
    lacking = {name for name in ("target", "actual") if not have & {"target", "actual"}}
    if not has_passes and not have & {"deviation", *_DRIVE} and not {"target", "actual"} <= have:
        lacking |= {"target", "actual", "deviation"} - have
    for index, meaning in meanings.items():
        if index not in chosen and meaning.quantity in lacking:
            heading = table.headings[index]
            problem = f"column {shown(heading)} looks like {_words(meaning.quantity)}, but states no unit"
            choice = table.as_choice(index, _EXAMPLES[meaning.quantity])
            allowed = f"its unit, as in {choice}; or {table.as_choice(index, IGNORE)}"
            raise table.refused(problem, allowed)


def _words(quantity: str) -> str:
    return _WORDS.get(quantity, f"the {quantity.replace('_', ' ')}")


def _taken(table: Table, index: int, meaning: Meaning) -> str:
    below = f", in {table.units[index].strip('[()] ')}" if unit_below(table.units[index]) else ""
    return f"took column {shown(table.headings[index])} for {_words(meaning.quantity)}{below}"
