"""Where one table of a file ends and another begins: headings below rows, or the name of a run between them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from rtec.metrology.plain_numbers import shown
from rtec.metrology.tables.cells import Cell, looks_like_number
from rtec.metrology.tables.grid import Grid, is_row, is_unit_row
from rtec.metrology.tables.headings import meaning_of
from rtec.metrology.tables.wide import pass_of
from rtec.metrology.tables.words import (
    AXIS,
    BACKWARD,
    DIRECTION,
    FORWARD,
    POSITION,
    RUN,
    STATISTIC,
    TARGET,
    plain_words,
)

WORD = re.compile(r"[^\W\d_eE]|#")
"""What no line of plain numbers holds."""
_TELLING = RUN | DIRECTION | TARGET | POSITION | AXIS
_TELLING |= {word for word in FORWARD | BACKWARD if len(word) > 1}
_FEWEST = 2
_MOST_NAMED = 3


@dataclass(frozen=True, slots=True)
class Block:
    """The lines of one table: where its titles begin, its headings, its first row, and the line behind it.

    A block below the name of a run has the headings of the one before it.
    """

    head: int
    header: int
    first: int
    stop: int

    def titles(self, grid: Grid, above: Sequence[int]) -> tuple[str, ...]:
        """Return the lines that name the table: those above its headings, or the one below the rows before it."""
        own = [self.head] if self.header < self.head else above
        return tuple(" ".join(str(field) for field in grid.fields(index) if field != "") for index in own)


def blocks_of(grid: Grid, head: int, header: int, *, below: bool) -> list[Block]:
    """Return the tables among the lines, in their order, from the first line that may be a title.

    One of them has its headings at ``header``; with ``below``, others are looked for below it, too.
    """
    known = _plain(grid.fields(header))
    found: list[Block] = []
    current, title = header, head
    last_row = -1
    for index in range(head, grid.size if below else header + 1):
        if grid.is_blank(index) and index != header:
            continue
        fields = grid.fields(index)
        if index == header or (len(known) > 1 and _plain(fields) == known) or _is_heading(grid, index, fields):
            current, title = index, last_row + 1 if last_row >= 0 else head
            found.append(Block(title, index, index + 1, grid.size))
        elif found and is_row(fields):
            last_row = index
        elif found and _names_a_part(fields, after_blank=index > 0 and grid.is_blank(index - 1)):
            found.append(Block(index, current, index + 1, grid.size))
    return _closed(grid, found, header)


def _closed(grid: Grid, found: list[Block], header: int) -> list[Block]:
    """Return those blocks that hold a row, each up to where the titles of the next of them begin."""
    stops = [*(block.head for block in found[1:]), grid.size]
    full = [
        block
        for block, stop in zip(found, stops, strict=True)
        if any(is_row(grid.fields(index)) for index in range(block.first, stop))
    ]
    full = full or [block for block in found if block.header == header][:1]
    stops = [*(block.head for block in full[1:]), grid.size]
    return [replace(block, stop=stop) for block, stop in zip(full, stops, strict=True)]


def _plain(fields: Sequence[Cell]) -> list[str]:
    return [str(field).strip().lower() for field in fields]


def _is_heading(grid: Grid, index: int, fields: Sequence[Cell]) -> bool:
    """Return whether fields are headings: most of them mean something, and a row follows."""
    filled = [str(field) for field in fields if field != ""]
    if len(filled) < _FEWEST or is_row(fields) or is_unit_row(fields):
        return False
    said = sum(_says_something(field) for field in filled)
    if said < _FEWEST or 2 * said < len(filled):
        return False
    below = grid.next_filled(index + 1)
    if below < grid.size and is_unit_row(grid.fields(below)):
        below = grid.next_filled(below + 1)
    return below < grid.size and is_row(grid.fields(below))


def _says_something(field: str) -> bool:
    return meaning_of(field) is not None or pass_of(0, field) is not None or bool({*plain_words(field)} & STATISTIC)


def is_name(fields: Sequence[Cell]) -> bool:
    """Return whether a line holds words in one cell, and nothing else."""
    filled = [str(field) for field in fields if field != ""]
    return len(filled) == 1 and any(map(str.isalpha, filled[0])) and not looks_like_number(filled[0])


def _names_a_part(fields: Sequence[Cell], *, after_blank: bool) -> bool:
    """Return whether a line between rows names what follows: a run, a way, an axis, or anything behind a gap."""
    if not is_name(fields):
        return False
    words = plain_words(next(str(field) for field in fields if field != ""))
    return after_blank or len(words) == 1 or bool(_TELLING.intersection(words))


def without_remarks(grid: Grid, text: list[str] | None, first: int, last: int) -> tuple[Grid, tuple[str, ...]]:
    """Return the lines with words between the rows made blank, and a note on them; ``text`` is None for a sheet."""
    likely = [index for index in range(first, last) if text is None or WORD.search(text[index])]
    while likely and is_row(grid.fields(likely[-1])):
        likely.pop()
    remarks = [index for index in likely if not grid.is_blank(index) and _is_remark(grid.fields(index))]
    remarks = [index for index in remarks if any(is_row(grid.fields(i)) for i in range(index + 1, last))]
    if not remarks:
        return grid, ()
    said = " ".join(str(field) for field in grid.fields(remarks[0]) if field != "")
    more = ", ..." if len(remarks) > _MOST_NAMED else ""
    lines = ", ".join(str(index + 1) for index in remarks[:_MOST_NAMED])
    left = frozenset(remarks)
    return (
        replace(grid, is_blank=lambda index: index in left or grid.is_blank(index)),
        (f"words between the rows are left out: line {lines}{more} ({shown(said)})",),
    )


def _is_remark(fields: Sequence[Cell]) -> bool:
    """Return whether a line holds words and no number: one cell of them, or a comment."""
    return is_name(fields) or next((str(field) for field in fields if field != ""), "").startswith("#")
