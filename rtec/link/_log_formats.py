"""What the three log formats hold, read line by line or object by object with every length checked.

A log comes from anywhere, and one that was cut off is the rule after a crash: what was whole is handed out first,
then an error says where it ends.
"""

from __future__ import annotations

import enum
import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import BinaryIO

from rtec.errors import FileFormatError
from rtec.link.frame import PAYLOAD_BYTES, Frame
from rtec.units import PS_PER_NS, PS_PER_S

LONGEST_LINE_BYTES = 4096
LONGEST_CONTAINER_BYTES = 1 << 24
"""Of a BLF container, packed or unpacked (writers use 128 KiB): a bound on memory, no property of the format."""


class Direction(enum.Enum):
    """Direction of a frame, as seen by the recorder."""

    RECEIVED = "Rx"
    SENT = "Tx"


@dataclass(frozen=True, slots=True, kw_only=True)
class Logged:
    """A frame of a log."""

    frame: Frame
    """The frame."""
    time_ps: int
    """Since the first frame of the log; for the reader of a format, on the clock of the file."""
    direction: Direction
    """Its direction as seen by the recorder."""


def _time_ps(text: str) -> int:
    return int(Decimal(text) * PS_PER_S)


def _text_lines(path: Path) -> Iterator[tuple[int, str]]:
    """Yield the lines with their numbers; one without an end is an error, since a shorter frame may look whole."""
    with path.open("rb") as file:
        number = 0
        while line := file.readline(LONGEST_LINE_BYTES):
            number += 1
            if not line.endswith(b"\n"):
                if len(line) == LONGEST_LINE_BYTES:
                    raise FileFormatError(path, number, "the line is too long", f"{LONGEST_LINE_BYTES} bytes at most")
                raise FileFormatError(
                    path, number, f"the log is cut off: {line[:60].decode(errors='replace')!r} has no end",
                    "whole lines; if this one is whole, add a line end",
                )  # fmt: skip
            if b"\0" in line:
                raise FileFormatError(path, number, "a NUL byte", "text; is this a log of another format?")
            yield number, line.decode(errors="replace").strip()


_CANDUMP = re.compile(
    r"\((?P<time>\d{1,12}\.\d{1,9})\)\s+\S+\s+(?P<id>[0-9A-F]{3}|[0-9A-F]{8})#"
    r"(?:(?P<data>(?:[0-9A-F]{2}){0,8})|(?P<other>R\d?|#[0-9A-F]+))(?:\s+(?P<way>[RT]))?",
    re.ASCII | re.IGNORECASE,
)
_CANDUMP_ERROR_FLAG = 0x20000000


def read_candump(path: Path) -> Iterator[Logged]:
    """Yield the frames of a log of ``candump -L``."""
    for number, text in _text_lines(path):
        if not text:
            continue
        if (match := _CANDUMP.fullmatch(text)) is None:
            raise FileFormatError(path, number, f"{text[:60]!r}", "a line of 'candump -L': (seconds) channel id#data")
        identifier = int(match["id"], 16)
        extended = len(match["id"]) == 8
        if match["data"] is None or (extended and identifier & _CANDUMP_ERROR_FLAG):
            continue
        if identifier > (0x1FFFFFFF if extended else 0x7FF):
            raise FileFormatError(path, number, f"identifier {match['id']}", "up to 7FF, or 1FFFFFFF as 8 digits")
        frame = Frame(identifier=identifier, data=bytes.fromhex(match["data"]), extended=extended)
        way = Direction.SENT if (match["way"] or "R") in "Tt" else Direction.RECEIVED
        yield Logged(frame=frame, time_ps=_time_ps(match["time"]), direction=way)


_ASC_BASE = re.compile(r"base\s+(?P<base>hex|dec)(?:\s+timestamps\s+(?P<times>absolute|relative))?", re.IGNORECASE)
_ASC_EVENT = re.compile(r"(?P<time>\d{1,12}\.\d{1,9})\s+(?P<rest>.*)", re.ASCII)
_ASC_FRAME = re.compile(
    r"\d+\s+(?P<id>[0-9A-F]{1,10}?)(?P<extended>x?)\s+(?P<way>Rx|Tx)\s+d\s+(?P<length>[0-9A-F]{1,2})(?P<data>.*)",
    re.ASCII | re.IGNORECASE,
)
_ASC_LIKE_FRAME = re.compile(r"\d+\s+(?!ErrorFrame)\w+\s+(Rx|Tx)\b(?!\s+r\b)", re.ASCII | re.IGNORECASE)
"""A data frame: neither a remote nor an error frame."""


