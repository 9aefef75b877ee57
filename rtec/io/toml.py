"""Reading a TOML file strictly: every key is known, has its unit, and lies in its range."""

from __future__ import annotations

import enum
import tomllib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from rtec.checks import as_written, number_within, whole_within
from rtec.errors import ArgumentError, FileFormatError, meant, unknown
from rtec.io.text import brief, read_text
from rtec.units import SHARE, TIME, Kind, parse_quantity, seconds_to_ps

_E = TypeVar("_E", bound=enum.Enum)
MOST_BYTES = 1_000_000
"""A study or a plan is a page of text; a larger file is something else."""


def read_toml(path: str | Path, *, most_bytes: int = MOST_BYTES) -> dict[str, Any]:
    """Return the tables of a TOML file of at most so many bytes.

    Raises
    ------
    FileFormatError
        Not there, too large, not UTF-8, or not TOML; the line is named where the parser knows it.
    """
    return parse_toml(read_text(path, "a TOML file", most_bytes=most_bytes, may_be_empty=True), path)


def parse_toml(text: str, path: str | Path) -> dict[str, Any]:
    """Return the tables of TOML text that stands in ``path``."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        problem = "nested too deeply"
    except ValueError as error:  # the parser's own, and that of a number with thousands of digits
        problem = str(error)
    raise FileFormatError(path, None, brief(problem), "TOML: [table], then key = value")


class Section:
    """One table of a file, with the values of a default behind it, such as the built-in study's.

    The name is empty for the top of the file. A key in neither the default nor ``optional`` is an error.
    """

    def __init__(
        self, path: str | Path, name: str, given: object, default: dict[str, Any], *, optional: tuple[str, ...] = ()
    ) -> None:
        if not isinstance(given, dict):
            raise FileFormatError(path, None, brief(f"{name} = {given!r}"), f"a table [{name}]")
        known = [*default, *optional]
        for key in given:
            if key not in known:
                allowed = "; ".join(filter(None, (f"one of {', '.join(known)}", meant(key, known))))
                raise FileFormatError(path, None, f"unknown key {self._dotted(name, key)[:80]!r}", allowed)
        self.path, self._name = path, name
        self._values = {**default, **given}

    @staticmethod
    def _dotted(name: str, key: str) -> str:
        return f"{name}.{key}" if name else key

    def part(self, name: str, given: object, keys: tuple[str, ...]) -> Section:
        """Return a table of the same file that may hold these keys and no others."""
        return Section(self.path, name, given, {}, optional=keys)

    def where(self, key: str) -> str:
        """Return how an error message names a key."""
        return f"{self.path}: {self._dotted(self._name, key)}"

    def refused(self, key: str, allowed: str, *, problem: str = "") -> ArgumentError:
        """Return the error of a value, as the file writes it; ``problem`` is what is wrong with it, as a verb."""
        return ArgumentError(self.where(key), brief(self.raw(key)), allowed, problem=problem)

    @contextmanager
    def naming(self, **keys: str) -> Iterator[None]:
        """Let an error about an argument name the key that it came from; ``keys`` maps the one to the other.

        An error about one row of a column keeps the row; a number stands in it as the file writes it.
        """
        try:
            yield
        except ArgumentError as error:
            name, comma, row = error.name.partition(", row ")
            key = keys.get(name)
            if key is None:
                raise
            written = self._values.get(key)
            if row or not isinstance(written, str) or key not in name:
                raise error.of(f"{self.where(key)}{comma}{row}") from None
            raise as_written(error, self.where(key), written) from None

    def has(self, key: str) -> bool:
        """Return whether a key has a value."""
        return key in self._values

    def raw(self, key: str) -> Any:
        """Return a value as it stands in the file."""
        if key not in self._values:
            raise FileFormatError(self.path, None, f"{self._name} has no {key!r}", f"{key} = ...")
        return self._values[key]

    def text(self, key: str) -> str:
        """Return a text of one line."""
        value = self.raw(key)
        if not isinstance(value, str) or not 0 < len(value) <= 200 or not value.isprintable():
            raise ArgumentError(
                self.where(key), repr(value)[:80], "a printable text of 1 to 200 characters in quotes"
            )
        return value

    def quantity(self, key: str, kind: Kind) -> float:
        """Return a quantity in the unit of ``kind``."""
        return parse_quantity(self.raw(key), kind, name=self.where(key))

    def quantities(self, key: str, kind: Kind) -> list[float]:
        """Return a list of quantities in the unit of ``kind``."""
        return [parse_quantity(text, kind, name=self.where(key)) for text in self.texts(key)]

    def texts(self, key: str) -> list[str]:
        """Return a list of texts."""
        value = self.raw(key)
        if not isinstance(value, list) or len(value) > 1000:
            raise ArgumentError(self.where(key), repr(value)[:80], "a list of texts, such as " + repr(["a", "b"]))
        return value

    def time_ps(self, key: str) -> int:
        """Return a time in picoseconds."""
        return seconds_to_ps(self.quantity(key, TIME), name=self.where(key))

    def share(self, key: str) -> float:
        """Return a share of the whole, given in percent."""
        return self.quantity(key, SHARE) / 100.0

    def whole(self, key: str, low: int, high: int) -> int:
        """Return a whole number; TOML reads 1e5 as a fraction that happens to be whole."""
        value = self.raw(key)
        whole = int(value) if isinstance(value, float) and value.is_integer() else value
        return whole_within(self.where(key), whole, low, high)

    def number(self, key: str, low: float, high: float) -> float:
        """Return a pure number."""
        return number_within(self.where(key), self.raw(key), low, high)

    def yes_or_no(self, key: str) -> bool:
        """Return true or false."""
        value = self.raw(key)
        if not isinstance(value, bool):
            raise ArgumentError(self.where(key), brief(repr(value)), "true or false")
        return value

    def choice(self, key: str, kind: Iterable[_E]) -> _E:
        """Return the one of these members whose value stands there."""
        return choice(self.where(key), self.raw(key), kind)


def choice(where: str, value: object, kind: Iterable[_E]) -> _E:
    """Return the one of these members with the value ``value``."""
    for member in kind:
        if member.value == value:
            return member
    known = [str(member.value) for member in kind]
    raise unknown(where, str(value), known)
