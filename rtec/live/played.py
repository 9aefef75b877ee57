"""A log of box and PC from one side: what of it is played, and what the node under test is held to.

Whoever is played speaks under its own identifiers only, so that nobody speaks for the node under test. What it has to
give back of what that node has said is not that of the log any more: a request carries the session of the box, and
corrections the sequence of the PC's request. These are put in; all else goes as recorded, mistakes included.
"""

from __future__ import annotations

import enum
import statistics
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path

from rtec.errors import FileFormatError
from rtec.link._crc_kernels import seal
from rtec.link._frame_kernels import AXIS_BITS, GO_HOME
from rtec.link.frame import PAYLOAD_BYTES, Frame, IdentifierFormat
from rtec.link.logs import read_log
from rtec.link.messages import Kind

_SEQUENCE, _SESSION, _JUDGED = 1, 7, 7
"""Bytes of the frames."""

_BEFORE = (Kind.STATUS, Kind.CORRECTIONS, Kind.POSITION, Kind.SETUP)
"""What a box says that waits for a PC."""


_INTERVALS = 10_000
"""Looked at for the cycle."""


class Role(enum.Enum):
    """Whose frames of a log are played."""

    PC = "pc"
    BOX = "box"

    @property
    def kinds(self) -> frozenset[Kind]:
        """Return the messages that it sends.

        Examples
        --------
        >>> sorted(kind.name for kind in Role.PC.kinds)
        ['EXPECTED', 'HOLD', 'REQUEST']
        """
        of_pc = frozenset({Kind.HOLD, Kind.EXPECTED, Kind.REQUEST})
        return of_pc if self is Role.PC else frozenset(Kind) - of_pc

    @property
    def words(self) -> str:
        """Return what it is called."""
        return "PC" if self is Role.PC else "box"

    @property
    def other(self) -> Role:
        """Return the node under test."""
        return Role.BOX if self is Role.PC else Role.PC


def kind_of(frame: Frame) -> Kind | None:
    """Return which of our messages a frame is, by its identifier; None for a frame of others.

    Examples
    --------
    >>> kind_of(Frame(identifier=0x203, data=bytes(8))), kind_of(Frame(identifier=0x7DF, data=b""))
    (<Kind.REQUEST: 512>, None)
    """
    axis = frame.identifier & AXIS_BITS
    base = frame.identifier - axis
    if (
        frame.identifier_format is not IdentifierFormat.BASE
        or base not in set(Kind)
        or (axis == 0) != (base == Kind.HOLD)
    ):
        return None
    return Kind(base)


@dataclass(slots=True, kw_only=True)
class Survey:
    """What a log holds.

    Parameters
    ----------
    role
        Whose frames are to be played.
    played, compared, others
        Frames of that side, of the node under test, and of nobody of ours.
    entry_ps, end_ps
        The PC's first frame, at which playing begins, and the last frame.
    first_axis
        The axis of that frame.
    axes
        Those that the log's PC speaks to.
    kinds
        Messages of the node under test.
    before
        What a box says last before the PC's first frame, by identifier; where it says nothing before, its first.
    cycle_ps
        Usual time between two statuses, or two requests, of an axis.
    homes
        Whether the PC takes an axis home in it.
    cut_off
        What is wrong with the end of the file; None: it is whole.
    """

    role: Role
    played: int = 0
    compared: int = 0
    others: int = 0
    entry_ps: int = -1
    end_ps: int = 0
    first_axis: int = 0
    axes: set[int] = field(default_factory=set)
    kinds: set[Kind] = field(default_factory=set)
    before: dict[int, Frame] = field(default_factory=dict)
    cycle_ps: int = 0
    homes: bool = False
    cut_off: str | None = None


def survey(path: Path, role: Role) -> Survey:
    """Read a log once, to know what there is to play.

    Raises
    ------
    FileFormatError
        It cannot be read, or holds no frame of one of the two sides. One that is cut off is taken as far as it goes.
    """
    found = Survey(role=role)
    last_ps: dict[int, int] = {}
    intervals: deque[int] = deque(maxlen=_INTERVALS)
    try:
        for logged in read_log(path):
            _note(found, logged.frame, logged.time_ps)
            if kind_of(logged.frame) in (Kind.STATUS, Kind.REQUEST):
                identifier = logged.frame.identifier
                intervals.append(logged.time_ps - last_ps.get(identifier, logged.time_ps))
                last_ps[identifier] = logged.time_ps
    except FileFormatError as error:
        if not found.played or not found.compared:
            raise
        found.cut_off = str(error)
    for number, side in ((found.played, role), (found.compared, role.other)):
        if number == 0:
            raise FileFormatError(
                path, None, f"it holds no frame of a {side.words}", "a log with the frames of box and PC"
            )
    found.cycle_ps = round(statistics.median(intervals or [0]))
    return found


