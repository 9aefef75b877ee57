"""What is in a cell: numbers with a decimal point or comma, directions, run numbers, or nothing."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence

from rtec.metrology.columns import SPELLINGS, spelled_unit
from rtec.metrology.tables.words import BACKWARD, DIRECTION, FILLERS, FORWARD, plain_words

Cell = str | float
"""A text, or what a workbook holds as a number."""

MISSING = frozenset(("", *"n/a na n.a. #n/a #na #nv - -- --- – — null none missing k.a. ?".split()))
"""What people write where there is no reading, in small letters; ``nan``, a number gone wrong, is none."""

_DASHES = ("-", "–", "—")
_POINT = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eEdD][+-]?[0-9]{1,4})?", re.ASCII)
_COMMA = re.compile(r"[+-]?(?:[0-9]+,?[0-9]*|,[0-9]+)(?:[eEdD][+-]?[0-9]{1,4})?", re.ASCII)
_GROUPED = {
    ".": re.compile(
        r"[+-]?(?:[1-9][0-9]{0,2}(?:[,' ][0-9]{3})+|[1-9][0-9]?(?:,[0-9]{2})+,[0-9]{3})(?:\.[0-9]*)?", re.ASCII
    ),
    ",": re.compile(r"[+-]?[1-9][0-9]{0,2}(?:[.' ][0-9]{3})+(?:,[0-9]*)?", re.ASCII),
}
_GROUPS = {".": re.compile(r"[,' ]"), ",": re.compile(r"[.' ]")}
_SIGNS = str.maketrans({"−": "-", "‒": "-", "–": "-", "\u00a0": " ", "\u202f": " ", "\u2009": " ", "’": "'"})
_LONGEST = 60
_ARROW = re.compile(r"[-=]{1,3}>|<[-=]{1,3}")
_WITH_UNIT = re.compile(r"(.*[0-9][.,]?)\s*([^0-9\[\](){}+\-−]{1,20})", re.ASCII)
_NOT_PLAIN = re.compile(r"[^0-9.,;\t\n +\-eE|]")
"""What no text of plain numbers holds: looked for before anything that takes its time."""
_BEFORE_UNITS = re.compile(r"[0-9][.,]?\s{0,3}[^\W0-9_eE]|[%°/]")
_MAY_HOLD_UNITS = re.compile(
    r"[0-9][.,]?\s{0,3}(?:" + "|".join(map(re.escape, sorted(SPELLINGS, key=len, reverse=True))) + r")(?![a-z])",
    re.IGNORECASE,
)
_WHOLE = re.compile(r"[^0-9]*([0-9]{1,9})[^0-9]*", re.ASCII)


def is_missing(cell: Cell, *, signs: bool = False) -> bool:
    """Return whether a cell says that there is no reading; with ``signs`` a dash is a direction.

    Examples
    --------
    >>> is_missing(" n/a "), is_missing("0"), is_missing("nan"), is_missing("-"), is_missing("-", signs=True)
    (True, False, False, True, False)
    """
    text = cell.strip().lower() if isinstance(cell, str) else "0"
    return text in MISSING and not (signs and text in _DASHES)


def number_of(cell: Cell, mark: str) -> float | None:
    """Return the number in a cell, or None where it holds none; ``mark`` is the decimal mark, ``.`` or ``,``.

    Spaces, apostrophes and the other mark may stand between groups of three digits, commas also as in India.

    Examples
    --------
    >>> number_of("-1.234,5", ","), number_of("1'250.75", "."), number_of("1,5", "."), number_of("1e-3", ".")
    (-1234.5, 1250.75, None, 0.001)
    >>> number_of("1,00,000.5", "."), number_of("1.5D-03", ".")
    (100000.5, 0.0015)
    """
    if isinstance(cell, float):
        return cell if math.isfinite(cell) else None
    text = cell.strip()
    if len(text) > _LONGEST:
        return None
    text = text if text.isascii() else text.translate(_SIGNS)
    if (_POINT if mark == "." else _COMMA).fullmatch(text) is None:
        if _GROUPED[mark].fullmatch(text) is None:
            return None
        text = _GROUPS[mark].sub("", text)
    value = float(text.replace(",", ".").lower().replace("d", "e"))
    return value if math.isfinite(value) else None


def looks_like_number(cell: Cell) -> bool:
    """Return whether a cell is a number with one mark or the other, with a unit behind it or without.

    Examples
    --------
    >>> looks_like_number("1,5"), looks_like_number("1.5 mm"), looks_like_number("Run 1")
    (True, True, False)
    """
    return isinstance(cell, float) or _is_number(cell) or apart_from_unit(cell) is not None


def _is_number(text: str) -> bool:
    return any(number_of(text, mark) is not None for mark in ".,")


def apart_from_unit(cell: Cell) -> tuple[str, str] | None:
    """Return the number in a cell and the unit behind it, as `spelled_unit` returns it, or None.

    Examples
    --------
    >>> apart_from_unit("-3,2 µm"), apart_from_unit("0.5in"), apart_from_unit("12"), apart_from_unit("3 times")
    (('-3,2', 'um'), ('0.5', 'inch'), None, None)
    """
    if isinstance(cell, float) or len(cell) > _LONGEST:
        return None
    match = _WITH_UNIT.fullmatch(cell.strip().translate(_SIGNS))
    if match is None or (unit := spelled_unit(match[2])) is None or not _is_number(match[1]):
        return None
    return match[1], unit


def may_hold_units(lines: Sequence[str]) -> bool:
    """Return whether a number with a unit behind it may stand in one of the lines.

    Examples
    --------
    >>> may_hold_units(["0;1.5", "1;0,5 mm"]), may_hold_units(["1;forward;0.5"])
    (True, False)
    """
    if _NOT_PLAIN.search("\n".join(lines)) is None:
        return False
    return any(_MAY_HOLD_UNITS.search(line) for line in lines if _BEFORE_UNITS.search(line))


def decimal_marks(cells: Iterable[Cell], *, commas_apart: bool = False) -> frozenset[str]:
    """Return the decimal marks that the numbers among cells allow: one, both where nobody can tell, none in a muddle.

    A cell such as ``100,000`` may be a hundred with three decimals or a hundred thousand, and so may ``100.000``;
    but where commas keep the columns apart (``commas_apart``), a lone point is a decimal point.

    Examples
    --------
    >>> sorted(decimal_marks(["0,5", "100,000"])), sorted(decimal_marks(["1.500", "2"], commas_apart=True))
    ([','], ['.'])
    >>> sorted(decimal_marks(["100,000", "-2"])), sorted(decimal_marks(["1.5", "0,5"]))
    ([',', '.'], [])
    """
    sure, open_marks = set(), set()
    for cell in cells:
        if isinstance(cell, float) or not ("." in cell or "," in cell):
            continue
        readable = [mark for mark in ".," if number_of(cell, mark) is not None]
        if len(readable) == 1:
            sure.add(readable[0])
        elif readable:
            open_marks.add("," if "," in cell else ".")
    if sure:
        return frozenset(sure) if len(sure) == 1 else frozenset()
    return frozenset(".,") if "," in open_marks or (open_marks and not commas_apart) else frozenset(".")


def direction_of(cell: Cell) -> int | None:
    """Return the direction of approach that a cell names, +1 or −1, or None.

    Examples
    --------
    >>> [direction_of(cell) for cell in ("+", "Rückwärts", "1", -1.0, "↑", "<-", "X+", "approach from below")]
    [1, -1, 1, -1, 1, -1, 1, None]
    """
    number = number_of(cell, ".")
    if number is not None:
        return int(number) if abs(number) == 1.0 else None
    words = [
        word for word in plain_words(_ARROW.sub(_arrow, str(cell)[:_LONGEST])) if word not in FILLERS | DIRECTION
    ]
    if len(words) != 1:
        return None
    return 1 if words[0] in FORWARD else -1 if words[0] in BACKWARD else None


def _arrow(drawn: re.Match[str]) -> str:
    return "→" if drawn[0].endswith(">") else "←"


def run_of(cell: Cell) -> float | None:
    """Return the run number that a cell names: a number, or one with a word around it.

    Examples
    --------
    >>> run_of("Run 3"), run_of("2"), run_of("first")
    (3.0, 2.0, None)
    """
    number = number_of(cell, ".")
    if number is not None:
        return number
    match = _WHOLE.fullmatch(str(cell)[:_LONGEST])
    return None if match is None else float(match[1])
