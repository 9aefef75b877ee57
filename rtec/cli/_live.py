"""What ``rtec box`` and ``rtec pc`` have in common: options of the bus, numbers of axes, how they tell things."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from rtec.checks import whole_within
from rtec.cli._console import note
from rtec.cli._parameters import apart, design, flag, force, needs, option, quantity, time_ps, whole, written
from rtec.errors import ArgumentError, LinkError
from rtec.units import LENGTH, TIME, parse_quantity

if TYPE_CHECKING:
    from rtec.link.transport import Transport
    from rtec.live.events import Event, Events
    from rtec.live.screen import Screen

_SHARED = (None, "virtual", "socketcan", "udp_multicast")
"""Interfaces on which both sides name the same channel."""

_OTHER_ADAPTER = "CHANNEL"

_LOOK_S = 0.1

LINE = "rtec"
"""Name of the line between box and PC where no interface is named."""

BUS, MACHINE, TIMES, OUTPUT = "The bus", "The machine", "Times and limits", "Output"


def seconds(name: str, metavar: str, text: str, *, default: str | None = None) -> Any:
    """Return an option that takes a time above zero, in s."""

    def read(said: str) -> float:
        value = parse_quantity(said, TIME, name=name)
        if not 0.0 < value <= 8.64e6:
            raise ArgumentError(name, said, "more than 0 s, up to 100 days")
        return value

    return option(name, metavar, text, default=default, panel=TIMES, read=read)


def interface(text: str) -> Any:
    """Return the option that takes the name of an interface."""
    return option("--interface", "NAME", f"As python-can names it; without it, {text}", panel=BUS)


CHANNEL = option("--channel", "NAME", "Of the interface; without one, the line's name.", panel=BUS)
BITRATE = whole("--bitrate", "Of the interface, bit/s.", metavar="500000", panel=BUS)
DBC = option("--dbc", "FILE.dbc", "A DBC of yours that must describe the same messages.", panel=BUS)
AXIS = whole("--axis", "Number of the one axis.", metavar="1", panel=MACHINE)
AXES = whole("--axes", "Axes 1 to N.", metavar="3", panel=MACHINE)
DESIGN = design("Insertion design of the box.", panel=MACHINE, default="a")
COUNT = quantity("--count", LENGTH, "1um", "Travel of one count of the encoder.", panel=MACHINE, default="1um")
WINDOW = whole("--window", "Largest change of the request that is believed.", metavar="STEPS", panel=TIMES, default=3)
CYCLE = time_ps(
    "--cycle", "10ms", "Between the frames of one kind; of box and PC alike.", panel=TIMES, default="10ms"
)
WATCHDOG = time_ps(
    "--watchdog", "50ms", "Longest silence of the other side, 3 to 6 cycles; 5 without it.", panel=TIMES
)
DURATION = seconds("--duration", "10s", "End by itself after this time.")
LOG = written("--log", "FILE", "Frames to a .log, .asc or .blf file.", endings=(".log", ".asc", ".blf"), panel=OUTPUT)
FORCE = force("Overwrite the log.", panel=OUTPUT)
PLAIN = flag("--plain", "Lines of events, no view.", panel=OUTPUT)
JSON = flag("--json", "One JSON document on stdout at the end.", panel=OUTPUT)


@dataclass(frozen=True, slots=True, kw_only=True)
class BusWords:
    """The bus as the user names it."""

    interface: str | None
    channel: str | None
    bitrate: int | None

    def __post_init__(self) -> None:
        """Refuse what only an interface has."""
        if self.interface is None and self.bitrate is not None:
            raise needs("--bitrate", "--interface", "the built-in line has none")
        if self.interface is not None and self.channel is None:
            raise ArgumentError("--channel", None, "the channel of the interface, such as --channel can0")

    @property
    def line(self) -> str:
        """Return the name of the built-in line."""
        return self.channel or LINE

    def open(self, channel: str | None = None) -> Transport:
        """Open the bus; on the built-in line, its end ``channel``."""
        from rtec.link.python_can import open_transport

        if channel is not None:
            return open_transport(interface="slcan", channel=channel)
        return open_transport(interface=self.interface or "", channel=self.channel or "", bitrate=self.bitrate)

    def ways_in(self, command: str) -> list[str]:
        """Return what to say of how a PC joins: ``command``, the line for python-can, and the messages as a DBC.

        Examples
        --------
        >>> bus = BusWords(interface="socketcan", channel="can0", bitrate=None)
        >>> bus.ways_in("rtec pc --interface socketcan --channel can0")[1]
        'or in Python: can.Bus(interface="socketcan", channel="can0")'
        """
        from rtec.link.pseudo_terminal import well_known

        if self.interface == "virtual":
            return ["no other program can join: a virtual bus of python-can ends where its process does"]
        interface, channel = self.interface or "slcan", self.channel_of_others
        more = "" if self.bitrate is None else f", bitrate={self.bitrate}"
        if self.interface is None:
            channel = str(well_known(self.line))
            more = ", sleep_after_open=0"  # else python-can waits for two seconds
        where = "with the other side's own adapter as CHANNEL" if channel == _OTHER_ADAPTER else "in another terminal"
        bus = f"can.Bus(interface={json.dumps(interface)}, channel={json.dumps(channel)}{more})"
        dbc = files("rtec.link").joinpath("rtec.dbc")
        return [f"{where}: {command}", f"or in Python: {bus}", f"messages: {dbc}"]

    @property
    def channel_of_others(self) -> str | None:
        """Return the channel by which the other side reaches the same bus.

        An adapter serves one program: who joins has another one on the same wires.
        """
        return self.channel if self.interface in _SHARED else _OTHER_ADAPTER

    def line_of_box(self, wait_s: float) -> str:
        """Return the device of the built-in line, once a box offers it.

        Raises
        ------
        LinkError
            None has done so within ``wait_s``.
        """
        from rtec.link.pseudo_terminal import find_line

        until_s = time.monotonic() + wait_s
        told = False
        while True:
            try:
                return find_line(self.line)
            except LinkError as error:
                if time.monotonic() >= until_s:
                    hint = (
                        f"start 'rtec box' in another terminal, or name an --interface; it would be {error.channel}"
                    )
                    raise LinkError("line", self.line, f"no box has offered it for {wait_s:g} s", hint) from None
            if not told:
                note(f"waiting up to {wait_s:g} s for a box on the line '{self.line}': 'rtec box' offers it")
                told = True
            time.sleep(min(_LOOK_S, max(until_s - time.monotonic(), 0.0)))

    def words(self) -> list[str]:
        """Return the options that name the same bus for the other side."""
        found = []
        for name, value in (
            ("--interface", self.interface),
            ("--channel", self.channel_of_others),
            ("--bitrate", self.bitrate),
        ):
            if value is not None and not (name == "--channel" and self.interface is None and value == LINE):
                found += [name, str(value)]
        return found


def check_dbc(file: Path | None) -> None:
    """Refuse a DBC of the user's that describes other messages than ours."""
    if file is not None:
        from rtec.link.messages import MessageSet

        MessageSet.load(file)


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