def read_asc(path: Path) -> Iterator[Logged]:
    """Yield the frames of an ASC log; times count from its start, or from event to event where it says so."""
    base, relative, time_ps = 0, False, 0
    for number, text in _text_lines(path):
        if header := _ASC_BASE.match(text):
            base = 10 if header["base"].lower() == "dec" else 16
            relative = (header["times"] or "").lower() == "relative"
        if (event := _ASC_EVENT.fullmatch(text)) is None:
            continue
        if not base:
            raise FileFormatError(path, number, "an event before the header", "'base hex timestamps absolute' first")
        time_ps = _time_ps(event["time"]) + (time_ps if relative else 0)
        if match := _ASC_FRAME.fullmatch(event["rest"]):
            way = Direction.SENT if match["way"].lower() == "tx" else Direction.RECEIVED
            yield Logged(frame=_asc_frame(path, number, match, base), time_ps=time_ps, direction=way)
        elif _ASC_LIKE_FRAME.match(event["rest"]):
            raise FileFormatError(
                path, number, f"{text[:60]!r}", "time, channel, identifier, Rx or Tx, d, length, bytes"
            )
    if not base:
        raise FileFormatError(
            path, None, "there is no header", "an ASC log with a line 'base hex timestamps absolute'"
        )


def _asc_frame(path: Path, number: int, match: re.Match[str], base: int) -> Frame:
    try:
        length = int(match["length"], 16)
        data = bytes(int(byte, base) for byte in match["data"].split()[:length])
        if len(data) != length or length > PAYLOAD_BYTES:
            raise ValueError(f"{len(data)} bytes where {length} are announced")
        return Frame(identifier=int(match["id"], base), data=data, extended=bool(match["extended"]))
    except ValueError as error:  # an ArgumentError is one, too
        raise FileFormatError(path, number, str(error), "a classic frame with as many bytes as announced") from None


# BLF: a file header, then objects; the frames are objects inside packed containers and may straddle two of them
_BLF_FILE = struct.Struct("<4sL")
_BLF_OBJECT = struct.Struct("<4sHHLL")
_BLF_CONTAINER = struct.Struct("<H6xL4x")
_BLF_TIMES = {1: struct.Struct("<LHHQ"), 2: struct.Struct("<LBxHQ8x")}
_BLF_FRAME = struct.Struct("<HBBL8s")
_BLF_FRAMES, _BLF_PACKED = (1, 86), 10
_BLF_SENT, _BLF_REMOTE, _BLF_EXTENDED = 0x01, 0x80, 0x80000000


def read_blf(path: Path) -> Iterator[Logged]:
    """Yield the frames of a BLF log."""
    with path.open("rb") as file:
        head = file.read(_BLF_FILE.size)
        if head[:4] != b"LOGG"[: len(head)] or not head:
            raise FileFormatError(path, None, f"it begins with {head[:4]!r}", "a BLF log, which begins with LOGG")
        if len(head) < _BLF_FILE.size:
            raise _cut_off(path, len(head))
        _, size = _BLF_FILE.unpack(head)
        if not _BLF_FILE.size <= size <= LONGEST_LINE_BYTES:
            raise FileFormatError(path, None, f"a file header of {size} bytes", "144 bytes")
        _read_whole(path, file, size - len(head))
        rest = b""
        while container := _next_container(path, file):
            begun = file.tell()
            rest, frames = _split_objects(path, rest + container, begun)
            yield from frames
        if rest.strip(b"\0"):
            raise _cut_off(path, file.tell())


def _cut_off(path: Path, offset: int) -> FileFormatError:
    return FileFormatError(path, None, f"the log is cut off at byte {offset}", "a whole log")


def _read_whole(path: Path, file: BinaryIO, size: int) -> bytes:
    data = file.read(size)
    if len(data) < size:
        raise _cut_off(path, file.tell())
    return data


