"""Program memory as a file: Intel HEX, read with every record checked, and written.

A record is one line: a colon, then bytes as pairs of hexadecimal digits - how many data bytes, the address (two), the
type, the data, and a checksum that makes the sum of all bytes a multiple of 256. Types: 00 data, 01 end of file, 02
and 04 what is added to the addresses that follow (a segment x 16, or the upper half of 32 bits), 03 and 05 a start
address.

References
----------
Intel, "Hexadecimal Object File Format Specification", revision A, 1988.
"""

from __future__ import annotations

import bisect
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from firmware_model.errors import FirmwareError

CODE_BYTES = 65_536
"""Bytes of program memory that the MCS-51 can address (User's Manual 1994, chapter 1, "Memory Organization")."""

ERASED = 0xFF
"""What an erased byte of an EPROM reads as."""

FILE_LIMIT_BYTES = 4 << 20
"""Largest file read: 64 KiB of code with one byte in each record take 0.8 MB."""

_DATA, _END, _SEGMENT, _START_SEGMENT, _LINEAR, _START_LINEAR = range(6)
_LENGTHS = {_END: 0, _SEGMENT: 2, _START_SEGMENT: 4, _LINEAR: 2, _START_LINEAR: 4}
_OTHER_KINDS = ((b"\x7fELF", "an ELF file"), (b"PK\x03\x04", "a zip archive"), (b"S0", "a Motorola S-record file"))
_DIGITS = frozenset(b"0123456789abcdefABCDEF")


@dataclass(frozen=True, slots=True, kw_only=True)
class Image:
    r"""What a program memory of 64 KiB holds.

    Parameters
    ----------
    code
        65 536 bytes; those that no record gives are 0xFF, as an erased EPROM has them.
    used
        What records give: ``(begin, end)`` in addresses of bytes, ``end`` the first one behind, ascending, disjoint
        and not adjacent.
    source
        Where it comes from, for messages.

    Raises
    ------
    FirmwareError
        Code of another length, or ranges that are empty, out of order or outside the memory.

    Examples
    --------
    >>> image = Image.of(b"\x80\xfe", at=0x10)
    >>> image.used, image.code[0x0F:0x13].hex()
    (((16, 18),), 'ff80feff')
    """

    code: bytes = field(repr=False)
    used: tuple[tuple[int, int], ...]
    source: str

    def __post_init__(self) -> None:
        if len(self.code) != CODE_BYTES:
            raise FirmwareError("code", f"{len(self.code)} bytes", f"{CODE_BYTES} bytes")
        behind = -1
        for begin, end in self.used:
            if not behind < begin < end <= CODE_BYTES:
                allowed = f"(begin, end) ascending and apart, 0 <= begin < end <= {CODE_BYTES}"
                raise FirmwareError("used", (begin, end), allowed)
            behind = end

    @classmethod
    def of(cls, code: bytes, *, at: int = 0, source: str = "bytes") -> Image:
        """Return the memory that holds ``code`` from the address ``at`` on.

        Raises
        ------
        FirmwareError
            Code that is empty or does not fit into 64 KiB.
        """
        if not 0 <= at < at + len(code) <= CODE_BYTES:
            raise FirmwareError("code", f"{len(code)} bytes at {at:#06x}", f"1 to {CODE_BYTES} bytes below 0x10000")
        memory = bytearray([ERASED]) * CODE_BYTES
        memory[at : at + len(code)] = code
        return cls(code=bytes(memory), used=((at, at + len(code)),), source=source)


def read_hex(path: str | Path) -> Image:
    r"""Read an Intel HEX file.

    Digits of either case, line ends of any system and empty lines are taken. Records may come in any order, yet no
    byte may be given twice.

    Parameters
    ----------
    path
        The file, at most 4 MiB.

    Raises
    ------
    FirmwareError
        A file of another kind, a damaged record, code beyond 64 KiB or given twice, nothing at all, no end or
        something behind it; names file, line, the value and what is allowed.
    OSError
        A file that cannot be opened.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "loop.hex"
    >>> _ = file.write_text(":0200000080FE80\n:00000001FF\n")
    >>> read_hex(file).used
    ((0, 2),)
    """
    with Path(path).open("rb") as file:
        raw = file.read(FILE_LIMIT_BYTES + 1)
    if len(raw) > FILE_LIMIT_BYTES:
        raise FirmwareError(str(path), f"more than {FILE_LIMIT_BYTES} bytes", "an Intel HEX file of at most 4 MiB")
    _check_kind(str(path), raw)
    memory = _Memory(str(path))
    base, begin_of_end = 0, 0
    for number, text in _lines(raw):
        if begin_of_end:
            allowed = f"nothing behind the end-of-file record in line {begin_of_end}"
            raise FirmwareError(f"{path}, line {number}", _shown(text), allowed)
        kind, address, data = _record(f"{path}, line {number}", text)
        if kind == _DATA:
            memory.put(number, base, address, data)
        elif kind == _END:
            begin_of_end = number
        elif kind == _SEGMENT:
            base = int.from_bytes(data) << 4
        elif kind == _LINEAR:
            base = int.from_bytes(data) << 16
    if not begin_of_end:
        raise FirmwareError(
            str(path), "no end-of-file record", "a last line :00000001FF", "the file may have been cut off"
        )
    return memory.image()


