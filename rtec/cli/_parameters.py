"""Parameters of a verb, declared once in its signature: the option, its help, and what makes a value of its text.

A verb's body receives values: numbers in the unit that ends the parameter's name, members of an enum, files that can
be written. What is wrong with a text is said under the name of its option; what a face refuses later is said under
the name of the option whose parameter has the name that the face knows (`rtec.cli._verb`).
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rtec.cli._words import Completer, among
from rtec.errors import ArgumentError, RtecError, unknown
from rtec.io import check_file, check_folder
from rtec.units import NUMBER, SHARE, Kind, parse_quantity, parse_time_ps

if TYPE_CHECKING:
    from rtec.board import Microcontroller
    from rtec.injector import Processor

_LONGEST = 60
_FIRMWARE = "firmware"


def option(
    names: str,
    metavar: str,
    text: str,
    *,
    default: Any = None,
    panel: str | None = None,
    read: Callable[[str], Any] | None = None,
    complete: Completer | None = None,
    **more: Any,
) -> Any:
    """Return an option, as the default of a parameter.

    Parameters
    ----------
    names
        Of the option, with spaces between; the first of them is used in messages.
    metavar, text, panel
        What help shows: the value, what it is, the panel.
    default
        What it is where the user says nothing; a text is read as if the user had written it. Required with ``...``.
    read
        Makes the value of the text; an `ArgumentError` of it is said as it is.
    complete
        What completes it in a shell; without it the words that the metavar lists, or what the name stands for.
    more
        As of `typer.Option`.
    """
    every = names.split()
    return typer.Option(
        default,
        *every,
        metavar=metavar,
        help=text,
        rich_help_panel=panel,
        parser=None if read is None else _saying_it(read),
        autocompletion=complete or among(metavar, every[-1]),
        **more,
    )


def _saying_it(read: Callable[[str], Any]) -> Callable[[Any], Any]:
    def parsed(text: Any) -> Any:
        if not isinstance(text, str) or "_RTEC_COMPLETE" in os.environ:  # completion looks at no value
            return text
        try:
            return read(text)
        except RtecError as error:
            raise RtecError(str(error)) from error  # typer words a ValueError anew

    return parsed


def _first(names: str) -> str:
    return names.partition(" ")[0]


def flag(names: str, text: str, *, default: bool | None = False, panel: str | None = None, **more: Any) -> Any:
    """Return an option without a value."""
    return typer.Option(default, *names.split(), help=text, rich_help_panel=panel, **more)


def quantity(names: str, kind: Kind, metavar: str, text: str, **more: Any) -> Any:
    """Return an option that takes a number with its unit; its value is in the unit of the kind."""
    name = _first(names)
    return option(names, metavar, text, read=lambda said: parse_quantity(said, kind, name=name), **more)


def time_ps(names: str, metavar: str, text: str, **more: Any) -> Any:
    """Return an option that takes a time with its unit; its value is whole picoseconds."""
    name = _first(names)
    return option(names, metavar, text, read=lambda said: parse_time_ps(said, name=name), **more)


def share(names: str, metavar: str, text: str, **more: Any) -> Any:
    """Return an option that takes percent; its value is 0.02 for 2 %."""
    name = _first(names)
    return option(names, metavar, text, read=lambda said: parse_quantity(said, SHARE, name=name) / 100.0, **more)


def whole(
    names: str, text: str, *, low: int | None = None, high: int | None = None, metavar: str = "N", **more: Any
) -> Any:
    """Return an option that takes a whole number in a range, in the grammar of `whole_number`."""
    name = _first(names)
    return option(names, metavar, text, read=lambda said: whole_number(said, name=name, low=low, high=high), **more)


def member(names: str, place: str, metavar: str, text: str, **more: Any) -> Any:
    """Return an option that takes the value of a member of an enum, in any case of letters.

    Parameters
    ----------
    place
        Of the enum, as in ``rtec.injector:RealEdges``; loaded when a text is to be read.
    names, metavar, text, more
        As of `option`.
    """
    name = _first(names)

    def read(said: str) -> Any:
        module, _, kind = place.partition(":")
        by_word = {str(each.value): each for each in getattr(import_module(module), kind)}
        return by_word[choice(said, by_word, name=name)]

    return option(names, metavar, text, read=read, **more)


def word(names: str, metavar: str, text: str, **more: Any) -> Any:
    """Return an option that takes one of the words that the metavar lists, in any case of letters."""
    name = _first(names)
    return option(names, metavar, text, read=lambda said: choice(said, metavar.split("|"), name=name), **more)


def named(names: str, place: str, metavar: str, text: str, **more: Any) -> Any:
    """Return an option whose text a function reads; what it refuses is said under the name of the option.

    Parameters
    ----------
    place
        Of the function, as in ``rtec.injector:Design.named``; loaded when a text is to be read.
    names, metavar, text, more
        As of `option`.
    """
    name = _first(names)

    def read(said: str) -> Any:
        module, _, path = place.partition(":")
        function: Any = import_module(module)
        for part in path.split("."):
            function = getattr(function, part)
        try:
            return function(said)
        except ArgumentError as error:
            raise error.of(name) from error

    return option(names, metavar, text, read=read, **more)


def written(names: str, metavar: str, text: str, *, endings: Sequence[str] = (), **more: Any) -> Any:
    """Return an option that takes a file to be written: it can be made, or ``--force`` writes over it."""
    name = _first(names)

    def check(context: typer.Context, value: Path | None) -> Path | None:
        if value is not None and not context.resilient_parsing:
            check_file(name, value, force=context.params["force"], endings=endings)
        return value

    return option(names, metavar, text, callback=check, **more)


def folder(names: str, text: str, **more: Any) -> Any:
    """Return an option that takes a folder to be filled: it can be made, it is empty, or there is ``--force``."""
    name = _first(names)

    def check(context: typer.Context, value: Path | None) -> Path | None:
        if value is not None and not context.resilient_parsing:
            check_folder(name, value, force=context.params["force"])
        return value

    return option(names, "DIR", text, callback=check, **more)


def force(text: str, *, panel: str | None = None) -> Any:
    """Return the option that allows to write over what is there; read before the files, whatever their order."""
    return flag("--force", text, panel=panel, is_eager=True)


def design(text: str, *, names: str = "--design", **more: Any) -> Any:
    """Return the option that takes a `Design`."""
    return named(names, "rtec.injector:Design.named", "original|a|b|c", text, **more)


def processor(text: str, **more: Any) -> Any:
    """Return the option that takes a `Microcontroller`."""
    return named("--processor", "rtec.board:Microcontroller.named", "NAME", text, **more)


@dataclass(frozen=True, slots=True)
class Works:
    """What works in the box: a processor of which only the times count, or one that runs the design's program."""

    processor: Processor
    microcontroller: Microcontroller | None


