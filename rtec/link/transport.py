"""Interface of every transport: send a frame, wait for the next one, report the state of the bus."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Protocol, Self

from rtec.link.frame import Frame


class BusState(enum.Enum):
    """State of the bus, as far as the transport knows it."""

    ACTIVE = "active"
    WARNING = "warning"
    """Errors are counted on the bus, or the last frame found no room to be sent."""
    OFF = "off"
    """The controller has left the bus after too many errors (ISO 11898-1, bus off); it may come back."""
    GONE = "gone"
    """The interface has vanished or was closed; every call fails from here on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Received:
    """A frame that has arrived."""

    frame: Frame
    """The frame."""
    arrival_ps: int
    """When it arrived, on the clock of the transport."""


@dataclass(slots=True, kw_only=True)
class Traffic:
    """What a transport has counted since it was opened."""

    sent: int = 0
    received: int = 0
    """Classic data frames."""
    unsent: int = 0
    """Frames dropped because the way to the bus was full."""
    remote: int = 0
    error: int = 0
    foreign: int = 0
    """Frames that were passed over: remote frames, error frames, CAN FD frames."""
    garbled: int = 0
    """Pieces of input that were no frame."""


class Transport(Protocol):
    """A way to one bus, with a clock of its own in picoseconds that never goes back.

    Open it, ``send`` and ``receive`` in any order, ``close`` it, or use it in a ``with`` block. A transport never
    hands its own frames back, keeps the order of each sender, and never waits long for room to send: a frame
    that finds none is dropped, counted in ``traffic.unsent``, and ``state`` is `BusState.WARNING` until one goes out
    again.
    A bus that vanishes raises `rtec.errors.LinkError` in the call that notices it and in every later one.
    """

    @property
    def state(self) -> BusState:
        """Return the state of the bus."""

    @property
    def traffic(self) -> Traffic:
        """Return what has been counted."""

    def now_ps(self) -> int:
        """Return the time on the transport's clock."""

    def send(self, frame: Frame) -> None:
        """Send a frame.

        Raises
        ------
        LinkError
            The bus has vanished, or the transport is closed.
        """

    def receive(self, until_ps: int) -> Received | None:
        """Return the next frame that arrives until ``until_ps``, or None at that time.

        With a time that has passed, what has arrived is returned without waiting.

        Raises
        ------
        LinkError
            The bus has vanished, or the transport is closed; also when it is closed by another thread meanwhile.
        """

    def close(self) -> None:
        """Leave the bus; closing twice does nothing."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...
