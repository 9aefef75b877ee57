"""Where results go: whether that can be written, before the work begins; a folder that is made for them."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from rtec.errors import ArgumentError, OutputError

_MOST_FOLDERS = 100_000
FIGURES = (".png", ".svg", ".pdf")
"""Endings of pictures that can be drawn."""


def check_file(option: str, file: Path, *, force: bool, endings: Sequence[str] = ()) -> None:
    """Refuse a file that cannot be written, before the work begins that is to fill it.

    With ``force`` it may be written over; its name may end in anything where no endings are asked for.

    Raises
    ------
    ArgumentError
        Its name ends otherwise.
    OutputError
        It exists and may not be written over, or it cannot be made there.

    Examples
    --------
    >>> check_file("--figure", Path("z.bmp"), force=False, endings=FIGURES)
    Traceback (most recent call last):
        ...
    rtec.errors.ArgumentError: --figure: z.bmp has another ending; use a name that ends in .png, .svg or .pdf
    """
    if endings and file.suffix.lower() not in endings:
        *others, last = endings
        names = f"{', '.join(others)} or {last}" if others else last
        raise ArgumentError(option, file.name, f"a name that ends in {names}", problem="has another ending")
    if file.is_dir():
        raise OutputError(f"{option}: {file} is a folder; name a file")
    special = file.exists() and not file.is_file()  # a pipe is written in place, and nothing in it is lost
    if os.path.lexists(file) and not special and not force:
        raise OutputError(f"{option}: {file} exists; choose another name, or overwrite it with --force")
    if not file.parent.is_dir():
        raise OutputError(f"{option}: there is no folder {file.parent} for {file.name}; make it first")
    if special and not os.access(file, os.W_OK):
        raise OutputError(f"{option}: {file} cannot be written: no permission")
    if not special:
        _check_room(option, file, file.parent)


def check_folder(option: str, folder: Path, *, force: bool) -> None:
    """Refuse a folder that holds something (but with ``force``) or cannot be made, before work begins that fills it.

    Raises
    ------
    ArgumentError
        It is not empty, or it is no folder.
    OutputError
        Nothing can be written there.
    """
    there = next(place for place in (folder, *folder.absolute().parents) if os.path.lexists(place))
    if not there.is_dir():
        raise ArgumentError(option, there, "the name of a folder", problem="is a file")
    _check_room(option, folder, there)
    if there == folder and not force and any(folder.iterdir()):
        allowed = "a new or an empty folder, or write into this one with --force"
        raise ArgumentError(option, folder, allowed, problem="is not empty")


def _check_room(option: str, place: Path, folder: Path) -> None:
    """Make a file in a folder and take it away: rights alone do not tell whether a file system can be written."""
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(f"{option}: {place} cannot be written: {reason}; choose another folder") from None


@contextmanager
def report_folder(folder: Path | None, name: str) -> Iterator[Path]:
    """Make the report's folder where it does not exist, and take it away again where writing fails.

    Yields the folder; None stands for the first of ``rtec-NAME-1``, ``-2``, ... that does not exist yet. Two runs at
    once never share one.

    Raises
    ------
    OutputError
        It cannot be made.
    """
    made: list[Path] = []
    try:
        try:
            yield _numbered(name, made) if folder is None else _made(folder, made)
        except BaseException:
            for new in reversed(made):
                with suppress(OSError):
                    new.rmdir()  # only where it is empty
            raise
    except FileExistsError as error:
        raise OutputError(f"{error.filename}: {error.strerror}") from None


def _made(folder: Path, made: list[Path]) -> Path:
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    for place in reversed(missing):
        _make(place)
        made.append(place)
    return folder


def _numbered(name: str, made: list[Path]) -> Path:
    for number in range(1, _MOST_FOLDERS):
        folder = Path(f"rtec-{name}-{number}")
        with suppress(FileExistsError):
            _make(folder)
            made.append(folder)
            return folder
    raise OutputError(f"rtec-{name}-1 to -{_MOST_FOLDERS - 1} all exist; choose a folder with -o")


def _make(folder: Path) -> None:
    try:
        folder.mkdir()
    except FileExistsError:
        raise
    except OSError as error:
        raise OutputError(f"{folder}: cannot be made: {error.strerror}; choose a folder with -o") from None