def axes_of(axis: int | None, axes: int | None) -> list[int]:
    """Return the numbers of the axes: ``--axis 2`` is axis 2, ``--axes 3`` are axes 1, 2 and 3."""
    from rtec.link._frame_kernels import MOST_AXES

    if axis is not None and axes is not None:
        raise apart("--axes", "--axis")
    if axes is not None:
        return list(range(1, whole_within("axes", axes, 1, MOST_AXES) + 1))
    return [1 if axis is None else whole_within("axis", axis, 1, MOST_AXES)]


def stream_of(as_json: bool) -> TextIO:
    """Return where events go: stdout, or stderr where stdout is for the JSON document."""
    return sys.stderr if as_json else sys.stdout


def event_printer(as_json: bool) -> Callable[[Event], None]:
    """Return what writes events as lines."""
    stream = stream_of(as_json)

    def tell(event: Event) -> None:
        stream.write(f"{event}\n")
        stream.flush()

    return tell


@contextmanager
def screen(events: Events, stream: TextIO, *, draws: bool, prompt: bool = False) -> Iterator[Screen | None]:
    """Draw a view where there is a terminal for it; what happens is then told in it, and no longer line by line.

    With a prompt, events pass above it; else the picture shows the last of them.
    """
    from rtec.live.screen import Screen, can_show, can_type

    has_prompt = prompt and can_type()
    if not (draws or has_prompt) or not can_show(stream):
        yield None
        return
    view = Screen(stream, draws=draws, has_prompt=has_prompt)
    lines = events.tell

    def tell(event: Event) -> None:
        if view.gone:
            lines(event)
        elif has_prompt:
            view.say(str(event))

    events.tell = tell
    try:
        yield view
    finally:
        view.close()
        events.tell = lines
