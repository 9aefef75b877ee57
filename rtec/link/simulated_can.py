"""A python-can bus in simulated time, so that a PC program written for python-can runs unchanged, and at once.

Whatever waits on it moves the simulated clock: ``recv``, iteration, and the ``sleep`` of its `SimulatedClock`. What
needs a thread or the real time does not work here and says so: ``can.Notifier`` and ``send_periodic``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import can

from rtec.checks import number_within
from rtec.errors import ArgumentError, LinkError
from rtec.link.frame import Frame
from rtec.link.simulated import SimulatedBus
from rtec.link.transport import BusState
from rtec.units import PS_PER_S

P = ParamSpec("P")
T = TypeVar("T")

LONGEST_WAIT_S = 3600.0
"""Simulated time after which a ``recv`` without a timeout gives up: no node sends any more."""


class TimeIsUp(BaseException):
    """Ends a program that was given a time to run; no ``except Exception`` of the program stops it."""


class SimulatedClock:
    """The time of a simulated bus, by the names that programs know from the module ``time``.

    Put it in the place of that module in the program under test: ``monkeypatch.setattr(my_pc, "time", bus.clock)``.

    Examples
    --------
    >>> clock = SimulatedClock(SimulatedBus())
    >>> clock.sleep(1.5)
    >>> clock.monotonic()
    1.5
    """

    def __init__(self, bus: SimulatedBus) -> None:
        self._bus = bus
        self._offset_ps = 0
        self._jumped: list[Callable[[], None]] = []
        self._end_ps: int | None = None

    def monotonic(self) -> float:
        """Return the seconds since the simulation began; no fault makes them jump."""
        return self._bus.now_ps / PS_PER_S

    perf_counter = monotonic

    def monotonic_ns(self) -> int:
        """Return the nanoseconds since the simulation began."""
        return self._bus.now_ps // 1000

    perf_counter_ns = monotonic_ns

    def time(self) -> float:
        """Return the time of day as the program sees it: that of the simulation, and the jumps that faults made."""
        for note in self._jumped:
            note()
        self._jumped.clear()
        return (self._bus.now_ps + self._offset_ps) / PS_PER_S

    def time_ns(self) -> int:
        """Return the time of day in nanoseconds."""
        self.time()
        return (self._bus.now_ps + self._offset_ps) // 1000

    def sleep(self, seconds: float) -> None:
        """Let simulated time pass."""
        self.pass_ps(round(number_within("seconds", seconds, 0.0, 1e6, unit="s") * PS_PER_S))

    def pass_ps(self, duration_ps: int) -> None:
        """Let simulated time pass, up to the end of the program's time."""
        until_ps = self._bus.now_ps + duration_ps
        self._bus.run(until_ps=self.bounded(until_ps))
        self.check()

    def jump(self, by_ps: int, note: Callable[[], None]) -> None:
        """Let the time of day jump; ``note`` is called once the program has looked at it."""
        self._offset_ps += by_ps
        self._jumped.append(note)

    def bounded(self, until_ps: int) -> int:
        """Return ``until_ps``, or the end of the program's time where that is sooner."""
        return until_ps if self._end_ps is None else min(until_ps, self._end_ps)

    def check(self) -> None:
        """End the program where its time is up."""
        if self._end_ps is not None and self._bus.now_ps >= self._end_ps:
            raise TimeIsUp

    def limit(self, end_ps: int | None) -> None:
        """Set or lift the end of the program's time."""
        self._end_ps = end_ps


