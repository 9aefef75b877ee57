"""Errors that a user of rtec can meet.

::

    RtecError
    ├── ArgumentError      a value given by the caller is outside what is allowed
    ├── FileFormatError    a file does not hold what its format promises
    ├── LinkError          an interface to a bus does not exist, cannot be opened, or has vanished
    └── OutputError        a result could not be written

Every message says what is wrong, where, the value found, what is allowed and what to do.
What a simulated machine does wrong (an illegal transition, a refused request) is a result, never an exception.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

_KNOWN = "known: "
_IN_WORDS = re.compile(r"[A-Za-z]+ \w|\d[\d.]* [a-z]{2,}s\b")
"""A value that is told in words, "no reading" or "12 averages", and not quoted."""


class RtecError(Exception):
    """Base of all errors that rtec raises on purpose; the command line turns it into exit code 2."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel whole from a worker's process: by default an error is made anew from its message alone."""
        return _again, (type(self), self.args, self.__dict__)


def _again(kind: type[RtecError], args: tuple[object, ...], fields: dict[str, object]) -> RtecError:
    error = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(fields)
    return error


class ArgumentError(RtecError, ValueError):
    """A value given by the caller is outside what is allowed.

    Parameters
    ----------
    name
        Name of the argument or key, as the user wrote it.
    value
        The value found, or in words what was found; None where nothing was given, "" where the argument itself is
        the problem.
    allowed
        What would have been accepted: it completes a sentence that begins with "use".
    hint
        Why, or what to do about it (optional).
    problem
        What is wrong with the value, as a verb and what follows it: "is too small". Where nothing better is known, a
        value is "not valid"; one that is told in words stands alone.

    Examples
    --------
    >>> str(ArgumentError("feed", -3, "a speed above 0 mm/s"))
    'feed: -3 is not valid; use a speed above 0 mm/s'
    >>> str(ArgumentError("--axis", 16, "1 to 15", problem="is too large"))
    '--axis: 16 is too large; use 1 to 15'
    >>> str(ArgumentError("totals", "an array of 3 numbers", "one for each of 5 times"))
    'totals: an array of 3 numbers; use one for each of 5 times'
    >>> str(ArgumentError("--clock", None, "the frequency of the module's clock, such as 50MHz"))
    "--clock is missing; give the frequency of the module's clock, such as 50MHz"
    >>> str(ArgumentError("--pins", "", "it for Verilog", problem="means nothing for Python"))
    '--pins means nothing for Python; use it for Verilog'
    """

    def __init__(self, name: str, value: object, allowed: str, hint: str = "", *, problem: str = "") -> None:
        hint = "" if hint.startswith(_KNOWN) and hint.removeprefix(_KNOWN) in allowed else hint  # no list twice
        self.name, self.value, self.allowed, self.hint, self.problem = name, value, allowed, hint, problem
        if value is None:
            said = f"{name} is missing; give {allowed}"
        elif problem and value == "":
            said = f"{name} {problem}; use {allowed}"
        elif problem or not (isinstance(value, str) and _IN_WORDS.match(value)):
            said = f"{name}: {value} {problem or 'is not valid'}; use {allowed}"
        else:
            said = f"{name}: {value}; use {allowed}"
        super().__init__(f"{said}{'; ' + hint if hint else ''}")
        self.interval: tuple[float, float, float, str] | None = None
        """Of a number that is too small or too large: itself, the lowest, the highest, and the unit of the three."""

    def of(self, name: str) -> ArgumentError:
        """Return the same error under the name by which the user knows the argument.

        Examples
        --------
        >>> ArgumentError("count_mm", 0, "a length above 0 mm").of("--count").name
        '--count'
        """
        error = ArgumentError(name, self.value, self.allowed, self.hint, problem=self.problem)
        error.interval = self.interval
        return error


def unknown(name: str, word: str, known: Iterable[str], *, noun: str = "") -> ArgumentError:
    """Return the error of a word that is none of those that are known; the nearest of them is suggested.

    Parameters
    ----------
    name
        Name of the argument or key, as the user wrote it.
    word
        What was found.
    known
        What could have been said.
    noun
        What the known words are, in the singular.

    Examples
    --------
    >>> str(unknown("--design", "z", ("original", "a", "b", "c"), noun="design"))
    "--design: 'z' is not a design; use one of original, a, b, c"
    >>> str(unknown("--unit", "in", ("mm", "inch")))
    "--unit: 'in' is not valid; use mm or inch; did you mean 'inch'?"
    """
    words = [str(each) for each in known]
    return ArgumentError(
        name,
        repr(word[:60]),
        f"one of {', '.join(words)}" if len(words) > 2 else " or ".join(words),
        meant(word[:60].lower(), words),
        problem=f"is not {'an' if noun[0] in 'aeio' else 'a'} {noun}" if noun else "",
    )


