"""A log of box and PC from one side: what of it is played, and what the node under test is held to.

The side that is played sends under its own identifiers only, never for the node under test;
`rtec.live.replayed_side` is how it speaks.
"""

from __future__ import annotations

import enum
import statistics
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path

from rtec.errors import FileFormatError
from rtec.link._frame_kernels import AXIS_BITS, GO_HOME
from rtec.link.frame import PAYLOAD_BYTES, Frame
from rtec.link.logs import read_log
from rtec.link.messages import Kind

_BEFORE = (Kind.STATUS, Kind.CORRECTIONS, Kind.POSITION, Kind.SETUP)
"""What a box says that waits for a PC."""

_KINDS = frozenset(Kind)
_OF_PC = frozenset({Kind.HOLD, Kind.EXPECTED, Kind.REQUEST})
_OF_BOX = _KINDS - _OF_PC

CYCLE_PS = 10 * 10**9
"""Of box and PC where nothing else is said."""

_CYCLES_ALONE = 20

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
        return _OF_PC if self is Role.PC else _OF_BOX

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
    if frame.extended or base not in _KINDS or (axis == 0) != (base == Kind.HOLD):
        return None
    return Kind(base)


@dataclass(slots=True, kw_only=True)
class Survey:
    """What a log holds."""

    role: Role
    """Whose frames are to be played."""
    played: int = 0
    compared: int = 0
    others: int = 0
    """Frames of that side, of the node under test, and of other senders."""
    entry_ps: int = -1
    end_ps: int = 0
    """The PC's first frame, at which playing begins, and the end: the last frame, or twenty cycles after the PC's
    last, since a box that is alone has nothing to answer."""
    last_pc_ps: int = 0
    """The PC's last frame."""
    first_axis: int = 0
    """The axis of that frame."""
    axes: set[int] = field(default_factory=set)
    """Those that the log's PC speaks to."""
    kinds: set[Kind] = field(default_factory=set)
    """Messages of the node under test."""
    before: dict[int, Frame] = field(default_factory=dict)
    """What a box says last before the PC's first frame, by identifier; where it says nothing before, its first."""
    cycle_ps: int = 0
    """Usual time between two statuses, or two requests, of an axis."""
    homes: bool = False
    """Whether the PC takes an axis home in it."""
    cut_off: str | None = None
    """What is wrong with the end of the file; None: it is whole."""


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
    found.end_ps = min(found.end_ps, found.last_pc_ps + _CYCLES_ALONE * max(found.cycle_ps, CYCLE_PS))
    return found


def _note(found: Survey, frame: Frame, at_ps: int) -> None:
    kind = kind_of(frame)
    axis = frame.identifier & AXIS_BITS
    if kind is None:
        found.others += 1
        return
    found.end_ps = max(found.end_ps, at_ps)
    if kind in Role.PC.kinds:
        found.last_pc_ps = max(found.last_pc_ps, at_ps)
    if kind is Kind.REQUEST:
        found.axes.add(axis)
        found.homes = found.homes or (len(frame.data) == PAYLOAD_BYTES and bool(frame.data[6] & GO_HOME))
    if kind in Role.PC.kinds and found.entry_ps < 0:
        found.entry_ps = at_ps
    if kind is Kind.REQUEST and not found.first_axis:
        found.first_axis = axis
    if kind in _BEFORE and (found.entry_ps < 0 or frame.identifier not in found.before):
        found.before[frame.identifier] = frame
    if kind in found.role.kinds:
        found.played += 1
        return
    found.compared += 1
    found.kinds.add(kind)
