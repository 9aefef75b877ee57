"""Words of the command line turned into values where neither a unit nor a type of the inside does it."""

from __future__ import annotations

import enum
import re
from collections.abc import Iterable
from typing import TYPE_CHECKING, TypeVar

from rtec.errors import ArgumentError, nearest

if TYPE_CHECKING:
    from rtec.board import Microcontroller
    from rtec.injector import Processor

_WHOLE = re.compile(r"[+-]?\d{1,30}", re.ASCII)
_NUMBER_AND_UNIT = re.compile(r"([+-]?(?:\d{1,30}(?:\.\d{0,30})?|\.\d{1,30}))\s*(%|counts?)", re.ASCII)

_E = TypeVar("_E", bound=enum.Enum)


def whole(text: str, *, name: str) -> int:
    """Read a whole number; its range is checked where it is used.

    Raises
    ------
    ArgumentError
        Anything but at most 30 decimal digits with a sign.

    Examples
    --------
    >>> whole("4000", name="--cycles")
    4000
    """
    if _WHOLE.fullmatch(text.strip()) is None:
        raise ArgumentError(name, repr(text[:60]), "a whole number in digits, such as 4000")
    return int(text)


def choice(text: str, known: Iterable[str], *, name: str) -> str:
    """Return ``text`` if it is one of the known words, in any case of letters.

    Raises
    ------
    ArgumentError
        Another word; the nearest known one is suggested.

    Examples
    --------
    >>> choice("Hold", ["merge", "hold"], name="--real-edges")
    'hold'
    """
    words = list(known)
    if text.lower() not in words:
        near = nearest(text[:60].lower(), words)
        raise ArgumentError(name, repr(text[:60]), ", ".join(words), near if near.startswith("did") else "")
    return text.lower()


def what_works(timing: str) -> tuple[Processor, Microcontroller | None]:
    """Return what ``--timing`` puts into the box: the times of a processor, or one that runs the design's program.

    Examples
    --------
    >>> what_works("fast"), what_works("firmware")[1].name
    ((<Processor.FAST: 'fast'>, None), '8051-12mhz')
    """
    from rtec.board import Microcontroller
    from rtec.injector import Processor

    firmware = "firmware"
    word = choice(timing, (*(known.value for known in Processor), firmware), name="--timing")
    return (Processor.MCS51, Microcontroller.named("8051-12mhz")) if word == firmware else (Processor(word), None)


def member(text: str, kind: type[_E], *, name: str) -> _E:
    """Return the member of ``kind`` whose value is written as ``text``.

    Examples
    --------
    >>> from rtec.injector import RealEdges
    >>> member("hold", RealEdges, name="--real-edges")
    <RealEdges.HOLD: 'hold'>
    """
    by_word = {str(item.value): item for item in kind}
    return by_word[choice(text, by_word, name=name)]


def share(text: str, *, name: str) -> float:
    """Read a share written in percent.

    Examples
    --------
    >>> share("2%", name="--duty-a")
    0.02
    """
    return _measured(text, "%", "percent, such as 2% or -0.5 %", name) / 100.0


def counts(text: str, *, name: str) -> float:
    """Read a length in counts of the encoder.

    Examples
    --------
    >>> counts("1.5 count", name="--eccentricity")
    1.5
    """
    return _measured(text, "count", "a number of counts, such as '2 count'", name)


def _measured(text: str, unit: str, allowed: str, name: str) -> float:
    match = _NUMBER_AND_UNIT.fullmatch(text.strip())
    if match is None or match[2].removesuffix("s") != unit:
        raise ArgumentError(name, repr(text[:60]), allowed, "write the unit behind the number")
    return float(match[1])
