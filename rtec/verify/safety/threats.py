"""Which faults of the program are which threats to messages in EN 50159, and which defence meets each threat."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from types import MappingProxyType

from rtec.machine.fault_kinds import FaultKind, FaultRow


class Threat(enum.Enum):
    """The seven threats to messages on a channel; a member is its word and the defences here.

    Defences have the names of the standard: sequence number, time-out, source identifier, feedback message, safety
    code. None of them is cryptographic: the bus is closed, and all of its nodes are known (category 1).

    References
    ----------
    EN 50159, the matrix of threats and defences.

    Examples
    --------
    >>> Threat("delay").defence
    'sequence number, time-out: an older frame is refused; silence ends in a safe stop by the watchdog'
    """

    defence: str
    """What meets it."""

    def __new__(cls, word: str, defence: str) -> Threat:
        """Make a member of its row."""
        threat = object.__new__(cls)
        threat._value_ = word
        threat.defence = defence
        return threat

    REPETITION = (
        "repetition",
        "sequence number: a frame with the last number is refused; a total is for good, so asking twice adds nothing",
    )
    DELETION = (
        "deletion",
        "sequence number, time-out: up to five lost frames are bridged, silence ends in a safe stop by the watchdog",
    )
    INSERTION = (
        "insertion",
        "source identifier, sequence number: foreign identifiers are ignored, one's own from elsewhere is fatal; a "
        "flooded bus ends as silence does",
    )
    RESEQUENCING = (
        "resequencing",
        "sequence number, time-out: an older frame that comes late is refused; the PC stops for a late answer",
    )
    CORRUPTION = (
        "corruption",
        "safety code: CRC-8 over identifier and data; the total is sent twice, once inverted",
    )
    DELAY = (
        "delay",
        "sequence number, time-out: an older frame is refused; silence ends in a safe stop by the watchdog",
    )
    MASQUERADE = (
        "masquerade",
        "feedback message: the PC compares what the box completed with what it asked for; the box's window and limit "
        "bound what one frame can do",
    )


_K, _T = FaultKind, Threat
THREATS: Mapping[FaultRow, Threat] = MappingProxyType({
    _K.FRAME_LOST: _T.DELETION,
    _K.FRAME_LATE: _T.DELAY,
    _K.FRAME_DUPLICATED: _T.REPETITION,
    _K.FRAMES_REORDERED: _T.RESEQUENCING,
    _K.FRAME_CORRUPTED: _T.CORRUPTION,
    _K.FRAME_MASQUERADE: _T.MASQUERADE,
    _K.TOTAL_BIT_FLIPPED: _T.CORRUPTION,
    _K.REQUEST_STUCK: _T.REPETITION,
    _K.BABBLING_NODE: _T.INSERTION,
    _K.BUS_OFF: _T.DELETION,
})  # fmt: skip
"""Of the faults of messages; the others happen to programs, power, clocks and lines."""
