"""One classic CAN data frame, and its form in compiled code: an identifier and a whole number of 64 bits."""

from __future__ import annotations

from dataclasses import dataclass

from rtec.checks import whole_within
from rtec.errors import ArgumentError

PAYLOAD_BYTES = 8
"""Bytes of a whole frame; the messages of rtec fill it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """A classic data frame (ISO 11898-1); remote and error frames are none.

    Raises
    ------
    ArgumentError
        An identifier that its format does not hold, or too many bytes.

    Examples
    --------
    >>> frame = Frame(identifier=0x123, data=bytes([1, 0, 0, 0, 0, 0, 0, 0]))
    >>> frame.payload
    1
    >>> Frame.of_payload(0x123, frame.payload) == frame
    True
    """

    identifier: int
    """0 to 0x7FF, in the extended format to 0x1FFFFFFF; the lowest wins the bus."""
    data: bytes
    """Up to 8 bytes."""
    extended: bool = False
    """Whether the identifier is of 29 bits (ISO 11898-1: extended format) rather than of 11 (base format)."""

    def __post_init__(self) -> None:
        limit = (1 << (29 if self.extended else 11)) - 1
        if type(self.identifier) is not int or not 0 <= self.identifier <= limit:
            whole_within("identifier", self.identifier, 0, limit)
        if not isinstance(self.data, bytes):
            raise ArgumentError("data", repr(self.data)[:60], "bytes")
        if len(self.data) > PAYLOAD_BYTES:
            raise ArgumentError("data", f"{len(self.data)} bytes", f"up to {PAYLOAD_BYTES} bytes (no CAN FD)")

    @property
    def payload(self) -> int:
        """Return the 8 bytes as a signed number, the first byte lowest.

        Raises
        ------
        ArgumentError
            The frame is shorter than 8 bytes: its length would be lost.
        """
        if len(self.data) != PAYLOAD_BYTES:
            raise ArgumentError("data", f"{len(self.data)} bytes", f"{PAYLOAD_BYTES} bytes for a payload")
        return int.from_bytes(self.data, "little", signed=True)

    @classmethod
    def of_payload(cls, identifier: int, payload: int) -> Frame:
        """Make the frame of 8 bytes that compiled code knows as a signed number.

        Raises
        ------
        ArgumentError
            A number that 64 bits do not hold, or an identifier outside its range.
        """
        number = whole_within("payload", payload, -(1 << 63), (1 << 63) - 1)
        data = number.to_bytes(PAYLOAD_BYTES, "little", signed=True)
        return cls(identifier=int(identifier), data=data)
