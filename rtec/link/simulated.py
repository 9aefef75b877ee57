"""A bus in simulated time: transports for programs, places for devices, faults on the way; nothing waits or sleeps.

There is one clock for all. It stands still while a program computes, and moves on while one waits for a frame:

* `SimulatedTransport.receive` carries out everything that is due, on the bus and at every device, until a frame for
  its own node arrives or the time it was given is reached. What arrives for others meanwhile waits for them, with the
  time at which it arrived.
* Several transports driven from one thread take turns: the one that waits advances the time for all. A transport that
  comes late finds its frames, as a program that was busy would.
* A look that may not wait and finds nothing costs `POLL_PS`, so that a program that looks again and again gets on.
* `send` takes no time. The frames of one node leave in the order in which they were sent; between nodes the lowest
  identifier wins the bus.

Devices (a box with its axis) are driven by the clock itself: they are advanced to each moment at which they want to
act or a frame reaches them. The same calls in the same order give the same frames at the same times.
"""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from rtec._jit import Record, new_record
from rtec.checks import whole_within
from rtec.closing import Closing
from rtec.errors import ArgumentError, LinkError
from rtec.link import _bus_kernels
from rtec.link._outbox_kernels import ROOM
from rtec.link.frame import PAYLOAD_BYTES, Frame
from rtec.link.transport import BusState, Received, Traffic
from rtec.signal import NEVER
from rtec.units import PS_PER_S

POLL_PS = 10_000_000
"""Simulated time that a look costs which may not wait and finds nothing: 10 µs."""

BACKLOG = 4096
"""Frames of one node that may wait to be sent, and frames that may wait to be taken."""


class BusFault(Protocol):
    """What can go wrong on a bus; `rtec.machine.faults.Fault` is one."""

    def fill(self, record: Record) -> None:
        """Write the fault into a record of the bus's kernels."""


class Device(Protocol):
    """A node that the clock of the bus drives; `rtec.machine.station.Station` is one."""

    @property
    def due_ps(self) -> int:
        """Return when it next acts on its own."""

    def advance(self, *, until_ps: int) -> list[tuple[int, Frame]]:
        """Run to ``until_ps``; return the frames that it sends meanwhile, with their times."""

    def receive(self, frame: Frame) -> None:
        """Take a frame at the present time."""


F = TypeVar("F", bound=BusFault)


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultActivation(Generic[F]):
    """Activation of a fault: how often it took effect, and when that was first noted.

    What a fault of cable, word or glitches has done is noted at its end.
    """

    fault: F
    times: int
    first_ps: int | None


def activations_of(faults: Sequence[F], records: Record) -> tuple[FaultActivation[F], ...]:
    """Return the activation of each fault, as its kernel's record has it."""
    return tuple(
        FaultActivation(fault=fault, times=int(record.fired), first_ps=int(record.fired_ps) if record.fired else None)
        for fault, record in zip(faults, records, strict=True)
    )


