"""A transport over python-can: adapters of all makers, and buses without hardware.

The verbs of the command line import this module where they need it, because loading python-can takes 0.1 s.

Four interfaces have a file descriptor on which the system itself waits (`slcan`, `serial`, `socketcan`,
`udp_multicast`), so that a frame is taken the moment it arrives and nothing is polled; the drivers behind the
others wait by themselves.
"""

from __future__ import annotations

import logging
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Callable

import can

from rtec.closing import Closing
from rtec.errors import ArgumentError, LinkError
from rtec.link._adapters import SELECTABLE, SEND_WAIT_S, Adapter, is_full, is_garbled, reason_of
from rtec.link.frame import Frame
from rtec.link.transport import BusState, Received, Traffic
from rtec.units import PS_PER_NS, PS_PER_S

# python-can also logs what it raises; without a handler Python would print that beside our one clear line
logging.getLogger("can").addHandler(logging.NullHandler())


SLICE_S = 0.05
"""Longest wait inside a driver without a file descriptor; after it we look whether the transport was closed."""

FRUITLESS_READS = 512
"""Reads in a row without a whole frame after which the input is taken for noise and thrown away."""

ECHO_S = 1.0
"""An own frame that has not come back by multicast after this time is not waited for any longer."""

GONE_HINT = "check the cable, or whether the program at the other end still runs, then open it again"

# linux/can/error.h: class bits in the identifier, and the state of the controller in byte 1
_ERROR_CONTROLLER, _ERROR_BUS_OFF, _ERROR_RESTARTED = 0x004, 0x040, 0x100
_CONTROLLER_WARNING, _CONTROLLER_ACTIVE = 0x3C, 0x40


def open_transport(*, interface: str, channel: str, bitrate: int | None = None) -> PythonCanTransport:
    """Open a bus as users of python-can name it.

    Parameters
    ----------
    interface
        `virtual`, `slcan`, `serial`, `socketcan`, `udp_multicast`, or another name that python-can knows.
    channel
        The channel on it: a device such as `/dev/ttyACM0`, `can0`, a multicast address.
    bitrate
        In bit/s, where the interface takes one.

    Raises
    ------
    LinkError
        No such interface, its driver is not installed, the channel does not exist or is in use.
    ArgumentError
        A bitrate that classic CAN does not have.

    Examples
    --------
    >>> with open_transport(interface="virtual", channel="doc") as box:
    ...     with open_transport(interface="virtual", channel="doc") as pc:
    ...         pc.send(Frame(identifier=0x120, data=bytes(8)))
    ...         hex(box.receive(box.now_ps() + PS_PER_S).frame.identifier)
    '0x120'

    >>> open_transport(interface="socketcam", channel="can0")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    rtec.errors.LinkError: socketcam: python-can knows no such interface; did you mean 'socketcan'? known: ...
    """
    return PythonCanTransport(Adapter(interface=interface, channel=channel, bitrate=bitrate))


