"""A file that appears whole or not at all, and whether it can appear where it shall."""

from __future__ import annotations

import contextlib
import os
import secrets
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import BinaryIO

from rtec.errors import ArgumentError, OutputError


class WholeFile:
    """A binary file written beside its place and moved there when it is complete.

    A path that exists and is no regular file, such as a pipe, is written in place.

    Parameters
    ----------
    path
        Where the file shall be.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "z.txt"
    >>> with WholeFile(file) as whole:
    ...     whole.write(b"all or nothing")
    ...     file.exists()
    False
    >>> file.read_bytes()
    b'all or nothing'
    """

    def __init__(self, path: str | Path) -> None:
        self._path = Path(path)
        self._part: Path | None = None
        self._file: BinaryIO | None = None

    def __enter__(self) -> WholeFile:
        with self._named_errors():
            if self._path.exists() and not self._path.is_file():
                self._file = open(self._path, "wb")
            else:
                self._part = self._path.with_name(f".{self._path.name[:100]}.{secrets.token_hex(4)}.part")
                self._file = open(self._part, "xb")
        return self

    def write(self, data: bytes | memoryview) -> None:
        """Write ``data`` whole.

        Raises
        ------
        OutputError
            No space left, or any other refusal of the system.
        """
        if self._file is None:
            raise OutputError(f"{self._path}: is not open; write inside the with block")
        with self._named_errors():
            self._file.write(data)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        file, part, self._file = self._file, self._part, None
        try:
            if file is not None and kind is not None:
                with contextlib.suppress(OSError):
                    file.close()
            elif file is not None:
                with self._named_errors():
                    file.close()
                    if part is not None:
                        os.replace(part, self._path)
                        part = None
        finally:
            if part is not None:
                with contextlib.suppress(OSError):
                    part.unlink(missing_ok=True)

    @contextlib.contextmanager
    def _named_errors(self) -> Iterator[None]:
        try:
            yield
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
            hint = "free some space or choose another folder"
            raise OutputError(f"{self._path}: cannot be written: {reason}; {hint}; nothing is left behind") from error


FIGURES = (".png", ".svg", ".pdf")
"""Endings of pictures that can be drawn."""


def check_file(option: str, file: Path, *, force: bool, endings: Sequence[str] = ()) -> None:
    """Refuse a file that cannot be written, before the work begins that is to fill it.

    Parameters
    ----------
    option
        That names the file, for the error message.
    file
        Where it shall be.
    force
        Whether a file may be written over.
    endings
        Of its name; any where there are none.

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
    rtec.errors.ArgumentError: --figure: z.bmp is not allowed; allowed: a name that ends in .png, .svg or .pdf
    """
    if endings and file.suffix.lower() not in endings:
        *others, last = endings
        names = f"{', '.join(others)} or {last}" if others else last
        raise ArgumentError(option, file.name, f"a name that ends in {names}")
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
    """Refuse a folder that holds something or cannot be made, before the work begins that is to fill it.

    Parameters
    ----------
    option, folder
        As of `check_file`.
    force
        Whether it may hold something.

    Raises
    ------
    ArgumentError
        It is not empty, or it is no folder.
    OutputError
        Nothing can be written there.
    """
    there = next(place for place in (folder, *folder.absolute().parents) if os.path.lexists(place))
    if not there.is_dir():
        raise ArgumentError(option, f"{there}, a file,", "a folder", "choose another name")
    _check_room(option, folder, there)
    if there == folder and not force and any(folder.iterdir()):
        allowed = "a new or empty folder"
        raise ArgumentError(option, f"{folder}, which is not empty,", allowed, "--force writes into it")


def _check_room(option: str, place: Path, folder: Path) -> None:
    """Make a file in a folder and take it away: rights alone do not tell whether a file system can be written."""
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(f"{option}: {place} cannot be written: {reason}; choose another folder") from None