def _note(found: Survey, frame: Frame, at_ps: int) -> None:
    kind = kind_of(frame)
    axis = frame.identifier & AXIS_BITS
    if kind is None:
        found.others += 1
        return
    found.end_ps = max(found.end_ps, at_ps)
    if kind is Kind.REQUEST:
        found.axes.add(axis)
        found.homes = found.homes or (len(frame.data) == PAYLOAD_BYTES and bool(frame.data[6] & GO_HOME))
    if kind in Role.PC.kinds and found.entry_ps < 0:
        found.entry_ps = at_ps
    if kind is Kind.REQUEST and not found.first_axis:
        found.first_axis = axis
    if kind in found.role.kinds:
        found.played += 1
        if kind in _BEFORE and (found.entry_ps < 0 or frame.identifier not in found.before):
            found.before[frame.identifier] = frame
        return
    found.compared += 1
    found.kinds.add(kind)


def resealed(frame: Frame, place: int, value: int) -> Frame:
    """Return a frame with another byte at a place; a checksum that was wrong is as wrong as before.

    Examples
    --------
    >>> from rtec.link.messages import MessageSet
    >>> messages = MessageSet.load()
    >>> frame = resealed(messages.encode("Request", 1, {"Total": 3, "Session": 9}), 7, 40)
    >>> frame == messages.encode("Request", 1, {"Total": 3, "Session": 40, "Sequence": 1})
    True
    """
    if len(frame.data) != PAYLOAD_BYTES or frame.identifier_format is not IdentifierFormat.BASE:
        return frame

    def right(data: bytes) -> int:
        return int(seal(frame.identifier, int.from_bytes(data, "little", signed=True))) & 0xFF

    data = bytearray(frame.data)
    wrong_by = data[0] ^ right(bytes(data))
    data[place] = value & 0xFF
    data[0] = right(bytes(data)) ^ wrong_by
    return Frame(identifier=frame.identifier, data=bytes(data))


class Translator:
    """What is put into played frames in the place of what the node of the log had said.

    Parameters
    ----------
    role
        Whose frames are played.
    """

    def __init__(self, role: Role) -> None:
        self._role = role
        self._logged: dict[int, int] = {}
        self._said: dict[int, int] = {}
        self._totals: dict[int, deque[int]] = {}
        self._accepted: dict[int, int] = {}
        self.ahead: dict[int, int] = {}
        """By identifier: frames that were sent before the log was entered, by which sequences go on."""

    def log_says(self, frame: Frame) -> None:
        """Take what the node of the log says."""
        self._take(frame, self._logged)

    def node_says(self, frame: Frame) -> None:
        """Take what the node under test says."""
        self._take(frame, self._said)
        if kind_of(frame) is Kind.REQUEST and len(frame.data) == PAYLOAD_BYTES:
            totals = self._totals.setdefault(frame.identifier & AXIS_BITS, deque([0], maxlen=2))
            total = int.from_bytes(frame.data[2:4], "little", signed=True)
            if total != totals[-1]:
                totals.append(total)

    def _take(self, frame: Frame, into: dict[int, int]) -> None:
        """Keep what the other side gives back: the session of a box, the sequence of a PC's request."""
        if len(frame.data) == PAYLOAD_BYTES:
            axis = frame.identifier & AXIS_BITS
            if self._role is Role.PC and kind_of(frame) is Kind.STATUS:
                into[axis] = frame.data[4]
            elif self._role is Role.BOX and kind_of(frame) is Kind.REQUEST:
                into[axis] = frame.data[1]

    def may_send(self, frame: Frame) -> bool:
        """Return whether a frame may go: no box accepts a total before the PC has asked for it."""
        axis = frame.identifier & AXIS_BITS
        if kind_of(frame) is not Kind.CORRECTIONS or len(frame.data) != PAYLOAD_BYTES:
            return True
        accepted = int.from_bytes(frame.data[4:6], "little", signed=True)
        return accepted == self._accepted.get(axis, 0) or accepted in self._totals.get(axis, ())

    def translated(self, frame: Frame) -> Frame:
        """Return what is sent in the place of a frame of the log."""
        if len(frame.data) != PAYLOAD_BYTES:
            return frame
        axis, kind = frame.identifier & AXIS_BITS, kind_of(frame)
        known = axis in self._logged and axis in self._said
        if kind is Kind.REQUEST and known:
            # a session that was wrong in the log is wrong by as much now
            return resealed(frame, _SESSION, frame.data[_SESSION] - self._logged[axis] + self._said[axis])
        if ahead := self.ahead.get(frame.identifier, 0):
            frame = resealed(frame, _SEQUENCE, frame.data[_SEQUENCE] + ahead)
        if kind is Kind.CORRECTIONS:
            self._accepted[axis] = int.from_bytes(frame.data[4:6], "little", signed=True)
            if known:
                return resealed(frame, _JUDGED, frame.data[_JUDGED] - self._logged[axis] + self._said[axis])
        return frame

    def repeated(self, frame: Frame) -> Frame:
        """Return a frame from before the log was entered, to be sent once more; those of the log follow it."""
        ahead = self.ahead[frame.identifier] = self.ahead.get(frame.identifier, -1) + 1
        return resealed(frame, _SEQUENCE, frame.data[_SEQUENCE] + ahead)