class FileFormatError(RtecError, ValueError):
    """A file does not hold what its format promises.

    Parameters
    ----------
    path
        The file.
    line
        Line number counted from 1, or None where the whole file is meant.
    problem
        What was found.
    allowed
        What the format asks for, or what to do: it completes a sentence that begins with "use".

    Examples
    --------
    >>> str(FileFormatError("z.csv", 7, "'abc' is not a number", "a decimal number"))
    "z.csv, line 7: 'abc' is not a number; use a decimal number"
    """

    def __init__(self, path: str | Path, line: int | None, problem: str, allowed: str) -> None:
        self.path, self.line, self.problem, self.allowed = str(path), line, problem, allowed
        where = f"{path}" if line is None else f"{path}, line {line}"
        super().__init__(f"{where}: {problem}; use {allowed}")


class LinkError(RtecError, OSError):
    """An interface to a bus does not exist, its channel cannot be opened, or it vanished while in use.

    Parameters
    ----------
    interface
        Name of the interface, as the user wrote it.
    channel
        The channel on it, or an empty text where the interface as a whole is meant.
    problem
        What was found.
    hint
        What is allowed, or what to do.

    Examples
    --------
    >>> str(LinkError("slcan", "/dev/ttyACM7", "there is no such device", "plug the adapter in"))
    'slcan /dev/ttyACM7: there is no such device; plug the adapter in'
    """

    def __init__(self, interface: str, channel: str, problem: str, hint: str) -> None:
        self.interface, self.channel, self.problem, self.hint = interface, channel, problem, hint
        super().__init__(f"{interface}{' ' + channel if channel else ''}: {problem}; {hint}")


class OutputError(RtecError, OSError):
    """A result could not be written; nothing half-written is left behind."""


def nearest(word: str, known: Iterable[str]) -> str:
    """Return a hint naming the known word that is meant, where one is near; else all of them.

    Examples
    --------
    >>> nearest("orginal", ["original", "a", "b", "c"]), nearest("in", ["mm", "inch"])
    ("did you mean 'original'?", "did you mean 'inch'?")
    >>> nearest("conversation", ["calibration", "handshake"])
    'known: calibration, handshake'
    """
    names = list(known)
    return meant(word, names) or _KNOWN + ", ".join(names)


def meant(word: str, known: Iterable[str]) -> str:
    """Return a hint naming the known word that is meant; nothing where none is near.

    Near is a word that differs by slips of the fingers, in any case of letters: one letter in three at most is
    missing, too much, another one, or in the place of its neighbour. Else it is the shortest that holds ``word`` or
    begins with it but for one slip, or with which ``word`` begins.

    Examples
    --------
    >>> meant("glich", ["glitches", "bus-off"]), meant("conversation", ["calibration", "handshake"])
    ("did you mean 'glitches'?", '')
    """
    names, begun = list(known), word[:60].casefold()
    slips = {name: _slips(begun, name.casefold()) for name in names}
    close = min(names, key=lambda name: (slips[name][-1], name), default="")
    if close and slips[close][-1] > min(max(len(begun) // 3, 1), len(begun) - 1):
        held = (
            name for name in names if _holds(name.casefold(), begun) or (len(begun) > 4 and min(slips[name]) == 1)
        )
        close = min(held, key=len, default="")
    return f"did you mean '{close}'?" if close else ""


def _holds(name: str, word: str) -> bool:
    if min(len(name), len(word)) < 3:  # a letter or two stand in the middle of everything
        return (len(word) == 2 and name.startswith(word)) or (len(name) == 2 and word.startswith(name))
    return word in name or word.startswith(name)


def _slips(word: str, name: str) -> list[int]:
    """Return how many letters have to be put in, taken out, changed or swapped to get each beginning of the name.

    Notes
    -----
    The distance of optimal string alignment, row by row of its table.

    References
    ----------
    F. J. Damerau, A technique for computer detection and correction of spelling errors, Communications of the ACM 7
    (1964) 171.
    """
    rows = [list(range(len(name) + 1))]
    for i, letter in enumerate(word):
        row = [i + 1]
        for j, other in enumerate(name):
            row.append(min(rows[i][j] + (letter != other), rows[i][j + 1] + 1, row[j] + 1))
            if i and j and letter == name[j - 1] and word[i - 1] == other:
                row[-1] = min(row[-1], rows[i - 1][j - 1] + 1)
        rows.append(row)
    return rows[-1]
