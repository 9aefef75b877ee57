"""Words of the command line turned into values where neither a unit nor a type of the inside does it."""

from __future__ import annotations

import enum
import re
from collections.abc import Iterable
from fractions import Fraction
from typing import TYPE_CHECKING, Any, TypeVar

import typer

from rtec.cli._words import Completer, among
from rtec.errors import ArgumentError, nearest
from rtec.units import NUMBER, SHARE, parse_in, parse_quantity

if TYPE_CHECKING:
    from rtec.board import Microcontroller
    from rtec.injector import Processor

_LONGEST = 60
_E = TypeVar("_E", bound=enum.Enum)


def whole(text: str, *, name: str, low: int | None = None, high: int | None = None) -> int:
    """Read a whole number, as in ``4000``, ``100_000``, ``1e5``.

    Raises
    ------
    ArgumentError
        Another text, or a number outside the range.

    Examples
    --------
    >>> whole("1e5", name="--cycles"), whole("100_000", name="--cycles", low=1)
    (100000, 100000)
    """
    ends = {(False, True): f" up to {high}", (True, False): f" from {low}", (True, True): f" from {low} to {high}"}
    limits = ends.get((low is not None, high is not None), "")
    allowed = f"a whole number{limits}" if limits else "a whole number in digits, such as 4000"
    match = re.fullmatch(rf"\s*({NUMBER})\s*", text) if len(text) <= _LONGEST else None
    if match is None or not abs(float(match[1])) <= 1e30 or Fraction(match[1]).denominator != 1:
        raise ArgumentError(name, repr(text[:60]), allowed)
    number = int(Fraction(match[1]))
    if (low is not None and number < low) or (high is not None and number > high):
        raise ArgumentError(name, number, allowed)
    return number


def option(*names: str, metavar: str, complete: Completer | None = None, **more: Any) -> Any:
    """Return an option whose value the shell completes: by ``complete``, else as the metavar or the name tells.

    Parameters
    ----------
    names, metavar, more
        As of `typer.Option`.
    complete
        What completes it.
    """
    name = next((name for name in names if name.startswith("--")), "")
    return typer.Option(*names, metavar=metavar, autocompletion=complete or among(metavar, name), **more)


def whole_option(*names: str, low: int, high: int | None = None, help: str, **more: Any) -> Any:
    """Return an option that takes a whole number in a range, in the grammar of `whole`.

    Parameters
    ----------
    names, help, more
        As of `typer.Option`.
    low, high
        Of the range.
    """

    def read(text: str) -> int:
        try:
            return whole(str(text), name="", low=low, high=high)
        except ArgumentError as error:
            raise typer.BadParameter(f"{error.value} is not allowed; allowed: {error.allowed}") from None

    return typer.Option(*names, parser=read, help=help, **({"metavar": "N"} | more))


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
    return parse_quantity(text, SHARE, name=name) / 100.0


def counts(text: str, *, name: str) -> float:
    """Read a length in counts of the encoder.

    Examples
    --------
    >>> counts("1.5 count", name="--eccentricity")
    1.5
    """
    return parse_in(text, "count", name=name)
