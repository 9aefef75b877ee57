"""The messages of box and PC by name: from a frame's bytes to fields with labels and back, as ``rtec.dbc`` says.

The nodes themselves pack and read frames with the compiled functions of ``_frame_kernels``; a test holds these to the
DBC. This face is for logs, views and programs of others. The DBC lists the axes 1 to 3; axes up to 15 have the same
messages, with the axis number added to the base identifier (:class:`Kind`).
"""

from __future__ import annotations

import enum
import functools
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from rtec.checks import whole_within
from rtec.errors import ArgumentError, FileFormatError, nearest, unknown
from rtec.io import read_any_text
from rtec.link import _frame_kernels
from rtec.link._crc_kernels import sealed
from rtec.link.frame import PAYLOAD_BYTES, Frame

if TYPE_CHECKING:
    from cantools.database.can import Database, Message as DbcMessage, Signal

MOST_AXES = _frame_kernels.MOST_AXES
LISTED_AXES = 3
"""Axes that the DBC file lists."""

PACKAGED = "rtec.dbc"

MOST_BYTES = 1 << 18
"""Of a DBC file: twenty times ours. The parser takes seconds for a file full of nonsense of this size."""
MOST_DIGITS = 6
MOST_BITS = 512
"""Of any message in a DBC file: those of CAN FD. The parser sets up memory for as many as the file claims."""


class Kind(enum.IntEnum):
    """The kinds of messages, by the identifier that the axis number is added to; a hold is for every axis."""

    HOLD = _frame_kernels.HOLD
    SETUP = _frame_kernels.SETUP
    EXPECTED = _frame_kernels.EXPECTED
    STATUS = _frame_kernels.STATUS
    REQUEST = _frame_kernels.REQUEST
    CORRECTIONS = _frame_kernels.CORRECTIONS
    POSITION = _frame_kernels.POSITION
    PROBE = _frame_kernels.PROBE


NAMES = {kind: kind.name.capitalize() for kind in Kind}
KINDS = {name: kind for kind, name in NAMES.items()}


_NEED_NOT_BE_LISTED = (Kind.SETUP, Kind.EXPECTED)
"""Messages that a user's DBC may leave out: box and PC work without them."""


