"""Algorithms of one's own in a plan: their text travels with the jobs, and a digest of it stands in the job.

A value is ``mine.py:Mine#DIGEST``. The digest is of the file and of the Python files beside it that it imports, so
that an edited file makes other jobs. Wherever a job is run, the text is written into a folder of that process and
loaded from there: what is run is what the digest says.
"""

from __future__ import annotations

import ast
import hashlib
import json
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from rtec.errors import ArgumentError, RtecError, meant
from rtec.io import read_text

Value = int | float | str | None
Texts = Mapping[str, str]
"""Files by their names in the folder of the algorithm's."""
NONE = "none"
"""The value of a parameter that says: nothing of it."""
_KNOWN: dict[str, Texts] = {}
"""By digest."""
_READ: dict[str, dict[str, None]] = {}
"""Values by what stands before the digest."""
_FOLDERS: list[tempfile.TemporaryDirectory[str]] = []
"""They go with the process."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnFile:
    """A parameter whose value is an algorithm of the user's: a class in a Python file, or machine code."""

    name: str
    beside: str
    """Key of the parameter that a plan has to give with it."""
    machine_code: bool = True
    python: bool = True
    """``machine_code``, ``python``: whether it may be an image, and a class."""

    @property
    def key(self) -> str:
        """Return the key of a plan."""
        return self.name

    @property
    def usual(self) -> tuple[Value, ...]:
        """Return what a plan tries that does not say."""
        return (NONE,)

    def read(self, given: object, where: str, folder: Path = Path()) -> tuple[Value, ...]:
        """Return the value of a text, with the file read.

        Parameters
        ----------
        given
            ``mine.py:Mine``, ``mine.ihx``, or ``none``.
        where
            For messages.
        folder
            Where a relative path begins.

        Raises
        ------
        ArgumentError, RtecError
            Another form, no such file or class, or a file that is no Python.
        """
        if given == NONE:
            return (NONE,)
        image = self.machine_code and str(given).lower().endswith((".ihx", ".hex"))
        file, _, kind = (str(given), "", "") if image else str(given).rpartition(":")
        if not image and not (self.python and kind and file.lower().endswith(".py")):
            forms = ["mine.py:Mine"] * self.python + ["mine.ihx"] * self.machine_code
            raise ArgumentError(where, repr(given)[:60], ", ".join(forms) + " or none")
        path = Path(file)
        texts = {path.name: read_text(folder / path, "an algorithm")}
        if kind:
            _check_class(texts[path.name], path.name, kind, where)
            texts = dict(sorted(_with_imported(folder / path, texts).items()))
        digest = hashlib.sha256(json.dumps(texts, sort_keys=True).encode()).hexdigest()[:10]
        _KNOWN[digest] = texts
        value = f"{path.name}{':' * bool(kind)}{kind}#{digest}"
        _READ.setdefault(value.partition("#")[0], {})[value] = None
        return (value,)

    def meant(self, text: str) -> tuple[Value, ...]:
        """Return the values of plans read here that a text without a digest, or with it, stands for."""
        return text, *_READ.get(text, ())

    def check_beside(self, there: bool, where: str) -> None:
        """Check that a plan gives the other parameter, too.

        Raises
        ------
        ArgumentError
            It does not.
        """
        if not there:
            allowed = f"{self.beside} beside it: the one whose step and states it has"
            raise ArgumentError(where, "", allowed, problem="stands alone")


def texts_of(values: Iterable[Value]) -> dict[str, Texts]:
    """Return the files that values of parameters stand for, by digest."""
    digests = {value.rpartition("#")[2] for value in values if isinstance(value, str) and "#" in value}
    return {digest: _KNOWN[digest] for digest in sorted(digests & _KNOWN.keys())}


def offer(texts: Mapping[str, Texts]) -> None:
    """Make files of another process known here."""
    _KNOWN.update(texts)


@cache
def unpacked(value: str) -> tuple[Path, str]:
    """Return the file and the class of a value, its text written into a folder of this process.

    Raises
    ------
    RtecError
        This process does not have the text.
    """
    name, _, digest = value.rpartition("#")
    if digest not in _KNOWN:
        raise RtecError(f"{name}: its text did not come with the job; carry the plan out with rtec campaign")
    folder = tempfile.TemporaryDirectory(prefix="rtec-own-")
    _FOLDERS.append(folder)
    for file, text in _KNOWN[digest].items():
        path = Path(folder.name, file)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    file, colon, kind = name.rpartition(":")
    return Path(folder.name, file if colon else name), kind if colon else ""


def _check_class(text: str, file: str, kind: str, where: str) -> None:
    """Refuse a file that is no Python, or does not have the name, without running it."""
    try:
        body = ast.parse(text).body
    except (SyntaxError, ValueError) as error:
        place = f", line {error.lineno}" if isinstance(error, SyntaxError) and error.lineno else ""
        raise RtecError(f"{where}: {file}{place} is no Python: {getattr(error, 'msg', error)}") from None
    classes = [one.name for one in body if isinstance(one, ast.ClassDef)]
    imported = [name.asname or name.name for one in body if isinstance(one, ast.ImportFrom) for name in one.names]
    if kind not in (*classes, *imported) and "*" not in imported:
        known = ", ".join(classes) or "none"
        raise ArgumentError(where, f"{file}:{kind}", f"a class of the file: {known}", meant(kind, classes))


_EVERYWHERE = "rtec", "firmware_model"
"""Packages that every worker has."""


def _with_imported(file: Path, texts: dict[str, str]) -> dict[str, str]:
    """Return the files that stand beside a file and are imported, by it or by one of them."""
    folder, waiting = file.parent, [texts[file.name]]
    while waiting:
        for name in _imported(waiting.pop()):
            if name in _EVERYWHERE:
                continue
            found = [folder / f"{name}.py", *sorted((folder / name).rglob("*.py"))]
            for path in found:
                relative = path.relative_to(folder).as_posix()
                if path.is_file() and relative not in texts:
                    texts[relative] = read_text(path, "a file that an algorithm imports", may_be_empty=True)
                    waiting.append(texts[relative])
    return texts


def _imported(text: str) -> Iterator[str]:
    """Yield the names of modules that a text imports, without what is inside of packages."""
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError):
        return  # told when it is loaded
    for one in ast.walk(tree):
        if isinstance(one, ast.Import):
            yield from (name.name.partition(".")[0] for name in one.names)
        elif isinstance(one, ast.ImportFrom) and one.level == 0 and one.module:
            yield one.module.partition(".")[0]