class _Memory:
    """Bytes with the line that gave each range of them."""

    def __init__(self, source: str) -> None:
        self._source = source
        self._code = bytearray([ERASED]) * CODE_BYTES
        self._given: list[tuple[int, int, int]] = []

    def put(self, line: int, base: int, offset: int, data: bytes) -> None:
        """Place the data of one record; what would leave the 64 KiB or meet other data is refused, never wrapped."""
        where = f"{self._source}, line {line}"
        begin, end = base + offset, base + offset + len(data)
        if not data:
            return
        if end > CODE_BYTES:
            allowed = f"code below {CODE_BYTES:#07x} (64 KiB)"
            hint = "the MCS-51 addresses no more; banked images do not run here"
            raise FirmwareError(where, f"code at {begin:#07x} to {end - 1:#07x}", allowed, hint)
        place = bisect.bisect(self._given, (begin, end, line))
        for other_begin, other_end, other_line in self._given[max(place - 1, 0) : place + 1]:
            if begin < other_end and other_begin < end:
                twice = f"{max(begin, other_begin):#06x} to {min(end, other_end) - 1:#06x}"
                allowed = f"bytes that no other record gives, and line {other_line} does"
                raise FirmwareError(where, f"code at {twice}, for the second time,", allowed)
        self._given.insert(place, (begin, end, line))
        self._code[begin:end] = data

    def image(self) -> Image:
        """Return what was placed, with adjacent ranges joined."""
        if not self._given:
            raise FirmwareError(self._source, "a file without code", "at least one data record (type 00)")
        joined: list[tuple[int, int]] = []
        for begin, end, _ in self._given:
            if joined and joined[-1][1] == begin:
                joined[-1] = (joined[-1][0], end)
            else:
                joined.append((begin, end))
        return Image(code=bytes(self._code), used=tuple(joined), source=self._source)


def _check_kind(path: str, raw: bytes) -> None:
    allowed = "Intel HEX, text with a colon before each record"
    if not raw.strip():
        raise FirmwareError(path, "an empty file", allowed)
    for magic, name in _OTHER_KINDS:
        if raw.startswith(magic):
            raise FirmwareError(path, name, allowed, "assemblers and linkers write .hex or .ihx, too")
    if b"\0" in raw:
        raise FirmwareError(path, "a binary file", allowed, "objcopy -I binary -O ihex converts a memory dump")


def _lines(raw: bytes) -> Iterator[tuple[int, bytes]]:
    # ctrl-Z is how CP/M and DOS tools end a text
    for number, line in enumerate(raw.removesuffix(b"\x1a").splitlines(), 1):
        text = line.strip()
        if text:
            yield number, text


def _record(where: str, text: bytes) -> tuple[int, int, bytes]:
    digits = text[1:]
    if text[:1] != b":":
        raise FirmwareError(where, _shown(text), "a record, which begins with a colon")
    for column, digit in enumerate(digits, 2):
        if digit not in _DIGITS:
            raise FirmwareError(where, f"{chr(digit)!r} in column {column}", "hexadecimal digits 0-9, A-F, a-f")
    if len(digits) < 10 or len(digits) % 2:
        raise FirmwareError(where, f"{len(digits)} digits", "an even number of at least 10", "is the line cut off?")
    whole = bytes.fromhex(digits.decode("ascii"))
    length, address, kind, data, given = whole[0], int.from_bytes(whole[1:3]), whole[3], whole[4:-1], whole[-1]
    if len(data) != length:
        raise FirmwareError(where, f"{len(data)} data bytes", f"{length}, as the record says", "is the line cut off?")
    right = -sum(whole[:-1]) & 0xFF
    if given != right:
        raise FirmwareError(where, f"checksum {given:02X}", f"{right:02X} for these bytes", "the line was changed")
    if kind > _START_LINEAR:
        raise FirmwareError(where, f"record type {kind:02X}", "types 00 to 05")
    if kind != _DATA and length != _LENGTHS[kind]:
        raise FirmwareError(where, f"{length} data bytes in a record of type {kind:02X}", f"{_LENGTHS[kind]}")
    return kind, address, data


def _shown(text: bytes) -> str:
    return repr(text[:40].decode("ascii", "backslashreplace"))
