"""A transport whose clock stands still while this process is not let run, as that of a live box does."""

from __future__ import annotations

from rtec.link.frame import Frame
from rtec.link.transport import Received, Transport
from rtec.live.box_loop import LONGEST_STALL_PS


class SteadyTransport:
    """The part of a transport that a replay needs, on a clock without the stalls of this process.

    Parameters
    ----------
    transport
        The way to the bus. What is longer than `rtec.live.box_loop.LONGEST_STALL_PS` beyond the time that it was to
        wait, or between two waits, is a stall.
    """

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._returned_ps = transport.now_ps()
        self.stalled_ps = 0
        """Total time of the stalls."""

    def now_ps(self) -> int:
        """Return the time, the stalls left out."""
        return self._transport.now_ps() - self.stalled_ps

    def send(self, frame: Frame) -> None:
        """Send a frame."""
        self._transport.send(frame)

    def receive(self, until_ps: int) -> Received | None:
        """Return the next frame that arrives until ``until_ps``, or None at that time."""
        begin_ps = self._transport.now_ps()
        self._note(begin_ps - self._returned_ps)
        until_ps += self.stalled_ps
        received = self._transport.receive(until_ps)
        self._returned_ps = self._transport.now_ps()
        self._note(self._returned_ps - max(until_ps, begin_ps))
        return None if received is None else Received(frame=received.frame, arrival_ps=self.now_ps())

    def _note(self, late_ps: int) -> None:
        if late_ps > LONGEST_STALL_PS:
            self.stalled_ps += late_ps
