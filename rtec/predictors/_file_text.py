"""Lists of numbers and tables in the TOML files of predictors, which give back the same numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from rtec.errors import ArgumentError, FileFormatError
from rtec.io import Section
from rtec.predictors._columns import Floats, column

VERSION = 1
MOST_BYTES = 16_000_000
"""Of a file: tables of some 200 000 points in each direction."""


def check_version(path: str | Path, given: Mapping[str, object]) -> None:
    """Refuse a file of another version."""
    if given.get("version") != VERSION or type(given["version"]) is not int:
        found = f"version = {given.get('version')!r}"[:80]
        raise FileFormatError(path, None, found, f"version = {VERSION}; train it again with this rtec")


def entries(top: Section, name: str, keys: tuple[str, ...]) -> Iterator[Section]:
    """Yield the tables ``[[name]]`` of a file."""
    found = top.raw(name)
    if not isinstance(found, list):
        raise ArgumentError(top.where(name), repr(found)[:60], f"tables [[{name}]]")
    for number, entry in enumerate(found, 1):
        yield top.part(f"{name}[{number}]", entry, keys)


def numbers(part: Section, key: str) -> Floats:
    """Return a list of numbers within ±1e6, shape (n,)."""
    values = part.raw(key)
    if not isinstance(values, list) or not all(type(value) in (int, float) for value in values):
        raise ArgumentError(part.where(key), repr(values)[:60], "a list of numbers")
    return column(part.where(key), values)


def whole_numbers(part: Section, key: str) -> list[int]:
    """Return a list of whole numbers."""
    values = part.raw(key)
    if not isinstance(values, list) or not all(type(value) is int for value in values):
        raise ArgumentError(part.where(key), repr(values)[:60], "a list of whole numbers")
    return values


def lines_of(values: Mapping[str, object]) -> Iterator[str]:
    """Return lines ``key = value``."""
    return (f"{key} = {_shown(value)}" for key, value in values.items())


def _shown(value: object) -> str:
    """Return a text, a number or a list of them as it stands in the file."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, np.ndarray | tuple):
        return "[" + ", ".join(map(_shown, np.asarray(value).tolist())) + "]"
    if isinstance(value, list):
        return "[" + ", ".join(map(_shown, value)) + "]"
    return quoted(value) if isinstance(value, str) else repr(value)


def quoted(value: str) -> str:
    """Return a text of one line in quotes."""
    plain = "".join(letter if letter.isprintable() and letter not in '"\\' else "?" for letter in value)
    return f'"{plain[:200]}"'
