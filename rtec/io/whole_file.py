"""A file that appears whole or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import TracebackType
from typing import BinaryIO

from rtec.errors import OutputError


class WholeFile:
    """A binary file written beside its place and moved there when it is complete.

    A path that exists and is no regular file, such as a pipe, is written in place.

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


def write_bytes(path: str | Path, data: bytes) -> None:
    """Write a file, which appears complete or stays as it was.

    Raises
    ------
    OutputError
        The folder is missing or not writable, or the disk is full.

    Examples
    --------
    >>> write_bytes("/nowhere/z.csv", b"a")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    rtec.errors.OutputError: /nowhere/z.csv: cannot be written: No such file or directory; ...
    """
    with WholeFile(path) as file:
        file.write(data)


def write_text(path: str | Path, text: str) -> None:
    """Write text in UTF-8 as `write_bytes` does, with the same bytes on every system."""
    write_bytes(path, text.encode())


def write_lines(path: str | Path, lines: Iterable[str]) -> None:
    """Write lines as `write_text` does, with an end behind each; they need not fit into memory together."""
    with WholeFile(path) as file:
        for line in lines:
            file.write(f"{line}\n".encode())