class SimulatedCan(can.BusABC):
    """A node of a simulated bus as python-can's users know it.

    Parameters
    ----------
    bus
        The simulated bus.
    node
        Number of the node that the program is; PCs are 0 by custom.

    Examples
    --------
    >>> bus = SimulatedBus()
    >>> with SimulatedCan(bus) as pc, bus.transport() as box:
    ...     pc.send(can.Message(arbitration_id=0x201, data=bytes(8), is_extended_id=False))
    ...     received = box.receive(PS_PER_S)
    ...     box.send(Frame(identifier=0x181, data=bytes(8)))
    ...     message = pc.recv(timeout=1.0)
    >>> hex(message.arbitration_id), message.timestamp
    ('0x181', 0.00054)
    """

    def __init__(self, bus: SimulatedBus, node: int = 0, **options: Any) -> None:
        self._simulated = bus
        self._transport = bus.transport(node)
        self.channel_info = f"rtec, simulated, node {node}"
        self.clock = SimulatedClock(bus)
        self._can_protocol = can.CanProtocol.CAN_20
        super().__init__(channel=f"node {node}", **options)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame; there is always room.

        Raises
        ------
        can.CanOperationError
            The bus is shut down, or the frame is no classic data frame.
        """
        self.clock.check()
        if msg.is_remote_frame or msg.is_error_frame or msg.is_fd:
            raise can.CanOperationError("the simulated bus carries classic data frames: no remote, error or FD frame")
        try:
            self._transport.send(
                Frame(identifier=msg.arbitration_id, data=bytes(msg.data), extended=msg.is_extended_id)
            )
        except (LinkError, ArgumentError) as error:
            raise can.CanOperationError(str(error)) from error

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Wait for a frame in simulated time; the clock stands at its arrival, or ``timeout`` seconds later.

        Raises
        ------
        can.CanOperationError
            The bus is shut down, or no node sends any more and there is no timeout.
        """
        bus = self._simulated
        self.clock.check()
        wait_s = LONGEST_WAIT_S if timeout is None else max(float(timeout), 0.0)
        until_ps = self.clock.bounded(bus.now_ps + round(wait_s * PS_PER_S))
        while True:
            try:
                received = self._transport.receive(until_ps)
            except LinkError as error:
                raise can.CanOperationError(str(error)) from error
            if received is None:
                break
            message = can.Message(
                timestamp=received.arrival_ps / PS_PER_S,
                arbitration_id=received.frame.identifier,
                is_extended_id=received.frame.extended,
                data=received.frame.data,
                channel=0,
                is_rx=True,
            )
            if self._matches_filters(message):
                return message
        self.clock.check()
        if timeout is None:
            raise can.CanOperationError(
                f"no node has sent anything for {LONGEST_WAIT_S:g} s, and recv() without a timeout would never return"
            )
        return None

    def play(self, program: Callable[P, T], seconds: float, /, *args: P.args, **kwargs: P.kwargs) -> T | None:
        """Run a program for some simulated seconds; return what it returns, or None where its time was up.

        A program that ends sooner leaves the rest of the time to the machine.

        Parameters
        ----------
        program
            What to call; it need not ever return.
        seconds
            Simulated time after which it is stopped, where it waits or sends.
        args, kwargs
            Its arguments.

        Raises
        ------
        ArgumentError
            A time that is no positive number.
        """
        end_ps = self._simulated.now_ps + round(number_within("seconds", seconds, 1e-6, 1e6, unit="s") * PS_PER_S)
        self.clock.limit(end_ps)
        result = None
        try:
            result = program(*args, **kwargs)
        except TimeIsUp:
            pass
        finally:
            self.clock.limit(None)
        if self._simulated.now_ps < end_ps:
            self._simulated.run(until_ps=end_ps)
        return result

    def at(self, seconds: float, action: Callable[[], object]) -> None:
        """Call ``action`` when the simulated clock reaches ``seconds``, whatever the program does then.

        Raises
        ------
        ArgumentError
            A time that has passed.
        """
        number_within("seconds", seconds, 0.0, 1e6, unit="s")
        self._simulated.at(round(seconds * PS_PER_S), lambda: (action(), None)[1])

    @property
    def state(self) -> can.BusState:
        """Return the state of the bus, as python-can names it."""
        bad = self._transport.state in (BusState.OFF, BusState.GONE)
        return can.BusState.ERROR if bad else can.BusState.ACTIVE

    @state.setter
    def state(self, new_state: can.BusState) -> None:
        raise NotImplementedError("the state of a simulated bus follows from what happens on it")

    def shutdown(self) -> None:
        """Leave the bus."""
        self._transport.close()
        super().shutdown()

    def _send_periodic_internal(self, *args: Any, **kwargs: Any) -> Any:
        raise NotImplementedError(
            "send_periodic runs in a thread and in real time; in simulated time send in the program's own loop"
        )
