"""Text files of instruments: read whole with a limit and known line numbers, written whole or not at all."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rtec.errors import FileFormatError
from rtec.whole_file import WholeFile

MAX_BYTES = 1 << 28
"""Largest file that is read (256 MiB, about five million rows): a bound on memory, not a property of a format."""
PLAIN_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
"""A number as instruments write it: digits of ASCII, a point, an exponent."""
LONGEST_SHOWN = 40
"""Characters of what a file holds that a message shows."""
_CONTROL = re.compile(rb"[\x01-\x08\x0e-\x1f]")
_UTF_16 = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


def read_text(path: str | Path) -> str:
    r"""Return the text of a file, with every line end turned into ``\n``.

    Parameters
    ----------
    path
        A regular file in UTF-8 (a byte-order mark is taken off).

    Raises
    ------
    FileFormatError
        The file is missing, no regular file, empty, too large, not UTF-8, or holds NUL bytes.

    Examples
    --------
    >>> read_text("z.csv")
    Traceback (most recent call last):
        ...
    rtec.errors.FileFormatError: z.csv: cannot be read (No such file or directory); allowed: a readable text file
    """
    data = _read_bytes(path)
    _refuse_nul(path, data)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        byte = error.object[error.start]
        raise FileFormatError(path, line, f"byte 0x{byte:02x} is no UTF-8", "text in UTF-8") from None
    return _lines_of(path, text)


def read_any_text(path: str | Path) -> tuple[str, str]:
    r"""Return the text of a file in whatever encoding instruments write, and the name of the encoding.

    Parameters
    ----------
    path
        A regular file in UTF-8, in UTF-16 (with or without a byte-order mark), or else in Windows-1252, of which
        Latin-1 is a part.

    Returns
    -------
    text, encoding
        With ``\n`` between the lines; ``utf-8``, ``utf-16`` or ``windows-1252``.

    Raises
    ------
    FileFormatError
        The file is missing, no regular file, empty, too large, or binary.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "x.csv"
    >>> _ = file.write_bytes("Abweichung (µm)\r\n".encode("latin-1"))
    >>> read_any_text(file)
    ('Abweichung (µm)\n', 'windows-1252')
    """
    data = _read_bytes(path)
    if (wide := _utf_16(data)) is not None:
        try:
            return _lines_of(path, data.decode(wide).removeprefix("\ufeff")), "utf-16"
        except UnicodeDecodeError as error:
            problem = f"broken UTF-16 at byte {error.start}"
            raise FileFormatError(path, None, problem, "whole text; the file may be cut off") from None
    _refuse_nul(path, data)
    data = data.removesuffix(b"\x1a")  # how DOS ended a text
    try:
        return _lines_of(path, data.decode("utf-8-sig")), "utf-8"
    except UnicodeDecodeError:
        pass
    if (control := _CONTROL.search(data)) is not None:
        line = data.count(b"\n", 0, control.start()) + 1
        raise FileFormatError(path, line, f"byte 0x{control[0][0]:02x} is no text", "text, no binary data")
    return _lines_of(path, data.decode("windows-1252", "replace")), "windows-1252"


def _utf_16(data: bytes) -> str | None:
    """Return which UTF-16 a file is in, by its byte-order mark or by where its NUL bytes stand, or None."""
    if (marked := _UTF_16.get(data[:2])) is not None:
        return marked
    few = data[:2000]
    nul = [few[0::2].count(0), few[1::2].count(0)]
    if len(data) % 2 or 4 * max(nul) < len(few) or min(nul):
        return None
    return "utf-16-le" if nul[1] else "utf-16-be"


def _read_bytes(path: str | Path) -> bytes:
    """Return what is in a regular file of no unreasonable size."""
    file = Path(path)
    try:
        size = file.stat().st_size
        if not file.is_file():
            raise FileFormatError(path, None, "this is no regular file", "a text file")
        if size > MAX_BYTES:
            raise FileFormatError(path, None, f"{size} bytes", f"at most {MAX_BYTES} bytes; split the file")
        return file.read_bytes()
    except (OSError, ValueError) as error:
        if isinstance(error, FileFormatError):
            raise
        reason = getattr(error, "strerror", None) or str(error)
        raise FileFormatError(path, None, f"cannot be read ({reason})", "a readable text file") from None


def _refuse_nul(path: str | Path, data: bytes) -> None:
    if (nul := data.find(b"\0")) >= 0:
        raise FileFormatError(path, data.count(b"\n", 0, nul) + 1, "a NUL byte", "text in UTF-8, no binary data")


def _lines_of(path: str | Path, text: str) -> str:
    if not text.strip():
        raise FileFormatError(path, None, "the file is empty", "a header line and rows")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def write_lines(path: str | Path, lines: Iterable[str]) -> None:
    """Write lines to ``path``, which appears complete or stays as it was.

    Raises
    ------
    OutputError
        The folder is missing or not writable, or the disk is full.

    Examples
    --------
    >>> write_lines("/nowhere/z.csv", ["a"])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    rtec.errors.OutputError: /nowhere/z.csv: cannot be written: No such file or directory; ...
    """
    with WholeFile(path) as file:
        file.write("".join(f"{line}\n" for line in lines).encode())


def shown(text: str) -> str:
    """Return ``text`` quoted and short enough for a one-line message.

    Examples
    --------
    >>> shown("abc")
    "'abc'"
    """
    return repr(text if len(text) <= LONGEST_SHOWN else text[: LONGEST_SHOWN - 3] + "...")


def plain_numbers(lines: list[str], columns: int, delimiter: str | None) -> NDArray[np.float64] | None:
    """Return rows of finite numbers in one quick sweep, or None where anything else is met.

    Parameters
    ----------
    lines
        The rows, without header; empty ones are passed over.
    columns
        Numbers that each row has to have.
    delimiter
        What separates them; None for white space.

    Returns
    -------
    ndarray or None
        Shape (rows, columns). None says only that a slower reader has to find out what is wrong and where.

    Examples
    --------
    >>> plain_numbers(["1,2", "3,4"], 2, ",").tolist()
    [[1.0, 2.0], [3.0, 4.0]]
    >>> plain_numbers(["1,2", "3,nan"], 2, ",") is None
    True
    """
    if not any(line.strip() for line in lines):
        return None
    try:
        rows = np.loadtxt(lines, delimiter=delimiter, comments=None, ndmin=2)
    except (ValueError, OverflowError):
        return None
    return rows if rows.shape[1] == columns and np.isfinite(rows).all() else None
