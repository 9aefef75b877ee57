"""The side of a log that is played, speaking to a node of today: what it gives back is what that node has said.

A request carries the session of the box; corrections the sequence of the PC's request and, where the box of the log
had accepted what it was asked for, the total that is asked for now. All else goes as it was recorded, mistakes
included.
"""

from __future__ import annotations

from collections import defaultdict, deque

from rtec.link._crc_kernels import sealed
from rtec.link._frame_kernels import AXIS_BITS
from rtec.link.frame import PAYLOAD_BYTES, Frame
from rtec.link.messages import Kind
from rtec.live.played import kind_of

_SEQUENCE, _SESSION, _JUDGED, _SESSION_OF_BOX = 1, 7, 7, 4
"""Bytes of the frames."""
_TOTAL, _COMPLETED, _ACCEPTED = slice(2, 4), slice(2, 4), slice(4, 6)

_REMEMBERED = 32
"""Requests of an axis that may still be judged."""


class _Heard:
    """What a node has said that the side before it gives back, for each axis."""

    def __init__(self) -> None:
        self.sessions: dict[int, int] = {}
        self.requests: dict[int, deque[tuple[int, int]]] = defaultdict(lambda: deque(maxlen=_REMEMBERED))

    def take(self, frame: Frame) -> None:
        """Take a frame: of a box the session, of a PC what it asks for."""
        axis = frame.identifier & AXIS_BITS
        if _is(frame, Kind.STATUS):
            self.sessions[axis] = frame.data[_SESSION_OF_BOX]
        elif _is(frame, Kind.REQUEST):
            self.requests[axis].append((frame.data[_SEQUENCE], _number(frame.data[_TOTAL])))


class ReplayedSide:
    """The side that is played: a PC to a box of another session, or a box to a PC whose turns come at other moments.

    Examples
    --------
    What a box says before the log is entered is said again and again; what follows is numbered on:

    >>> side = ReplayedSide()
    >>> frame = resealed(Frame(identifier=0x181, data=bytes(8)), {1: 7})
    >>> [side.repeated(frame).data[1] for _ in range(3)], side.translated(frame).data[1]
    ([7, 8, 9], 9)
    """

    def __init__(self) -> None:
        self.logged, self.said = _Heard(), _Heard()
        """What the node of the log says, up to the frame that is sent next, and what the node under test says."""
        self._ahead: dict[int, int] = {}
        """By how much the sequence under an identifier is ahead of the log."""
        self._accepted: dict[int, int] = {}

    def repeated(self, frame: Frame) -> Frame:
        """Return a frame from before the log was entered, to be sent once more; those of the log follow it."""
        self._ahead[frame.identifier] = self._ahead.get(frame.identifier, -1) + 1
        return resealed(frame, {_SEQUENCE: frame.data[_SEQUENCE] + self._ahead[frame.identifier]})

    def translated(self, frame: Frame) -> Frame:
        """Return what is sent in the place of a frame of the log.

        A session that was wrong in the log is wrong by as much now; a box is as many requests behind as in the log,
        and has done as much of what was accepted.
        """
        changes: dict[int, int] = {}
        axis = frame.identifier & AXIS_BITS
        if len(frame.data) == PAYLOAD_BYTES and (ahead := self._ahead.get(frame.identifier, 0)):
            changes[_SEQUENCE] = frame.data[_SEQUENCE] + ahead
        if _is(frame, Kind.REQUEST) and axis in self.logged.sessions and axis in self.said.sessions:
            changes[_SESSION] = frame.data[_SESSION] - self.logged.sessions[axis] + self.said.sessions[axis]
        elif _is(frame, Kind.CORRECTIONS) and self.logged.requests[axis] and self.said.requests[axis]:
            changes |= self._given_back(axis, frame.data)
        return resealed(frame, changes) if changes else frame

    def _given_back(self, axis: int, data: bytes) -> dict[int, int]:
        """Return sequence and totals in terms of what this PC asks for; none for what it was never asked."""
        logged, said = self.logged.requests[axis], self.said.requests[axis]
        behind = (logged[-1][0] - data[_JUDGED]) & 0xFF
        if behind >= len(logged):
            return {}
        requested, now_requested = logged[-1 - behind][1], said[max(-1 - behind, -len(said))]
        accepted, completed = _number(data[_ACCEPTED]), _number(data[_COMPLETED])
        now = now_requested[1] if accepted == requested else self._accepted.get(axis, accepted)
        self._accepted[axis] = now
        words = [*_bytes(now + completed - accepted), *_bytes(now)]
        return {_JUDGED: now_requested[0]} | dict(enumerate(words, start=_COMPLETED.start))


def _is(frame: Frame, kind: Kind) -> bool:
    return kind_of(frame) is kind and len(frame.data) == PAYLOAD_BYTES


def _number(data: bytes) -> int:
    return int.from_bytes(data, "little", signed=True)


def _bytes(number: int) -> bytes:
    return (number & 0xFFFF).to_bytes(2, "little")


def resealed(frame: Frame, changes: dict[int, int]) -> Frame:
    """Return a frame with other bytes at some places; a checksum that was wrong is as wrong as before.

    Examples
    --------
    >>> from rtec.link.messages import MessageSet
    >>> messages = MessageSet.load()
    >>> frame = resealed(messages.encode("Request", 1, {"Total": 3, "Session": 9}), {7: 40})
    >>> frame == messages.encode("Request", 1, {"Total": 3, "Session": 40, "Sequence": 1})
    True
    """
    if len(frame.data) != PAYLOAD_BYTES or frame.extended:
        return frame

    def right(data: bytes) -> int:
        return int(sealed(frame.identifier, int.from_bytes(data, "little", signed=True))) & 0xFF

    data = bytearray(frame.data)
    wrong_by = data[0] ^ right(bytes(data))
    for place, value in changes.items():
        data[place] = value & 0xFF
    data[0] = right(bytes(data)) ^ wrong_by
    return Frame(identifier=frame.identifier, data=bytes(data))
