"""Why a running box does not take a frame for a sign of life of its PC."""

from __future__ import annotations

from rtec._jit import Record
from rtec.link import _frame_kernels as layout
from rtec.link.frame import PAYLOAD_BYTES, Frame

TAKEN = ""

_WORDS = {
    "wrong_checksum": "checksum wrong",
    "repeated": "sequence counter repeated",
    "disordered": "sequence counter out of order",
    "jumped": "sequence counter jumped",
    "wrong_session": "another session",
    "wrong_requester": "another requester",
    "contradictory": "total and inverted total disagree",
    "foreign": "unknown message",
}


def refusals(node: Record) -> tuple[int, ...]:
    """Return how many frames a box has refused, by reason."""
    return tuple(int(getattr(node, name)) for name in _WORDS)


def why_refused(frame: Frame, axis: int, before: tuple[int, ...], after: tuple[int, ...]) -> str | None:
    """Return why a frame did not reset the watchdog; `TAKEN` where it did, None for frames that are not meant to.

    Parameters
    ----------
    frame, axis
        What the box of that axis received.
    before, after
        Its `refusals` before and after it.

    Examples
    --------
    >>> none = (0,) * 8
    >>> why_refused(Frame(identifier=0x203, data=bytes(8)), 1, none, none)
    'for axis 3'
    >>> why_refused(Frame(identifier=0x182, data=bytes(8)), 1, none, none) is None
    True
    """
    kind = frame.identifier & ~layout.AXIS_BITS
    if frame.extended:
        return "29-bit identifier"
    if frame.identifier != layout.HOLD and kind not in layout.KINDS_OF_AXIS:
        return _WORDS["foreign"]
    if kind != layout.REQUEST or frame.identifier & layout.AXIS_BITS == axis:
        return _why_of_own(frame, axis, before, after)
    return f"for axis {frame.identifier & layout.AXIS_BITS}"


def _why_of_own(frame: Frame, axis: int, before: tuple[int, ...], after: tuple[int, ...]) -> str | None:
    """Return why, of a frame that is not a request for another axis."""
    for words, earlier, later in zip(_WORDS.values(), before, after, strict=True):
        if later > earlier:
            return words
    if frame.identifier != layout.REQUEST + axis:
        return None
    if len(frame.data) != PAYLOAD_BYTES:
        return f"{len(frame.data)} bytes instead of {PAYLOAD_BYTES}"
    flags = layout.field(frame.payload, *layout.REQUEST_FLAGS)
    if flags & layout.GO_HOME:
        return "GoHome is set"
    return TAKEN if flags & layout.ENABLE else "Enable is not set"
