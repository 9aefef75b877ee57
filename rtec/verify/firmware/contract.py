"""What the box owes to its surroundings, in numbers, and how a point of it fails."""

from __future__ import annotations

NOT_HOMED, PROBING, DISABLED, DOUBT, FATAL, OK = 1, 2, 3, 4, 5, 0
"""Message codes (docs/firmware.md, "Message codes")."""

MESSAGES = {
    OK: "OK",
    NOT_HOMED: "NOT_HOMED",
    PROBING: "PROBING",
    DISABLED: "DISABLED",
    DOUBT: "I Don't Believe You",
    FATAL: "I Still Don't Believe You",
}

NOT_VALID = 0x02
"""Bit of port 3: inverted, Data Valid."""

DECODER_RST, HOLD = 0x40, 0x80


class Failed(Exception):  # noqa: N818 - it is no error of this program
    """A point of the contract does not hold.

    Parameters
    ----------
    detail
        What was seen.
    time_ps
        When.
    """

    def __init__(self, detail: str, time_ps: int) -> None:
        super().__init__(detail)
        self.detail, self.time_ps = detail, time_ps


class Stopped(Failed):
    """The processor has stopped, or does nothing but change its pins."""


class Paused(Exception):  # noqa: N818 - as above
    """A replay has come to the time where it was to end."""