class PythonCanTransport(Closing):
    """A `rtec.link.transport.Transport` over one bus of python-can; `open_transport` makes it.

    Its clock is the machine's monotonic clock, the same for all processes. A frame arrives when it is taken from
    the driver.
    """

    def __init__(self, adapter: Adapter) -> None:
        self._adapter = adapter
        self._traffic = Traffic()
        self._gone: LinkError | None = None
        self._blocked = False
        self._condition = BusState.ACTIVE
        self._fruitless = 0
        self._own: deque[tuple[int, Frame]] = deque()
        self._receiving = threading.Lock()
        self._wake_in, self._wake_out = socket.socketpair()
        try:
            self._bus = adapter.open()
        except BaseException:
            self._close_sockets()
            raise
        self._descriptor = self._descriptor_to_wait_on()

    @property
    def state(self) -> BusState:
        """Return how the bus is."""
        if self._gone is not None:
            return BusState.GONE
        condition = self._condition if self._condition is not BusState.ACTIVE else self._driver_state()
        return BusState.WARNING if condition is BusState.ACTIVE and self._blocked else condition

    @property
    def traffic(self) -> Traffic:
        """Return what has been counted."""
        return self._traffic

    def now_ps(self) -> int:
        """Return the machine's monotonic time."""
        return time.monotonic_ns() * PS_PER_NS

    def send(self, frame: Frame) -> None:
        """Send a frame, or drop and count it where the way to the bus is full."""
        self._refuse_when_gone()
        if not self._has_room():
            self._drop()
            return
        if self._adapter.echoes:
            self._own.append((self.now_ps(), frame))
        try:
            self._bus.send(_message_of(frame), timeout=SEND_WAIT_S)
        except Exception as error:  # drivers raise what they like
            if not is_full(error):
                raise self._vanish(error) from error
            self._drop()
            return
        self._blocked = False
        self._traffic.sent += 1

    def receive(self, until_ps: int) -> Received | None:
        """Return the next classic data frame that arrives until ``until_ps``, or None at that time."""
        with self._receiving:
            while True:
                self._refuse_when_gone()
                left_s = max(0.0, (until_ps - self.now_ps()) / PS_PER_S)
                message = self._next_message(left_s)
                if message is not None and (frame := self._judge(message)) is not None:
                    self._traffic.received += 1
                    return Received(frame=frame, arrival_ps=self.now_ps())
                if left_s == 0.0:
                    return None

    def close(self) -> None:
        """Leave the bus; a `receive` that waits in another thread ends with a LinkError."""
        already = self._gone is not None
        if not already:
            self._gone = LinkError(self._adapter.interface, self._adapter.channel, "is closed", "open it again")
        if self._wake_out.fileno() < 0:
            return
        self._wake_out.send(b"x")
        with self._receiving:
            self._quietly(self._bus.shutdown)
            self._adapter.release()
            self._close_sockets()

    def _descriptor_to_wait_on(self) -> int | None:
        if self._adapter.interface not in SELECTABLE:
            return None
        try:
            return self._bus.fileno()
        except NotImplementedError:  # a serial port of Windows
            return None

    def _refuse_when_gone(self) -> None:
        if self._gone is not None:
            # a fresh one: a raised exception keeps the traceback of its first raise
            gone = self._gone
            raise LinkError(gone.interface, gone.channel, gone.problem, gone.hint)

    def _vanish(self, error: Exception) -> LinkError:
        gone = LinkError(
            self._adapter.interface, self._adapter.channel, f"has vanished ({reason_of(error)})", GONE_HINT
        )
        self._gone = self._gone or gone
        return gone

    def _next_message(self, left_s: float) -> can.Message | None:
        try:
            if self._descriptor is None:
                return self._bus.recv(min(left_s, SLICE_S))
            if not self._adapter.has_more():
                ready, _, _ = select.select([self._descriptor, self._wake_in.fileno()], [], [], left_s)
                if self._descriptor not in ready:
                    return None
            message = self._bus.recv(0.0)
        except Exception as error:  # drivers raise what they like
            if not is_garbled(self._adapter.interface, error):
                raise self._vanish(error) from error
            self._traffic.garbled += 1
            return None
        self._fruitless = 0 if message is not None else self._fruitless + 1
        if self._fruitless > FRUITLESS_READS:
            self._throw_away()
        return message

    def _throw_away(self) -> None:
        self._traffic.garbled += 1
        self._fruitless = 0
        flush: Callable[[], None] | None = getattr(self._bus, "flush", None)
        if flush is not None:  # slcan keeps the start of a line until its end
            self._quietly(flush)

    def _judge(self, message: can.Message) -> Frame | None:
        """Return the frame of a message, or None where it is not for us."""
        if message.is_error_frame:
            self._traffic.error += 1
            if self._adapter.interface == "socketcan":
                self._read_error_frame(message)
        elif message.is_remote_frame:
            self._traffic.remote += 1
        elif message.is_fd:
            self._traffic.foreign += 1
        elif (frame := _frame_of(message)) is None:
            self._traffic.garbled += 1
        elif not self._is_own(frame):
            if self._condition is BusState.OFF:
                self._condition = BusState.ACTIVE  # a controller that is off the bus receives nothing
            return frame
        return None

    def _read_error_frame(self, message: can.Message) -> None:
        flags = message.arbitration_id
        if flags & _ERROR_BUS_OFF:
            self._condition = BusState.OFF
        elif flags & _ERROR_RESTARTED:
            self._condition = BusState.ACTIVE
        elif flags & _ERROR_CONTROLLER and len(message.data) > 1:
            if message.data[1] & _CONTROLLER_WARNING:
                self._condition = BusState.WARNING
            elif message.data[1] & _CONTROLLER_ACTIVE:
                self._condition = BusState.ACTIVE

    def _is_own(self, frame: Frame) -> bool:
        """Tell whether multicast has handed back a frame of ours; equal frames of others are told by their number."""
        oldest_ps = self.now_ps() - int(ECHO_S * PS_PER_S)
        while self._own and self._own[0][0] < oldest_ps:
            self._own.popleft()
        for index, (_, own) in enumerate(self._own):
            if own == frame:
                del self._own[index]
                return True
        return False

    def _has_room(self) -> bool:
        if self._descriptor is None:
            return True
        try:
            _, ready, _ = select.select([], [self._descriptor], [], 0.0 if self._blocked else SEND_WAIT_S)
        except (OSError, ValueError) as error:
            raise self._vanish(error) from error
        return bool(ready)

    def _drop(self) -> None:
        self._blocked = True
        self._traffic.unsent += 1

    def _driver_state(self) -> BusState:
        try:
            state = self._bus.state
        except Exception:  # not every driver can tell
            return BusState.ACTIVE
        return {can.BusState.ERROR: BusState.OFF, can.BusState.PASSIVE: BusState.WARNING}.get(state, BusState.ACTIVE)

    def _quietly(self, call: Callable[[], None]) -> None:
        try:
            call()
        except Exception as error:  # a bus that is gone cannot be left in good order
            logging.getLogger(__name__).debug("%s: %s", self._adapter.channel, error)

    def _close_sockets(self) -> None:
        self._wake_in.close()
        self._wake_out.close()


def _message_of(frame: Frame) -> can.Message:
    return can.Message(
        arbitration_id=frame.identifier,
        data=frame.data,
        is_extended_id=frame.extended,
        is_rx=False,
    )


def _frame_of(message: can.Message) -> Frame | None:
    """Return the frame, or None where the message contradicts itself (a text line cut off, a bit turned over)."""
    if message.dlc != len(message.data):
        return None
    try:
        return Frame(
            identifier=message.arbitration_id,
            data=bytes(message.data),
            extended=message.is_extended_id,
        )
    except ArgumentError:
        return None