def _next_container(path: Path, file: BinaryIO) -> bytes:
    """Return what the next container holds, or nothing at the end of the file."""
    while True:
        begun = file.tell()
        head = file.read(_BLF_OBJECT.size)
        if not head.strip(b"\0"):
            return b""
        if len(head) < _BLF_OBJECT.size:
            raise _cut_off(path, file.tell())
        mark, _, _, size, kind = _BLF_OBJECT.unpack(head)
        if mark != b"LOBJ":
            raise FileFormatError(path, None, f"at byte {begun}: {mark!r}", "an object, which begins with LOBJ")
        if not _BLF_OBJECT.size <= size <= LONGEST_CONTAINER_BYTES:
            raise FileFormatError(
                path, None, f"at byte {begun}: an object of {size} bytes", f"up to {LONGEST_CONTAINER_BYTES} bytes"
            )
        body = _read_whole(path, file, size - len(head))
        file.read(size % 4)  # writers fill up by so many bytes, although that does not align anything
        if kind == _BLF_PACKED:
            return _unpack(path, begun, body)


def _unpack(path: Path, begun: int, body: bytes) -> bytes:
    if len(body) < _BLF_CONTAINER.size:
        raise FileFormatError(path, None, f"at byte {begun}: a container without a head", "a BLF log")
    method, _ = _BLF_CONTAINER.unpack_from(body)
    packed = body[_BLF_CONTAINER.size :]
    if method == 0:
        return packed
    if method != 2:
        raise FileFormatError(path, None, f"at byte {begun}: packing method {method}", "0 (none) or 2 (zlib)")
    unpacker = zlib.decompressobj()
    try:
        data = unpacker.decompress(packed, LONGEST_CONTAINER_BYTES)
    except zlib.error as error:
        raise FileFormatError(path, None, f"at byte {begun}: a container is damaged ({error})", "a BLF log") from None
    if unpacker.unconsumed_tail:
        raise FileFormatError(
            path,
            None,
            f"at byte {begun}: a container unpacks to more than {LONGEST_CONTAINER_BYTES} bytes",
            "less",
        )
    return data


def _split_objects(path: Path, data: bytes, offset: int) -> tuple[bytes, list[Logged]]:
    """Return what is left for the next container, and the frames before it."""
    frames: list[Logged] = []
    position = 0
    while True:
        found = data.find(b"LOBJ", position, position + 8)
        if found < 0:
            if len(data) - position >= 8:
                raise FileFormatError(path, None, f"in the container before byte {offset}: no object", "a BLF log")
            return data[position:], frames
        if len(data) - found < _BLF_OBJECT.size:
            return data[found:], frames
        _, head_size, version, size, kind = _BLF_OBJECT.unpack_from(data, found)
        if not _BLF_OBJECT.size <= head_size <= size <= LONGEST_CONTAINER_BYTES:
            raise FileFormatError(
                path, None, f"in the container before byte {offset}: an object of {size} bytes, its head {head_size}",
                f"up to {LONGEST_CONTAINER_BYTES} bytes",
            )  # fmt: skip
        if len(data) - found < size:
            return data[found:], frames
        if kind in _BLF_FRAMES and version in _BLF_TIMES:
            frames += _blf_frame(path, data[found : found + size], version, offset)
        position = found + size


def _blf_frame(path: Path, item: bytes, version: int, offset: int) -> list[Logged]:
    """Return the frame of an object, or nothing where it is a remote one."""
    try:
        times = _BLF_TIMES[version]
        flags, _, _, stamp = times.unpack_from(item, _BLF_OBJECT.size)
        _, marks, length, identifier, data = _BLF_FRAME.unpack_from(item, _BLF_OBJECT.size + times.size)
        way = Direction.SENT if marks & _BLF_SENT else Direction.RECEIVED
        if marks & _BLF_REMOTE:
            return []
        if length > PAYLOAD_BYTES:
            raise ValueError(f"{length} bytes in a classic frame")
        extended = bool(identifier & _BLF_EXTENDED)
        frame = Frame(identifier=identifier & ~_BLF_EXTENDED, data=data[:length], extended=extended)
    except (struct.error, ValueError) as error:  # an ArgumentError is a ValueError
        raise FileFormatError(
            path, None, f"in the container before byte {offset}: {error}", "classic frames as the format has them"
        ) from None
    time_ps = stamp * (10_000 if flags == 1 else 1) * PS_PER_NS
    return [Logged(frame=frame, time_ps=time_ps, direction=way)]
