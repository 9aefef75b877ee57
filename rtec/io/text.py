"""Files of others read as text: of limited size, in a known encoding, with errors that name file and line."""

from __future__ import annotations

import re
import zlib
from pathlib import Path

from rtec.errors import FileFormatError

MAX_BYTES = 1 << 28
"""Largest file that is read (256 MiB, about five million rows): a bound on memory, not a property of a format."""
_CONTROL = re.compile(rb"[\x01-\x08\x0e-\x1f]")
_GZIP = b"\x1f\x8b"
_UTF_16 = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


def read_bytes(path: str | Path, what: str = "a text file", *, most_bytes: int = MAX_BYTES) -> bytes:
    """Return what is in a regular file of no unreasonable size; ``what`` it should be is for error messages.

    Raises
    ------
    FileFormatError
        The file is missing, no regular file, or too large.
    """
    file = Path(path)
    try:
        size = file.stat().st_size
        if not file.is_file():
            raise FileFormatError(path, None, "this is no regular file", what)
        if size > most_bytes:
            raise FileFormatError(path, None, f"{size} bytes", f"{what} of at most {most_bytes} bytes")
        return file.read_bytes()
    except FileFormatError:
        raise
    except (OSError, ValueError) as error:
        raise unreadable(path, error, what) from None


def unreadable(path: str | Path, error: Exception, what: str) -> FileFormatError:
    """Return what is said of a file that the system does not open or read.

    Examples
    --------
    >>> str(unreadable("z.csv", PermissionError(13, "Permission denied"), "a text file"))
    'z.csv: cannot be read (Permission denied); use a text file'
    """
    if isinstance(error, FileNotFoundError):
        return FileFormatError(path, None, "there is no such file", f"the path of {what}")
    return FileFormatError(path, None, f"cannot be read ({getattr(error, 'strerror', None) or error})", what)


def read_text(
    path: str | Path, what: str = "a text file", *, most_bytes: int = MAX_BYTES, may_be_empty: bool = False
) -> str:
    r"""Return the text of a file, with every line end turned into ``\n``.

    It is in UTF-8 (a byte-order mark is taken off); a file without a word is allowed where it may be empty.

    Raises
    ------
    FileFormatError
        The file is missing, no regular file, empty, too large, not UTF-8, or holds NUL bytes.

    Examples
    --------
    >>> read_text("z.csv")
    Traceback (most recent call last):
        ...
    rtec.errors.FileFormatError: z.csv: there is no such file; use the path of a text file
    """
    data = read_bytes(path, what, most_bytes=most_bytes)
    _refuse_nul(path, data)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        byte = error.object[error.start]
        raise FileFormatError(path, line, f"byte 0x{byte:02x} is no UTF-8", "text in UTF-8") from None
    return _lines_of(path, text, may_be_empty)


def read_any_text(path: str | Path, what: str = "a text file", *, most_bytes: int = MAX_BYTES) -> tuple[str, str]:
    r"""Return the text of a file in whatever encoding instruments write, and the name of the encoding.

    UTF-8, UTF-16 (with or without a byte-order mark), or else Windows-1252, of which Latin-1 is a part. A file that
    is compressed by gzip is read through.

    Returns
    -------
    text, encoding
        With ``\n`` between the lines; ``utf-8``, ``utf-16`` or ``windows-1252``.

    Raises
    ------
    FileFormatError
        The file is missing, no regular file, empty, too large (compressed or not), broken, or binary.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "x.csv"
    >>> _ = file.write_bytes("Abweichung (µm)\r\n".encode("latin-1"))
    >>> read_any_text(file)
    ('Abweichung (µm)\n', 'windows-1252')
    """
    data = read_bytes(path, what, most_bytes=most_bytes)
    if data.startswith(_GZIP):
        data = _unzipped(path, data, most_bytes)
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


def _unzipped(path: str | Path, data: bytes, most_bytes: int) -> bytes:
    """Return what gzip has compressed, several members one after the other; never more than is allowed."""
    found = b""
    while data:
        inflate = zlib.decompressobj(wbits=31)
        try:
            found += inflate.decompress(data, most_bytes - len(found) + 1)
        except zlib.error as error:
            raise FileFormatError(path, None, f"broken gzip ({error})", "a whole file; copy it again") from None
        if len(found) > most_bytes:
            raise FileFormatError(path, None, "unpacked it is too large", f"at most {most_bytes} bytes of text")
        if not inflate.eof:
            raise FileFormatError(path, None, "the gzip file is cut off", "a whole file; copy it again")
        data = inflate.unused_data.lstrip(b"\0")
    return found


def _utf_16(data: bytes) -> str | None:
    """Return which UTF-16 a file is in, by its byte-order mark or by where its NUL bytes stand, or None."""
    if (marked := _UTF_16.get(data[:2])) is not None:
        return marked
    few = data[:2000]
    nul = [few[0::2].count(0), few[1::2].count(0)]
    if len(data) % 2 or 4 * max(nul) < len(few) or min(nul):
        return None
    return "utf-16-le" if nul[1] else "utf-16-be"


def _refuse_nul(path: str | Path, data: bytes) -> None:
    if (nul := data.find(b"\0")) >= 0:
        raise FileFormatError(path, data.count(b"\n", 0, nul) + 1, "a NUL byte", "text in UTF-8, no binary data")


def _lines_of(path: str | Path, text: str, may_be_empty: bool = False) -> str:
    if not may_be_empty and not text.strip():
        raise FileFormatError(path, None, "the file is empty", "a header line and rows")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def brief(value: object, longest: int = 80) -> str:
    """Return a value for a message of one line.

    Examples
    --------
    >>> brief("x" * 1000)[-8:], len(brief("x" * 1000))
    ('xxxxx...', 80)
    """
    try:
        text = " ".join(str(value).split())
    except ValueError:  # Python refuses to print an int of more than 4300 digits
        return "a number of thousands of digits"
    return text if len(text) <= longest else text[: longest - 3] + "..."
