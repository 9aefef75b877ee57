"""Lines of G-code as words, each with its place in the text, so that all else stays as it is written."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import NamedTuple

_TOKEN = re.compile(
    r"\([^()]*\)|\"[^\"]*\"|(?P<comment>;.*)"
    r"|(?P<keyword>[A-Z_]{2,}[A-Z_0-9]*)"
    r"|(?P<letter>[A-Z])\s*(?P<number>[+-]?(?:\d+\.?\d*|\.\d+))"
    r"|(?P<other>\S)",
    re.IGNORECASE,
)
_EXPRESSION = frozenset("#[]=<>{}$\"'(),")
"""Signs of what is computed, of comments that do not close, and of corners that a control rounds itself (``,R2``)."""


class Word(NamedTuple):
    """A letter and its number."""

    letter: str
    """Large."""
    value: float
    begin: int
    end: int
    """Where the number stands in the text."""
    first: int
    """Where the letter stands."""


@dataclass(slots=True)
class Line:
    """What a line says.

    Examples
    --------
    >>> line = line_of("N10 g01 X-2.5(rough) f100 ; slow")
    >>> [(word.letter, word.value) for word in line.words], line.codes
    ([('N', 10.0), ('G', 1.0), ('X', -2.5), ('F', 100.0)], ['G1'])
    """

    text: str
    words: list[Word] = field(default_factory=list)
    codes: list[str] = field(default_factory=list)
    """Words of G, as in G1, G38.2."""
    keywords: list[str] = field(default_factory=list)
    """Of two letters or more, large."""
    computed: bool = False
    """Whether something is computed or assigned in it."""
    letters: set[str] = field(default_factory=set)
    """Letters that stand before a number, and those alone, before something computed."""
    optional: bool = False
    """Whether the operator may have it skipped."""
    comment: int = -1
    """Where a comment to the end of the line begins; -1: nowhere."""

    def word(self, letter: str) -> Word | None:
        """Return the last word of a letter, or None."""
        return next((word for word in reversed(self.words) if word.letter == letter), None)


def line_of(text: str) -> Line:
    """Return a line, without its end, as words."""
    line = Line(text)
    for found in _TOKEN.finditer(text):
        kind = found.lastgroup
        if kind == "number":
            letter, number = found["letter"].upper(), found["number"]
            line.words.append(Word(letter, float(number), found.start("number"), found.end("number"), found.start()))
            line.letters.add(letter)
            if letter == "G":
                line.codes.append(f"G{float(number):g}")
        elif kind == "keyword":
            line.keywords.append(found["keyword"].upper())
        elif kind == "comment":
            line.comment = found.start()
        elif kind == "other":
            sign = found["other"]
            if sign in _EXPRESSION:
                line.computed = True
            elif sign.isalpha():
                line.letters.add(sign.upper())
            elif sign == "/" and not line.words:
                line.optional = True
    return line


def replaced(line: Line, letters: set[str], codes: set[str], words: list[Word]) -> str:
    """Return the text of a line without the words of some letters, without some codes, and without some words.

    Examples
    --------
    >>> replaced(line_of("N1 G01 X2 F9 (go)"), {"X"}, {"G1"}, [])
    'N1 F9 (go)'
    """
    text, line_words = line.text, line.words
    for word in reversed(line_words):
        code = word.letter == "G" and f"G{word.value:g}" in codes
        if word.letter in letters or code or word in words:
            text = text[: word.first].rstrip() + " " + text[word.end :].lstrip()
    return text.strip()


def inserted(head: str, told: str) -> str:
    """Return a line with more words, before a comment to its end."""
    at = line_of(head).comment
    parts = (head, told, "") if at < 0 else (head[:at].rstrip(), told, head[at:])
    return " ".join(part for part in parts if part)