class SimulatedBus:
    """A bus on a clock of its own, which starts at zero.

    Parameters
    ----------
    bitrate
        In bit/s. Every frame takes 135 bits, the longest that one of eight bytes can be.
    faults
        What goes wrong. Each carries its own seed; nothing else is random.

    Raises
    ------
    ArgumentError
        A bitrate outside its range, or a fault that is none of a bus.

    Examples
    --------
    >>> bus = SimulatedBus()
    >>> box, pc = bus.transport(), bus.transport()
    >>> pc.send(Frame(identifier=0x201, data=bytes(8)))
    >>> received = box.receive(PS_PER_S)
    >>> hex(received.frame.identifier), received.arrival_ps
    ('0x201', 270000000)
    >>> box.receive(PS_PER_S) is None, pc.now_ps()
    (True, 1000000000000)
    """

    def __init__(self, *, bitrate: int = 500_000, faults: Sequence[BusFault] = ()) -> None:
        self.bitrate = whole_within("bitrate", bitrate, 10_000, 1_000_000, unit="bit/s")
        self._bus = new_record(_bus_kernels.BUS)
        _bus_kernels.bus_reset(self._bus, PS_PER_S // bitrate)
        self._faults: list[BusFault] = []
        self._records: Any = np.rec.array(np.zeros(0, dtype=_bus_kernels.FAULT))
        self._now_ps = 0
        self._transports: dict[int, SimulatedTransport] = {}
        self._devices: dict[int, Device] = {}
        self._reached_ps: dict[int, int] = {}
        self._agenda: list[tuple[int, int, Callable[[], None]]] = []
        self._serial = 0
        for fault in faults:
            self.add_fault(fault)

    def transport(self, node: int | None = None) -> SimulatedTransport:
        """Join the bus as a program.

        Parameters
        ----------
        node
            Number of the node, 0 to 7, which faults name as their place; None takes the lowest that is free.

        Raises
        ------
        ArgumentError
            The number is taken, or all are.
        """
        node = self._take(node)
        self._transports[node] = SimulatedTransport(self, node)
        return self._transports[node]

    def attach(self, device: Device, node: int | None = None) -> int:
        """Let a device join the bus; return its node.

        Raises
        ------
        ArgumentError
            The number is taken, or all are.
        """
        node = self._take(node)
        self._devices[node] = device
        self._reached_ps[node] = 0
        return node

    def leave(self, node: int) -> None:
        """Let the program at a node leave: its number is free again."""
        self._transports.pop(node, None)

    def add_fault(self, fault: BusFault) -> None:
        """Let something go wrong from now on.

        Raises
        ------
        ArgumentError
            A fault that is none of a bus.
        """
        fresh: Any = np.rec.array(np.zeros(1, dtype=_bus_kernels.FAULT))
        fault.fill(fresh[0])
        if not _bus_kernels.LOST <= int(fresh[0].kind) <= _bus_kernels.LAST_OF_BUS:
            raise ArgumentError(
                "fault", fault, "a fault of the bus", "those of an axis or a PC belong to a workbench"
            )
        self._records = np.rec.array(np.concatenate([self._records, fresh]))
        self._faults.append(fault)

    def at(self, time_ps: int, action: Callable[[], None]) -> None:
        """Call ``action`` when the clock reaches ``time_ps``; what is to happen at one time happens in order.

        Raises
        ------
        ArgumentError
            A time that has passed.
        """
        whole_within("time_ps", time_ps, self._now_ps, NEVER - 1, unit="ps (time never runs back)")
        self._serial += 1
        heapq.heappush(self._agenda, (time_ps, self._serial, action))

    @property
    def now_ps(self) -> int:
        """Return the time on the clock."""
        return self._now_ps

    def run(self, *, until_ps: int) -> None:
        """Let time pass up to ``until_ps``; frames for transports wait for them.

        Raises
        ------
        ArgumentError
            A time before now.
        """
        whole_within("until_ps", until_ps, self._now_ps, NEVER - 1, unit="ps (time never runs back)")
        while self._step(until_ps):
            pass

    @property
    def load(self) -> float:
        """Return the share of time in which the bus was busy."""
        return float(self._bus.busy_ps / max(self._now_ps, 1))

    @property
    def fired(self) -> tuple[FaultActivation[BusFault], ...]:
        """Return the activation of every fault."""
        return activations_of(self._faults, self._records)

    def is_off(self, node: int) -> bool:
        """Return whether a fault has taken a node off the bus."""
        return any(
            record.kind == _bus_kernels.OFF
            and record.place == node
            and record.from_ps <= self._now_ps < record.until_ps
            for record in self._records
        )

    def _take(self, node: int | None) -> int:
        taken = {*self._transports, *self._devices}
        free = [number for number in range(_bus_kernels.NODES) if number not in taken]
        if node is None and free:
            return free[0]
        if node not in free:
            raise ArgumentError("node", node, f"a free node: {', '.join(map(str, free)) or 'all are taken'}")
        return node

    def _step(self, until_ps: int) -> bool:
        """Carry out the next event up to ``until_ps``; return False where the time itself is reached."""
        due_ps, node = min(((device.due_ps, node) for node, device in self._devices.items()), default=(NEVER, -1))
        planned_ps = self._agenda[0][0] if self._agenda else NEVER
        limit_ps = min(due_ps, planned_ps, until_ps + 1)
        crowded = self._feed()
        if crowded:  # look again before a queue of the bus has run empty
            limit_ps = min(limit_ps, self._now_ps + _bus_kernels.FRAME_BITS * int(self._bus.bit_ps) * ROOM // 2)
        t_ps = int(_bus_kernels.next_delivery(self._bus, self._records, limit_ps))
        if t_ps != NEVER:
            self._now_ps = max(self._now_ps, t_ps)
            self._deliver()
        elif limit_ps == planned_ps:
            self._now_ps = max(self._now_ps, planned_ps)
            self._advance_devices(self._now_ps)
            heapq.heappop(self._agenda)[2]()
        elif limit_ps == due_ps:
            self._now_ps = max(self._now_ps, due_ps)
            self._advance(node, due_ps + 1)
        elif crowded and limit_ps <= until_ps:
            self._now_ps = limit_ps
        else:
            self._now_ps = until_ps
            self._advance_devices(until_ps)
            return False
        return True

    def _advance(self, node: int, until_ps: int) -> None:
        if until_ps <= self._reached_ps[node]:
            return
        self._reached_ps[node] = until_ps
        for t_ps, frame in self._devices[node].advance(until_ps=until_ps):
            self._submit(node, t_ps, frame)

    def _advance_devices(self, until_ps: int) -> None:
        for node in self._devices:
            self._advance(node, until_ps)

    def _submit(self, node: int, t_ps: int, frame: Frame) -> None:
        identifier, payload = _packed(frame)
        _bus_kernels.bus_submit(self._bus, self._records, node, t_ps, identifier, payload)

    def _feed(self) -> bool:
        """Hand waiting frames on to the bus; return whether any wait."""
        crowded = False
        for node, transport in self._transports.items():
            while transport.backlog and self._bus.queues[node].waiting < ROOM:
                self._submit(node, self._now_ps, transport.backlog.popleft())
            crowded = crowded or bool(transport.backlog)
        return crowded

    def _deliver(self) -> None:
        sender = int(self._bus.node)
        frame = _unpacked(int(self._bus.identifier), int(self._bus.payload))
        for node, transport in list(self._transports.items()):
            if node != sender and not self.is_off(node):
                transport.arrive(frame, self._now_ps)
        for node, device in self._devices.items():
            if node != sender and not self.is_off(node):
                self._advance(node, self._now_ps)
                device.receive(frame)


class SimulatedTransport(Closing):
    """One program's `rtec.link.transport.Transport` on a `SimulatedBus`, which makes it.

    Attributes
    ----------
    node
        Number of its node.
    overrun
        Frames that were dropped because this program did not take them.
    """

    def __init__(self, bus: SimulatedBus, node: int) -> None:
        self.node = node
        self.overrun = 0
        self.backlog: deque[Frame] = deque()
        self._bus = bus
        self._traffic = Traffic()
        self._inbox: deque[Received] = deque()
        self._blocked = False
        self._closed = False

    @property
    def state(self) -> BusState:
        """Return how the bus is."""
        if self._closed:
            return BusState.GONE
        if self._bus.is_off(self.node):
            return BusState.OFF
        return BusState.WARNING if self._blocked else BusState.ACTIVE

    @property
    def traffic(self) -> Traffic:
        """Return what has been counted."""
        return self._traffic

    def now_ps(self) -> int:
        """Return the simulated time, the same for all nodes."""
        return self._bus.now_ps

    def send(self, frame: Frame) -> None:
        """Send a frame, or drop and count it where too many wait or the node is off the bus."""
        self._refuse_when_closed()
        self._blocked = len(self.backlog) >= BACKLOG
        if self._blocked:
            self._traffic.unsent += 1
            return
        if self._bus.is_off(self.node):
            self._traffic.unsent += 1
        else:
            self._traffic.sent += 1
        self.backlog.append(frame)
        self._bus._feed()  # noqa: SLF001 - the bus is the other half of this class

    def receive(self, until_ps: int) -> Received | None:
        """Return the next frame that arrives until ``until_ps``, or None at that time."""
        self._refuse_when_closed()
        if not self._inbox:
            now_ps = self._bus.now_ps
            until_ps = until_ps if until_ps > now_ps else now_ps + POLL_PS
            while not self._inbox and self._bus._step(until_ps):  # noqa: SLF001 - its own bus
                self._refuse_when_closed()  # something planned may have closed it
        if not self._inbox:
            return None
        self._traffic.received += 1
        return self._inbox.popleft()

    def arrive(self, frame: Frame, at_ps: int) -> None:
        """Take a frame from the bus; it waits until the program looks."""
        if self._closed:
            return
        if len(self._inbox) >= BACKLOG:
            self.overrun += 1
            return
        self._inbox.append(Received(frame=frame, arrival_ps=at_ps))

    def close(self) -> None:
        """Leave the bus; what has not been sent by then is not sent, and the number of the node is free again."""
        if self._closed:
            return
        self._closed = True
        self._bus.leave(self.node)
        self.backlog.clear()
        self._inbox.clear()

    def _refuse_when_closed(self) -> None:
        if self._closed:
            raise LinkError("simulated", f"node {self.node}", "is closed", "open it again")


def _packed(frame: Frame) -> tuple[int, int]:
    missing = PAYLOAD_BYTES - len(frame.data)
    payload = int.from_bytes(frame.data + bytes(missing), "little", signed=True)
    extended = _bus_kernels.EXTENDED if frame.extended else 0
    return frame.identifier | missing << _bus_kernels.SHORT_SHIFT | extended, payload


def _unpacked(identifier: int, payload: int) -> Frame:
    missing = (identifier & ~_bus_kernels.EXTENDED) >> _bus_kernels.SHORT_SHIFT
    data = payload.to_bytes(PAYLOAD_BYTES, "little", signed=True)
    return Frame(
        identifier=identifier & ((1 << _bus_kernels.SHORT_SHIFT) - 1),
        data=data[: PAYLOAD_BYTES - missing],
        extended=bool(identifier & _bus_kernels.EXTENDED),
    )
