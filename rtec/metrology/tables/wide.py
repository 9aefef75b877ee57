"""Wide tables: a column a run and direction, or a row a run and a column a target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rtec.metrology.tables.cells import Cell, looks_like_number
from rtec.metrology.tables.headings import named_and_unit
from rtec.metrology.tables.words import (
    ACTUAL,
    BACKWARD,
    DEVIATION,
    FILLERS,
    FORWARD,
    POSITION,
    RUN,
    STATISTIC,
    plain_words,
)

_FEWEST = 2
_LONGEST_NUMBER = 9
_SIGNS = frozenset("+-−–↑↓→←⇒⇐")


@dataclass(frozen=True, slots=True)
class Pass:
    """What a column of a wide table holds: one run in one direction."""

    column: int
    """Index of the column."""
    run: int | None
    direction: int | None
    """``run``, ``direction``: numbers, each None where the heading does not say it."""
    quantity: str | None
    """``deviation`` or ``actual``, or None where no word says which."""


def pass_of(column: int, heading: str, above: str = "") -> Pass | None:
    """Return the run and direction that a heading names, or None where it names something else.

    ``above`` is what spans the column in the line above, such as ``Forward``.

    Examples
    --------
    >>> pass_of(1, "Run 2 ↑"), pass_of(2, "3", "Reverse error")
    (Pass(column=1, run=2, direction=1, quantity=None), Pass(column=2, run=3, direction=-1, quantity='deviation'))
    >>> pass_of(3, "Temperature 1"), pass_of(4, "mean 1"), pass_of(5, "operator")
    (None, None, None)
    """
    words = [*plain_words(named_and_unit(above)[0]), *plain_words(named_and_unit(heading)[0])]
    if set(words) & STATISTIC:
        return None
    numbers = [int(word) for word in words if _is_number(word)]
    ways = {1 if word in FORWARD else -1 for word in words if _is_way(word, words)}
    rest = [word for word in words if not _is_number(word) and not _is_way(word, words)]
    known = DEVIATION | ACTUAL | RUN | FILLERS | _SIGNS
    if not (numbers or ways) or len(numbers) > 1 or len(ways) > 1 or not set(rest) <= known:
        return None
    said = set(rest)
    quantity = "deviation" if said & DEVIATION else "actual" if said & ACTUAL else None
    return Pass(column, numbers[0] if numbers else None, next(iter(ways), None), quantity)


def _is_number(word: str) -> bool:
    """Return whether a word may be the number of a run: nobody measures a milliard times."""
    return word.isdecimal() and len(word) <= _LONGEST_NUMBER


def _is_way(word: str, words: Sequence[str]) -> bool:
    """Return whether a word names a direction: a lone letter does so beside a number only."""
    if word in ("-", "–", "−") and words[-1] != word and not (words[0] == word and len(words) == _FEWEST):
        return False  # a dash between words
    if word in POSITION and not any(other.isdigit() for other in words):
        return False  # 'Pos.' is a position, '1 pos' a direction
    return (word in FORWARD or word in BACKWARD) and (len(word) > 1 or word in _SIGNS or len(words) <= _FEWEST)


def passes_of(headings: Sequence[str], above: Sequence[str], taken: frozenset[int]) -> list[Pass]:
    """Return the columns of a wide table, or nothing where it is none; ``taken`` ones are known to be something else.

    Examples
    --------
    >>> [p.run for p in passes_of(["Target", "1", "2", "3"], [""] * 4, frozenset({0}))]
    [1, 2, 3]
    >>> passes_of(["Target", "Error 1"], [""] * 2, frozenset({0}))
    []
    """
    found = [
        pass_of(column, heading, above[column])
        for column, heading in enumerate(headings)
        if heading and column not in taken
    ]
    passes = [one for one in found if one is not None]
    distinct = len({(one.run, one.direction, one.quantity) for one in passes}) == len(passes)
    return passes if len(passes) >= _FEWEST and distinct else []


def turned(headings: Sequence[str], rows: Sequence[Sequence[Cell]]) -> tuple[list[str], list[list[Cell]]] | None:
    """Return a table with a target a column as one with a target a row, or None where it is no such table.

    Examples
    --------
    >>> turned(["Target [mm]", "0", "100"], [["1 ↑", "0.5", "0.7"], ["1 ↓", "1.5", "1.8"]])
    (['Target [mm]', '1 ↑', '1 ↓'], [['0', '0.5', '1.5'], ['100', '0.7', '1.8']])
    """
    names = [str(row[0]) for row in rows]
    if len(headings) <= _FEWEST or not all(looks_like_number(heading) for heading in headings[1:]):
        return None
    if not rows or any(looks_like_number(name) and "+" not in name for name in names):
        return None
    if len([one for one in (pass_of(0, name) for name in names) if one is not None]) < len(names):
        return None
    columns = [[heading, *(row[column] for row in rows)] for column, heading in enumerate(headings) if column]
    return [headings[0], *names], columns
