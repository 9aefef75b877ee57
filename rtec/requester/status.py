"""What the box says of itself."""

from __future__ import annotations

import enum
from typing import Self

from rtec.requester import _box_kernels


class Code(enum.IntEnum):
    """A number of a message, with what it means to the operator."""

    meaning: str

    def __new__(cls, number: int, meaning: str = "") -> Self:
        """Make a member of its number and its meaning."""
        code = int.__new__(cls, number)
        code._value_, code.meaning = number, meaning
        return code


class Status(Code):
    """What the box's status word says.

    Those from `LINK_LOST` on are fatal. `SETUP_DIFFERS`, another design, step or cycle, is so only where the PC has
    taken the axis home; else it keeps the PC from that.
    """

    OK = _box_kernels.OK, "corrections follow the PC's requests"
    NOT_HOMED = _box_kernels.STATUS_NOT_HOMED, "not homed: at home it waits for a PC"
    PROBING = _box_kernels.STATUS_PROBING, "probing: nothing is corrected"
    DISABLED = _box_kernels.STATUS_DISABLED, "the switch forbids corrections, and the PC asks for some"
    I_DONT_BELIEVE_YOU = (
        _box_kernels.I_DONT_BELIEVE_YOU,
        "I Don't Believe You: the request changed by more than the window",
    )
    I_STILL_DONT_BELIEVE_YOU = (
        _box_kernels.I_STILL_DONT_BELIEVE_YOU,
        "I Still Don't Believe You: three requests in a row beyond the window",
    )
    REFUSED_TOO_FAST = _box_kernels.REFUSED_TOO_FAST, "the axis is too fast to insert; what is asked for waits"
    LINK_LOST = _box_kernels.LINK_LOST, "no valid request from the PC for longer than the watchdog timeout"
    HELD = _box_kernels.HELD, "a PC on the bus holds the machine"
    AXIS_TAKEN = _box_kernels.AXIS_TAKEN, "another box on the bus has this axis' number"
    IMPLAUSIBLE = _box_kernels.IMPLAUSIBLE, "the PC asked for a total beyond the limit"
    ENCODER_FAULT = _box_kernels.ENCODER_FAULT, "both encoder lines changed at once: look at the cable"
    SETUP_DIFFERS = _box_kernels.SETUP_DIFFERS, "the PC on the bus is set up for another machine"
    DRIVE_STOPPED = _box_kernels.DRIVE_STOPPED, "the controller stopped the drive, and the PC is told"


class BoxState(enum.IntEnum):
    """What the box is doing."""

    NOT_HOMED = _box_kernels.NOT_HOMED
    RUNNING = _box_kernels.RUNNING
    FATAL = _box_kernels.FATAL
    """It has stopped for good, and its hold contact is open."""
