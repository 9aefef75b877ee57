"""How each interface of python-can is opened and guarded, and what the errors of its driver mean."""

from __future__ import annotations

import contextlib
import errno
import os
import select
import socket
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import can
import serial
from can.interfaces.serial.serial_can import SerialBus
from can.interfaces.slcan import slcanBus

from rtec.checks import whole_within
from rtec.errors import LinkError, meant

if sys.platform != "win32":
    import fcntl

SELECTABLE = frozenset({"slcan", "serial", "socketcan", "udp_multicast"})
"""Interfaces that keep nothing back: what their file descriptor and our own `ReadAhead` have is all there is."""

SEND_WAIT_S = 0.01
"""Longest wait for room to send a frame; once one was dropped, the next is not waited for at all."""

_TERMINALS = frozenset({"slcan", "serial"})
_DECODED_HERE = frozenset({"slcan", "serial", "udp_multicast"})
"""Interfaces that python-can decodes itself, so that an error may be a broken frame and not a broken bus."""

FIRST_WRITE_S = 1.0
"""Time within which a terminal must accept what is written; beyond it nothing reads the other end."""

SERIAL_READ_S = 0.02
"""Longest pause inside a frame of `serial`: the latency timer of a USB adapter is 16 ms."""

AHEAD_BYTES = 4096

_ASCII = bytes(range(128)) + b"?" * 128
"""Bytes that are not text become question marks: otherwise python-can would fail on the line again with each byte."""

VIRTUAL_QUEUE = 4096
"""Frames that wait for a node of `virtual` that does not read; python-can's own queue has no end."""

_FULL = frozenset({errno.ENOBUFS, errno.EAGAIN, errno.ENOMEM})

_INSTALL = {
    "udp_multicast": 'python -m pip install "python-can[multicast]"',
    "slcan": 'python -m pip install "python-can[serial]"',
    "serial": 'python -m pip install "python-can[serial]"',
}


@dataclass(slots=True, kw_only=True)
class Adapter:
    """One channel of one interface, with the lock that keeps a second program from a terminal."""

    interface: str
    channel: str
    bitrate: int | None
    _lock: int | None = field(default=None, init=False)
    _port: serial.SerialBase | None = field(default=None, init=False)
    _ahead: ReadAhead | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        if self.interface not in can.VALID_INTERFACES:
            names = sorted(can.VALID_INTERFACES)
            known = f"{meant(self.interface, names)} known: {', '.join(names)}".lstrip()
            raise LinkError(self.interface, "", "python-can knows no such interface", known)
        if not self.channel:
            raise LinkError(self.interface, "", "no channel is named", "name one, such as can0 or /dev/ttyACM0")
        if self.bitrate is not None:
            whole_within("bitrate", self.bitrate, 1, 1_000_000, unit="bit/s (classic CAN)")

    @property
    def echoes(self) -> bool:
        """Tell whether own frames come back: a multicast socket hears itself, and python-can lets it."""
        return self.interface == "udp_multicast"

    def open(self) -> can.BusABC:
        """Open the bus.

        Raises
        ------
        LinkError
            The channel does not exist, is in use, is not allowed, or its driver is missing.
        """
        on_terminal = self.interface in _TERMINALS and "://" not in self.channel
        try:
            if on_terminal and sys.platform != "win32":
                self._lock = self._take_terminal(_device(self.channel))
            bus = can.Bus(interface=self.interface, channel=self.channel, ignore_config=True, **self._options())
        except LinkError:
            self.release()
            raise
        except Exception as error:  # drivers raise exceptions of any kind
            self.release()
            raise LinkError(
                self.interface, self.channel, f"cannot be opened ({reason_of(error)})", self._hint(error)
            ) from error
        self._tune(bus)
        return bus

    def has_more(self) -> bool:
        """Tell whether there is input that the file descriptor does not show any more."""
        return self._ahead is not None and self._ahead.in_waiting > 0

    def release(self) -> None:
        """Give the terminal back."""
        if self._port is not None:
            # slcan says goodbye before it closes, and closes nothing where that fails
            with contextlib.suppress(OSError):
                self._port.close()
            self._port = None
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _options(self) -> dict[str, Any]:
        options: dict[str, Any] = {} if self.bitrate is None else {"bitrate": self.bitrate}
        if self.interface == "virtual":
            options["rx_queue_size"] = VIRTUAL_QUEUE
        elif self.interface == "serial":
            options["timeout"] = SERIAL_READ_S
        elif self.interface == "slcan":
            if sys.platform != "win32":
                options["timeout"] = 0  # it is read when something is there
            if "://" in self.channel or _is_pseudo_terminal(self.channel):
                options["sleep_after_open"] = 0  # nothing restarts when it is opened, as many adapters do
        return options

    def _take_terminal(self, device: str) -> int:
        """Lock a terminal by the means that pyserial and others use, before the first byte disturbs its owner."""
        try:
            descriptor = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC)
        except OSError as error:
            hint = {
                errno.ENOENT: "does the program that offers it run? 'python -m serial.tools.list_ports' lists all",
                errno.EACCES: "on most systems the group 'dialout' may use it",
            }.get(error.errno or 0, "is it plugged in, and is no other program using it?")
            raise LinkError(self.interface, self.channel, f"cannot be opened ({reason_of(error)})", hint) from None
        try:
            if not os.isatty(descriptor):
                raise LinkError(self.interface, self.channel, "is no terminal", "name a serial device")
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if not select.select([], [descriptor], [], FIRST_WRITE_S)[1]:
                raise LinkError(
                    self.interface, self.channel, "takes nothing, its buffer is full", "is the other end stopped?"
                )
        except BlockingIOError:
            os.close(descriptor)
            raise LinkError(
                self.interface, self.channel, "is in use by another program", "end that one, or name another channel"
            ) from None
        except BaseException:
            os.close(descriptor)
            raise
        return descriptor

    def _tune(self, bus: can.BusABC) -> None:
        """Set what python-can offers no option for, so that a reader that stops does not stop the writer."""
        if isinstance(bus, SerialBus):
            bus._ser.write_timeout = SERIAL_READ_S  # noqa: SLF001 - python-can has no setting for it
        elif isinstance(bus, slcanBus):
            self._port = bus.serialPortOrig
            if sys.platform != "win32":
                self._ahead = ReadAhead(self._port)
                bus.serialPortOrig = self._ahead
            if self.channel.startswith("socket://"):
                # else the system holds small packets back for up to 40 ms
                with socket.socket(fileno=os.dup(bus.fileno())) as same:
                    same.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def _hint(self, error: Exception) -> str:
        if isinstance(error, can.CanInterfaceNotImplementedError) or isinstance(error.__cause__, ImportError):
            return f"install its driver: {_INSTALL.get(self.interface, 'the manual of python-can says how')}"
        codes = {cause.errno for cause in _chain(error) if isinstance(cause, OSError)}
        if self.interface == "socketcan":
            if codes & {errno.EAFNOSUPPORT, errno.EPROTONOSUPPORT}:
                return "this kernel has no CAN; slcan over a pseudo-terminal needs none"
            return "'ip link' lists the interfaces; 'ip link set can0 up type can bitrate 500000' starts one"
        if self.interface == "udp_multicast":
            return "a multicast address of this network, such as 239.74.163.2, is allowed"
        return "check the channel and the bitrate, and that no other program uses it"


