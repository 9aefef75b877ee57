"""A log played into a bus at its own times."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Protocol

from rtec.checks import number_within
from rtec.link._log_formats import Logged
from rtec.link.frame import Frame
from rtec.link.transport import Received


class Way(Protocol):
    """The part of a transport that is needed here."""

    def now_ps(self) -> int:
        """Return the time on the clock of the bus."""

    def send(self, frame: Frame) -> None:
        """Send a frame."""

    def receive(self, until_ps: int) -> Received | None:
        """Return the next frame that arrives until then, or None."""


SLOWEST, FASTEST = 1e-3, 1e6


def replay(
    log: Iterable[Logged],
    transport: Way,
    *,
    speed: float = 1.0,
    on_received: Callable[[Received], None] | None = None,
    as_sent: Callable[[Logged], Frame] = lambda logged: logged.frame,
) -> int:
    """Send the frames of a log at their times, on the clock of the transport, and return how many were sent.

    Frames of one identifier never follow each other in less than half the time that they have in the log: a program
    that was not let run for a while does not send all overdue frames at once.

    Parameters
    ----------
    log
        What `rtec.link.logs.read_log` yields.
    transport
        Where to; on a simulated one this takes simulated time.
    speed
        2 sends twice as fast.
    on_received
        Called with each frame that arrives meanwhile.
    as_sent
        What goes in the place of a frame, asked when it goes.

    Raises
    ------
    FileFormatError, LinkError
        As `rtec.link.logs.read_log` and the transport.
    ArgumentError
        A speed outside its range.

    Examples
    --------
    >>> from rtec.link.logs import Direction
    >>> from rtec.link.simulated import SimulatedBus
    >>> bus = SimulatedBus()
    >>> log = [Logged(frame=Frame(identifier=0x120 + k, data=b""), time_ps=k * 10**9, direction=Direction.SENT)
    ...        for k in range(3)]
    >>> pc, box = bus.transport(0), bus.transport(1)
    >>> replay(log, pc, speed=2.0), pc.now_ps() // 10**9
    (3, 1)
    """
    number_within("speed", speed, SLOWEST, FASTEST)
    begin_ps = transport.now_ps()
    before: dict[int, tuple[int, int]] = {}  # by identifier: when in the log, and when it was sent
    sent = 0

    def hear(until_ps: int) -> bool:
        """Take the next frame that arrives until then; return whether there was one."""
        received = transport.receive(until_ps)
        if received is not None and on_received is not None:
            on_received(received)
        return received is not None

    for logged in log:
        due_ps = begin_ps + round(logged.time_ps / speed)
        if (last := before.get(logged.frame.identifier)) is not None:
            due_ps = max(due_ps, last[1] + round((logged.time_ps - last[0]) / (2 * speed)))
        # a bus that babbles never falls silent
        while hear(due_ps) and transport.now_ps() < due_ps:
            pass
        before[logged.frame.identifier] = logged.time_ps, transport.now_ps()
        transport.send(as_sent(logged))
        sent += 1
    return sent