class Verdict(enum.Enum):
    """Verdict on a frame under one of our identifiers."""

    RIGHT = "right"
    WRONG_LENGTH = "wrong length"
    """Not eight bytes: there are no fields to read."""
    WRONG_CHECKSUM = "wrong checksum"
    CONTRADICTORY = "contradictory"
    """The checksum is right, but the total of a request and its inverse disagree."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Message:
    """A frame by name."""

    name: str
    """``Hold``, ``Setup``, ``Expected``, ``Status``, ``Request``, ``Corrections``, ``Position`` or ``Probe``."""
    axis: int
    """1 to 15; of a hold, the axis that is its cause (0: none)."""
    values: Mapping[str, int | str]
    """Field by field: a label where the DBC has one for the value, else the number as it is sent, before the factor
    that the DBC has for a step. Empty if the length is wrong."""
    verdict: Verdict
    """Whether the frame is valid. Order and session are for the node to judge, which knows what came."""


class MessageSet:
    """The message set; make one with :meth:`load`.

    Examples
    --------
    >>> messages = MessageSet.load()
    >>> frame = messages.encode("Request", 2, {"Total": -3, "Enable": 1, "Session": 7})
    >>> hex(frame.identifier), frame.data.hex(" ")
    ('0x202', 'f8 01 fd ff 02 00 08 07')
    >>> message = messages.decode(frame.identifier, frame.data)
    >>> message.name, message.axis, message.values["Total"], message.verdict.name
    ('Request', 2, -3, 'RIGHT')
    >>> status = messages.encode("Status", 2, {"Code": "I_DONT_BELIEVE_YOU", "State": "RUNNING"})
    >>> messages.decode(status.identifier, status.data).values["Code"]
    'I_DONT_BELIEVE_YOU'
    """

    def __init__(self, database: Database) -> None:
        self._messages = {
            kind: database.get_message_by_name(_name_in_dbc(kind, 1 if kind != Kind.HOLD else 0)) for kind in Kind
        }
        self._sequences: dict[int, int] = {}

    @classmethod
    def load(cls, path: str | Path | None = None) -> MessageSet:
        """Return the message set of the package, once a DBC of the user's is found to agree with it.

        Parameters
        ----------
        path
            The user's DBC; it may hold other messages under other identifiers. None: there is none to compare.

        Returns
        -------
        MessageSet
            With sequence counters that begin at 1.

        Raises
        ------
        FileFormatError
            The file is not there, too large, no DBC, or says something else of our messages: the first difference.

        Examples
        --------
        >>> MessageSet.load("/nowhere/z.dbc")
        Traceback (most recent call last):
        rtec.errors.FileFormatError: /nowhere/z.dbc: there is no such file; use the path of a DBC file
        """
        ours = _packaged()
        if path is not None:
            theirs = _parsed(path, read_any_text(path, "a DBC file", most_bytes=MOST_BYTES)[0])
            for problem, allowed in _differences(ours, theirs):
                raise FileFormatError(path, None, problem, f"{allowed}, as in the {PACKAGED} of the package")
        return cls(ours)

    def decode(self, identifier: int, data: bytes) -> Message | None:
        """Decode a standard frame; None if the identifier is not one of ours.

        Parameters
        ----------
        identifier
            Of 11 bits; a frame with an identifier of 29 bits is none of ours, whatever its number.
        data
            Its bytes. Errors in them appear in the verdict, not as an exception.

        Returns
        -------
        Message or None
            Name, axis, fields and verdict.
        """
        axis = identifier & _frame_kernels.AXIS_BITS
        try:
            kind = Kind(identifier - axis)
        except ValueError:
            return None
        if (axis == 0) != (kind == Kind.HOLD):
            return None
        if len(data) != PAYLOAD_BYTES:
            return Message(name=NAMES[kind], axis=axis, values={}, verdict=Verdict.WRONG_LENGTH)
        fields = self._messages[kind].decode_simple(bytes(data), decode_choices=True, scaling=False)
        values = {name: int(value) if isinstance(value, int) else str(value) for name, value in fields.items()}
        payload = int.from_bytes(data, "little", signed=True)
        verdict = Verdict.RIGHT
        if int(sealed(identifier, payload)) != payload:
            verdict = Verdict.WRONG_CHECKSUM
        elif kind == Kind.REQUEST and data[4:6] != bytes(0xFF ^ byte for byte in data[2:4]):
            verdict = Verdict.CONTRADICTORY
        if kind == Kind.HOLD:
            axis = data[3]
        return Message(name=NAMES[kind], axis=axis, values=values, verdict=verdict)

    def encode(self, name: str, axis: int, values: Mapping[str, int | str]) -> Frame:
        """Return the frame of a message, its checksum filled in.

        Parameters
        ----------
        name
            Of the message, without the axis.
        axis
            1 to 15; of a hold, the axis that is its cause (0: none).
        values
            Numbers or labels by the name of the field. Where they are not given, ``Sequence`` is one more than in the
            last frame under the same identifier, and ``TotalInverted`` follows from ``Total``; other fields are 0.

        Returns
        -------
        Frame
            Identifier and eight bytes.

        Raises
        ------
        ArgumentError
            A name that is not known, or a value beyond its field.

        Examples
        --------
        >>> MessageSet.load().encode("Request", 1, {"Total": 40000})
        Traceback (most recent call last):
        rtec.errors.ArgumentError: Total: 40000 is too large; use -32768 to 32767
        """
        if name not in KINDS:
            raise unknown("message", name, KINDS, noun="message")
        kind = KINDS[name]
        whole_within("axis", axis, 0 if kind == Kind.HOLD else 1, MOST_AXES)
        identifier = int(kind) + (axis if kind != Kind.HOLD else 0)
        signals = {signal.name: signal for signal in self._messages[kind].signals if signal.name != "Crc"}
        numbers = dict.fromkeys(signals, 0)
        numbers["Sequence"] = (self._sequences.get(identifier, 0) + 1) & 0xFF
        for field, value in values.items():
            if field not in signals or (kind == Kind.HOLD and field == "Axis"):
                known = [known for known in signals if kind != Kind.HOLD or known != "Axis"]
                raise unknown("field", field, known, noun=f"field of {name}")
            numbers[field] = _number(signals[field], value)
        if kind == Kind.REQUEST and "TotalInverted" not in values:
            numbers["TotalInverted"] = ~numbers["Total"] & 0xFFFF
        if kind == Kind.HOLD:
            numbers["Axis"] = axis
        self._sequences[identifier] = numbers["Sequence"]
        data = self._messages[kind].encode({"Crc": 0, **numbers}, scaling=False)
        payload = int(sealed(identifier, int.from_bytes(data, "little", signed=True)))
        return Frame.of_payload(identifier, payload)


def _number(signal: Signal, value: int | str) -> int:
    """Return a field's value as a number within its range."""
    if isinstance(value, str):
        labels = {str(label): int(number) for number, label in (signal.choices or {}).items()}
        if value not in labels:
            hint = nearest(value, labels) if labels else ""
            raise ArgumentError(
                signal.name, repr(value)[:60], "one of its labels" if labels else "a whole number", hint
            )
        return labels[value]
    # the field's own width is what limits an encoder; the range in the file is for readers of tables
    span = 1 << signal.length
    low = -span // 2 if signal.is_signed else 0
    return whole_within(signal.name, value, low, low + span - 1)


