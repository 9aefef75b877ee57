"""What ``rtec box`` and ``rtec pc`` have in common: options of the bus, numbers of axes, how they tell things."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rtec.cli._arguments import whole
from rtec.cli._words import among
from rtec.errors import ArgumentError
from rtec.units import LENGTH, TIME, parse_quantity, parse_time_ps
from rtec.whole_file import check_file

if TYPE_CHECKING:
    from rtec.link.transport import Transport
    from rtec.live.events import Event, Events
    from rtec.live.screen import Screen

LINE = "rtec"
"""Name of the line between box and PC where no interface is named."""

BUS, MACHINE, TIMES, OUTPUT = "The bus", "The machine", "Times and limits", "Output"


def option(name: str, panel: str, metavar: str, text: str) -> Any:
    """Return an option of a panel."""
    return typer.Option(name, help=text, metavar=metavar, rich_help_panel=panel, autocompletion=among(metavar, name))


@dataclass(frozen=True, slots=True, kw_only=True)
class BusWords:
    """The bus as the user names it."""

    interface: str | None
    channel: str | None
    bitrate: str | None

    def __post_init__(self) -> None:
        """Refuse what only an interface has."""
        if self.interface is None and self.bitrate is not None:
            raise ArgumentError(
                "--bitrate", self.bitrate, "it together with --interface", "the built-in line has none"
            )
        if self.interface is not None and self.channel is None:
            raise ArgumentError("--interface", self.interface, "it together with --channel", "such as --channel can0")

    @property
    def line(self) -> str:
        """Return the name of the built-in line."""
        return self.channel or LINE

    @property
    def rate(self) -> int | None:
        """Return the bitrate in bit/s."""
        if self.bitrate is None:
            return None
        return whole(self.bitrate, name="--bitrate")

    def open(self, channel: str | None = None) -> Transport:
        """Open the bus; on the built-in line, its end ``channel``."""
        from rtec.link.python_can import open_transport

        if channel is not None:
            return open_transport(interface="slcan", channel=channel)
        return open_transport(interface=self.interface or "", channel=self.channel or "", bitrate=self.rate)

    def words(self) -> list[str]:
        """Return the options that name the same bus for the other side."""
        found = []
        for name, value in (
            ("--interface", self.interface),
            ("--channel", self.channel),
            ("--bitrate", self.bitrate),
        ):
            if value is not None and not (name == "--channel" and self.interface is None and value == LINE):
                found += [name, value]
        return found


def check_dbc(file: Path | None) -> None:
    """Refuse a DBC of the user's that describes other messages than ours."""
    if file is not None:
        from rtec.link.messages import MessageSet

        MessageSet.load(file)


def check_log(file: Path | None, *, force: bool) -> None:
    """Refuse a log that cannot be written."""
    if file is not None:
        check_file("--log", file, force=force, endings=(".log", ".asc", ".blf"))


@contextmanager
def logged(transport: Transport, file: Path | None, force: bool) -> Iterator[Transport]:
    """Close the transport at the end; write its frames to a log where one is named."""
    if file is None:
        with transport:
            yield transport
        return
    from rtec.link.logs import Existing, Log, Recorded, wall_zero_unix_s

    with ExitStack() as stack:
        stack.callback(transport.close)
        existing = Existing.REPLACE if force else Existing.REFUSE
        log = stack.enter_context(Log(file, zero_unix_s=wall_zero_unix_s(transport), existing=existing))
        yield Recorded(transport, log)


def axes_of(axis: str | None, axes: str | None) -> list[int]:
    """Return the numbers of the axes: ``--axis 2`` is axis 2, ``--axes 3`` are axes 1, 2 and 3."""
    from rtec.link._frame_kernels import MOST_AXES

    if axis is not None and axes is not None:
        raise ArgumentError("--axes", axes, "--axis or --axes", "leave one of them out")
    name = "--axis" if axes is None else "--axes"
    number = whole(axes or axis or "1", name=name)
    if not 1 <= number <= MOST_AXES:
        raise ArgumentError(name, number, f"1 to {MOST_AXES}")
    return [number] if axes is None else list(range(1, number + 1))


def length(text: str, name: str) -> float:
    """Read a length in mm."""
    return parse_quantity(text, LENGTH, name=name)


def seconds(text: str, name: str) -> float:
    """Read a time above zero, in s."""
    value = parse_quantity(text, TIME, name=name)
    if not 0.0 < value <= 8.64e6:
        raise ArgumentError(name, text, "above 0 s, up to 100 days")
    return value


def picoseconds(text: str, name: str) -> int:
    """Read a time in ps."""
    return parse_time_ps(text, name=name)


def watch_of(watch: str | None, cycle_ps: int) -> int:
    """Return the longest silence in ps: five cycles where nothing else is said."""
    return 5 * cycle_ps if watch is None else picoseconds(watch, "--watch")


def teller(as_json: bool) -> Callable[[Event], None]:
    """Return what writes events: lines on stdout, or on stderr where stdout is for the JSON document."""
    stream = sys.stderr if as_json else sys.stdout

    def tell(event: Event) -> None:
        stream.write(f"{event}\n")
        stream.flush()

    return tell


@contextmanager
def screen(wanted: bool, events: Events, *, takes_keys: bool) -> Iterator[Screen | None]:
    """Draw a view where there is a terminal for it; the events are then told in it, and no longer line by line."""
    from rtec.live.screen import Screen, can_show

    if not wanted or not can_show():
        yield None
        return
    view = Screen(takes_keys=takes_keys)
    lines, events.tell = events.tell, lambda event: None
    try:
        yield view
    finally:
        view.close()
        events.tell = lines
