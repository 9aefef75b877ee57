"""The answers to a game, kept beside its data: each is linked to the one before it, so that a change is noticed.

As the seal of the secret, this keeps answers from a glance and from a slip, not from someone who means to forge them:
who takes away the last answers is not noticed.
"""

from __future__ import annotations

import base64
import binascii
import contextlib
import hashlib
import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rtec.blind.sealing import reveal, sealed_path
from rtec.errors import FileFormatError, OutputError
from rtec.io import json_text, parse_json, read_bytes, read_text

SUFFIX = ".answers"
_ALLOWED = "answers as 'rtec blind guess' keeps them"
_PATIENCE_S, _PAUSE_S = 5.0, 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class KeptAnswer:
    """An answer as it was given."""

    by: str
    """Whose it is; empty where that was not said."""
    at: str
    """When, in UTC (ISO 8601)."""
    words: tuple[str, ...]
    """Names of effects with their sizes, as they were written."""


def answers_path(data: str | Path) -> Path:
    """Return where the answers to a data file are.

    Examples
    --------
    >>> answers_path("data.csv").name
    'data.csv.answers'
    """
    path = Path(data)
    return path.with_name(path.name + SUFFIX)


def keep(data: str | Path, answer: KeptAnswer) -> int:
    """Keep an answer with its game; return its number, from 1.

    Raises
    ------
    FileFormatError
        What was kept before was changed.
    OutputError
        It cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from rtec.blind.scenario import Scenario
    >>> from rtec.blind.sealing import new
    >>> data = Path(tempfile.mkdtemp()) / "data.csv"
    >>> _ = new(3, data, scenario=Scenario(names=("backlash",)))
    >>> keep(data, KeptAnswer(by="Ada", at="2026-01-01T00:00:00+00:00", words=("backlash=12 um",)))
    1
    >>> [kept.by for kept in read_answers(data)], b"backlash" in answers_path(data).read_bytes()
    (['Ada'], False)
    """
    path = answers_path(data)
    with _alone(path):
        lines = read_text(path).splitlines() if path.exists() else []
        before = list(_read(path, lines, _first_link(data)))
        link = before[-1][1] if before else _first_link(data)
        text = base64.b64encode(json_text(asdict(answer)).encode()).decode("ascii")
        try:
            with path.open("a", encoding="ascii") as file:
                file.write(f"{text} {_link(link, text)}\n")
        except OSError as error:
            raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from None
    return len(before) + 1


def read_answers(data: str | Path) -> tuple[KeptAnswer, ...]:
    """Return the answers to a game, in order; none where nobody has answered.

    Raises
    ------
    FileFormatError
        One was changed, or a file is missing or no game.
    """
    path = answers_path(data)
    first = _first_link(data)
    return tuple(kept for kept, _ in _read(path, read_text(path).splitlines(), first)) if path.exists() else ()


def _read(path: Path, lines: Sequence[str], link: str) -> Iterator[tuple[KeptAnswer, str]]:
    """Yield each answer with its link; each link holds all that stands before it."""
    for number, line in enumerate(lines, start=1):
        text, _, sealed = line.partition(" ")
        link = _link(link, text)
        if sealed != link:
            raise FileFormatError(path, number, "this answer, or one before it, was changed", _ALLOWED)
        try:
            found = parse_json(base64.b64decode(text, validate=True))
            yield KeptAnswer(by=str(found["by"]), at=str(found["at"]), words=tuple(map(str, found["words"]))), link
        except (KeyError, TypeError, ValueError, binascii.Error):
            raise FileFormatError(path, number, "this is no answer", _ALLOWED) from None


def _first_link(data: str | Path) -> str:
    reveal(data)  # data and seal belong together
    return hashlib.sha256(read_bytes(sealed_path(data))).hexdigest()


def _link(before: str, text: str) -> str:
    return hashlib.sha256(f"{before} {text}".encode()).hexdigest()


@contextlib.contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Let one process at a time append: a class answers at the same moment."""
    lock = path.with_name(path.name + ".lock")
    until_s = time.monotonic() + _PATIENCE_S
    while True:
        try:
            os.close(os.open(lock, os.O_CREAT | os.O_EXCL))
            break
        except FileExistsError:
            if time.monotonic() > until_s:
                hint = f"another answer is being written; where none is, delete {lock.name}"
                raise OutputError(f"{path}: {hint}") from None
            time.sleep(_PAUSE_S)
        except OSError as error:
            raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from None
    try:
        yield
    finally:
        lock.unlink(missing_ok=True)