def _device(channel: str) -> str:
    return channel.split("@", maxsplit=1)[0]


def _is_pseudo_terminal(channel: str) -> bool:
    return os.path.realpath(_device(channel)).startswith(("/dev/pts/", "/dev/ttys"))


class ReadAhead:
    """The port of python-can's slcan, which reads byte by byte: one call of the system for all that is there.

    Parameters
    ----------
    port
        A port of pyserial that returns at once with what it has.
    """

    def __init__(self, port: serial.SerialBase) -> None:
        self._port = port
        self._data = b""
        self._position = 0
        self.write_timeout = port.write_timeout = SEND_WAIT_S

    @property
    def in_waiting(self) -> int:
        """Return the bytes read ahead."""
        return len(self._data) - self._position

    def read(self, size: int = 1) -> bytes:
        """Return up to ``size`` bytes, and none where there are none."""
        if self._position == len(self._data):
            self._data, self._position = self._port.read(AHEAD_BYTES).translate(_ASCII), 0
        piece = self._data[self._position : self._position + size]
        self._position += len(piece)
        return piece

    def reset_input_buffer(self) -> None:
        """Throw away what has arrived."""
        self._data, self._position = b"", 0
        self._port.reset_input_buffer()

    def flush(self) -> None:
        """Do not wait until the last bit is out: 2 ms at 115200 bit/s, endless where nothing reads."""

    def __getattr__(self, name: str) -> Any:
        """Do all else as the port does it."""
        return getattr(self._port, name)


def _chain(error: BaseException) -> Iterator[BaseException]:
    step: BaseException | None = error
    while step is not None:
        yield step
        step = step.__cause__ or step.__context__


def reason_of(error: BaseException) -> str:
    """Return what the driver says, from the deepest cause that says anything."""
    reasons = [
        text
        for cause in _chain(error)
        if (text := (cause.strerror if isinstance(cause, OSError) and cause.strerror else str(cause)).strip())
    ]
    return " ".join(reasons[-1].split())[:200] if reasons else type(error).__name__


def is_garbled(interface: str, error: Exception) -> bool:
    """Tell whether an error in reading means broken input on a sound bus."""
    return interface in _DECODED_HERE and not any(isinstance(cause, OSError) for cause in _chain(error))


def is_full(error: Exception) -> bool:
    """Tell whether an error in sending means that there was no room for the frame."""
    for cause in _chain(error):
        if isinstance(cause, serial.SerialTimeoutException | TimeoutError | BlockingIOError):
            return True
        if isinstance(cause, OSError):
            return cause.errno in _FULL
    return isinstance(error, can.CanOperationError)
