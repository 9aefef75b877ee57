"""What a user says of a file, before anything in it is guessed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from rtec.errors import ArgumentError, nearest, unknown
from rtec.metrology.columns import UNITS_OF_QUANTITY, axis_of_heading, quantity_of_heading
from rtec.metrology.plain_numbers import LONGEST_SHOWN

IGNORE = "ignore"
"""What a column is mapped to that is to be left out."""
DECIMAL_MARKS = {"point": ".", "comma": ","}
_QUANTITIES = (*UNITS_OF_QUANTITY, "load")


@dataclass(frozen=True, slots=True, kw_only=True)
class ColumnChoices:
    """What a user says of the columns of a file.

    Parameters
    ----------
    columns
        What a column is, by its heading (in lower case) or by ``column N``, counted from 1: a heading as in
        measurement files, such as ``target_mm``, a quantity alone where the file states the unit, or ``ignore``.
    sheet
        The sheet of a workbook; None where it has a single one with a table in it.
    decimal
        ``.`` or ``,``; None to find it out.
    table
        The number of the table in a file or sheet that has several, counted from 1; None to find it out.
    axis
        The letter of one axis, of a log that has columns of several, such as ``target_x_mm``.
    of_several
        The same is said of several files, and not every one of them has every column.
    gaps
        Whether temperatures, and columns of no known quantity, may lack values: these are NaN then. Else rows without
        a temperature are left out, and a value that is not finite is refused.
    """

    columns: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    sheet: str | None = None
    decimal: str | None = None
    table: int | None = None
    axis: str | None = None
    of_several: bool = False
    gaps: bool = False

    def of_column(self, number: int, heading: str) -> str | None:
        """Return what a column was said to be, or None; ``number`` is counted from 1."""
        return self.columns.get(heading.strip().lower(), self.columns.get(f"column {number}"))


NO_CHOICES = ColumnChoices()


def column_choices(
    maps: Sequence[str] = (),
    *,
    sheet: str | None = None,
    decimal: str | None = None,
    table: int | None = None,
    axis: str | None = None,
) -> ColumnChoices:
    """Return the choices that options state.

    Parameters
    ----------
    maps
        Each ``HEADING=MEANING``, as of ``--map``.
    sheet
        Of ``--sheet``.
    decimal
        Of ``--decimal``: ``point`` or ``comma``.
    table
        Of ``--table``, from 1 on.
    axis
        Of ``--axis``: a letter.

    Raises
    ------
    ArgumentError
        No ``=``, a meaning that is none, a heading mapped twice, another decimal mark, or an axis that is no letter.

    Examples
    --------
    >>> column_choices(["Nominal [mm]=target_mm", "Humidity=ignore"]).of_column(1, "nominal [mm]")
    'target_mm'
    """
    columns: dict[str, str] = {}
    for text in maps:
        heading, equals, meaning = (part.strip() for part in text.rpartition("="))
        allowed = (
            "a heading of the file and what it is, such as 'nominal=target_mm', 'Dir=direction' or 'note=ignore'"
        )
        if not (equals and heading and meaning):
            raise ArgumentError("--map", repr(text[:80]), allowed)
        meaning = meaning.lower()
        if not _is_meaning(meaning):
            known = sorted(
                {f"{quantity}_{unit}" for quantity, units in UNITS_OF_QUANTITY.items() for unit in units if unit}
            )
            raise ArgumentError("--map", repr(text[:80]), allowed, nearest(meaning, [*known, *_QUANTITIES, IGNORE]))
        if columns.setdefault(heading.lower(), meaning) != meaning:
            raise ArgumentError("--map", repr(text[:80]), f"one meaning for each heading; {heading!r} has two")
    if decimal is not None and decimal not in DECIMAL_MARKS:
        raise unknown("--decimal", decimal, DECIMAL_MARKS)
    if axis is not None and not (len(axis) == 1 and axis.isascii() and axis.isalpha()):
        raise ArgumentError("--axis", repr(axis)[:60], "the letter of an axis, such as x")
    mark = None if decimal is None else DECIMAL_MARKS[decimal]
    letter = None if axis is None else axis.lower()
    return ColumnChoices(columns=columns, sheet=sheet, decimal=mark, table=table, axis=letter)


def as_option(heading: str, meaning: str, otherwise: str = "HEADING") -> str:
    """Return the option that says what a column is, in quotes for the shell.

    ``otherwise`` stands for a heading that cannot be typed in an instant: a long one, or one with quotes.

    Examples
    --------
    >>> as_option("Soll [mm]", "target_mm"), as_option("Machine 'A'", "target_mm", "column 2")
    ("--map 'Soll [mm]=target_mm'", "--map 'column 2=target_mm'")
    """
    easy = len(heading) <= LONGEST_SHOWN and heading.isprintable() and "'" not in heading
    return f"--map '{heading if easy and heading else otherwise}={meaning}'"


def _is_meaning(text: str) -> bool:
    """Return whether a text is a heading of measurement files, a quantity that lacks its unit, or ``ignore``."""
    bare = text == IGNORE or text in _QUANTITIES or text == "command" or text.startswith("temperature_")
    return bare or quantity_of_heading(text) is not None or axis_of_heading(text) is not None