def works(text: str, **more: Any) -> Any:
    """Return the option ``--timing`` that takes what `Works` in the box."""

    def read(said: str) -> Works:
        from rtec.injector import Processor

        word = choice(said, (*(known.value for known in Processor), _FIRMWARE), name="--timing")
        if word == _FIRMWARE:
            from rtec.board import Microcontroller

            return Works(Processor.MCS51, Microcontroller.named("8051-12mhz"))
        return Works(Processor(word), None)

    return option("--timing", "8051|fast|firmware", text, read=read, **more)


def whole_number(text: str, *, name: str, low: int | None = None, high: int | None = None) -> int:
    """Read a whole number, as in ``4000``, ``100_000``, ``1e5``.

    Raises
    ------
    ArgumentError
        Another text, or a number outside the range.

    Examples
    --------
    >>> whole_number("1e5", name="--cycles"), whole_number("100_000", name="--cycles", low=1)
    (100000, 100000)
    """
    allowed = f"{low} or more" if high is None else f"{low} to {high}"
    match = re.fullmatch(rf"\s*({NUMBER})\s*", text) if len(text) <= _LONGEST else None
    if match is None or not abs(float(match[1])) <= 1e30 or Fraction(match[1]).denominator != 1:
        allowed = "a number such as 4000" if low is None else allowed
        raise ArgumentError(name, repr(text[:60]), allowed, problem="is not a whole number")
    number = int(Fraction(match[1]))
    if low is not None and number < low:
        raise ArgumentError(name, number, allowed, problem="is too small")
    if high is not None and number > high:
        raise ArgumentError(name, number, allowed, problem="is too large")
    return number


def pure(names: str, metavar: str, text: str, *, low: float, high: float, **more: Any) -> Any:
    """Return an option that takes a number without a unit, in a range."""
    name = _first(names)

    def read(said: str) -> float:
        value = float(said) if len(said) <= _LONGEST and re.fullmatch(NUMBER, said.strip()) else 0.0
        if not low <= value <= high:
            raise ArgumentError(name, repr(said[:40]), f"a pure number from {low:g} to {high:g}")
        return value

    return option(names, metavar, text, read=read, **more)


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
        raise unknown(name, text, words)
    return text.lower()


def apart(name: str, other: str, why: str = "") -> ArgumentError:
    """Return the error of an option that means nothing beside another one.

    Examples
    --------
    >>> str(apart("--seed", "--motion ramp", "nothing in it is random"))
    '--seed does not go with --motion ramp; use one of the two; nothing in it is random'
    """
    return ArgumentError(name, "", "one of the two", why, problem=f"does not go with {other}")


def needs(name: str, other: str, why: str = "") -> ArgumentError:
    """Return the error of an option that means nothing without another one.

    Examples
    --------
    >>> str(needs("--pick", "-o MODEL.toml"))
    '--pick needs -o MODEL.toml; use both'
    """
    return ArgumentError(name, "", "both", why, problem=f"needs {other}")