def _name_in_dbc(kind: Kind, axis: int) -> str:
    return NAMES[kind] if kind == Kind.HOLD else f"{NAMES[kind]}_{axis}"


def _check_claims(path: str | Path, text: str) -> None:
    """Reject sizes that no bus has before the parser allocates memory for them."""
    bare = re.sub(
        r'//.*?\n|"(\\"|[^"])*?"', lambda skipped: " " + "\n" * skipped[0].count("\n"), text, flags=re.DOTALL
    )
    for match in re.finditer(r"(?<=:)\s*[-+]?(\d+)|(?<=\|)\s*[-+]?(\d+)(?=\s*@)", bare):
        size = match[1] or match[2]
        if len(size) > MOST_DIGITS or int(size) > MOST_BITS:
            line = bare.count("\n", 0, match.end()) + 1
            problem = f"{size[:20]} where the size or place of a message or signal stands"
            raise FileFormatError(path, line, problem, f"at most {MOST_BITS}, the bits of a message of CAN FD")


def _parsed(path: str | Path, text: str) -> Database:
    import cantools  # noqa: PLC0415 - 0.4 s
    from cantools.database.can import Database as CanDatabase  # noqa: PLC0415 - cantools, for its users only

    _check_claims(path, text)
    try:
        database = cantools.database.load_string(text, database_format="dbc")
    except Exception as error:  # the parser raises exceptions of many kinds for a malformed file
        reason = " ".join(str(error).split())[:160] or type(error).__name__
        raise FileFormatError(path, None, f"is no DBC that cantools reads: {reason}", "a DBC file") from error
    if not isinstance(database, CanDatabase):
        raise FileFormatError(path, None, "describes no messages", "a DBC file")
    return database


@functools.cache
def _packaged() -> Database:
    return _parsed(PACKAGED, (files("rtec.link") / PACKAGED).read_text(encoding="utf-8"))


def _differences(ours: Database, theirs: Database) -> Iterator[tuple[str, str]]:
    """Yield the differences of a user's DBC from ours, with our values, the lowest identifier first."""
    by_name = {message.name: message for message in theirs.messages}
    by_identifier = {message.frame_id: message for message in theirs.messages if not message.is_extended_frame}
    for kind in Kind:
        for axis in (0,) if kind == Kind.HOLD else range(1, MOST_AXES + 1):
            name, identifier = _name_in_dbc(kind, axis), int(kind) + axis
            other = by_identifier.get(identifier)
            if other is not None and other.name != name:
                yield f"identifier {identifier:#05x} is that of the message {other.name}", f"the message {name}"
            message = by_name.get(name)
            if message is not None:
                template = ours.get_message_by_name(_name_in_dbc(kind, min(axis, 1)))
                yield from _message_differences(template, message, identifier)
            elif axis <= LISTED_AXES and kind not in _NEED_NOT_BE_LISTED:
                yield f"the message {name} is missing", f"{name} with the identifier {identifier:#05x}"


def _message_differences(ours: DbcMessage, theirs: DbcMessage, identifier: int) -> Iterator[tuple[str, str]]:
    name = theirs.name
    if theirs.frame_id != identifier or theirs.is_extended_frame:
        width = 29 if theirs.is_extended_frame else 11
        yield f"{name} has the identifier {theirs.frame_id:#05x} of {width} bits", f"{identifier:#05x} of 11 bits"
    if theirs.length != ours.length:
        yield f"{name} has {theirs.length} bytes", f"{ours.length}"
    found = {signal.name: signal for signal in theirs.signals}
    for signal in ours.signals:
        if signal.name not in found:
            yield f"{name}: the signal {signal.name} is missing", f"{signal.name} at bit {signal.start}"
            continue
        expected, facts = _facts(signal), _facts(found[signal.name])
        for fact, value in expected.items():
            if facts[fact] != value:
                yield f"{name}, signal {signal.name}: {fact} is {facts[fact]}", str(value)
    known = {signal.name for signal in ours.signals}
    for signal in theirs.signals:
        if signal.name not in known:
            yield f"{name}: the signal {signal.name} at bit {signal.start}", f"only {', '.join(sorted(known))}"


def _facts(signal: Signal) -> dict[str, object]:
    """Return what decides how a signal's bits are read."""
    labels = {int(number): str(label)[:60] for number, label in (signal.choices or {}).items()}
    return {
        "start bit": signal.start,
        "length in bits": signal.length,
        "byte order": signal.byte_order,
        "sign": "signed" if signal.is_signed else "unsigned",
        "type": "float" if signal.is_float else "whole number",
        "scale": float(signal.scale),
        "offset": float(signal.offset),
        "unit": signal.unit or "none",
        "multiplexing": "multiplexed" if signal.is_multiplexer or signal.multiplexer_ids else "none",
        **{
            f"label of {number}": labels.get(number, "none")
            for number in range(1 << min(signal.length, PAYLOAD_BYTES))
        },
    }
