"""What the box says of itself."""

from __future__ import annotations

import enum

from rtec.requester import _box_kernels


class Status(enum.IntEnum):
    """What the box's status word says."""

    OK = _box_kernels.OK
    NOT_HOMED = _box_kernels.STATUS_NOT_HOMED
    PROBING = _box_kernels.STATUS_PROBING
    DISABLED = _box_kernels.STATUS_DISABLED
    I_DONT_BELIEVE_YOU = _box_kernels.I_DONT_BELIEVE_YOU
    I_STILL_DONT_BELIEVE_YOU = _box_kernels.I_STILL_DONT_BELIEVE_YOU
    REFUSED_TOO_FAST = _box_kernels.REFUSED_TOO_FAST
    """The speed gate refuses: the axis is too fast for what is still to be inserted."""
    LINK_LOST = _box_kernels.LINK_LOST
    """Nothing was heard from the PC for longer than the watchdog timeout; fatal."""
    HELD = _box_kernels.HELD
    """The PC holds the machine; fatal."""
    AXIS_TAKEN = _box_kernels.AXIS_TAKEN
    """Another box has the same axis number; fatal."""
    IMPLAUSIBLE = _box_kernels.IMPLAUSIBLE
    """A total beyond the box's limit was asked for; fatal."""
    ENCODER_FAULT = _box_kernels.ENCODER_FAULT
    """Both lines of the encoder changed at once; fatal."""
    SETUP_DIFFERS = _box_kernels.SETUP_DIFFERS
    """The PC expects another design, step or cycle; it cannot take the axis home. Fatal where it has done so."""
    DRIVE_STOPPED = _box_kernels.DRIVE_STOPPED
    """The controller has stopped the drive; fatal."""


class BoxState(enum.IntEnum):
    """What the box is doing."""

    NOT_HOMED = _box_kernels.NOT_HOMED
    RUNNING = _box_kernels.RUNNING
    FATAL = _box_kernels.FATAL
    """It has stopped for good, and its hold contact is open."""
