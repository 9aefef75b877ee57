"""What an operator types at the box: moves, switches, faults."""

from __future__ import annotations

import enum
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rtec.checks import number_within
from rtec.errors import ArgumentError, unknown
from rtec.machine.faults import FaultKind, FaultPlace
from rtec.machine.station import Station
from rtec.units import LENGTH, SPEED, TIME, parse_quantity

LONGEST_WAIT_S = 1e6
FEED_MM_S = 10.0
"""Of a move without a feed: 600 mm/min."""

FAULTS = {kind.name.lower().replace("_", "-"): kind for kind in FaultKind if kind.place is FaultPlace.AXIS}
"""Faults of an axis by the words that are typed."""


class Word(enum.Enum):
    """First word of an order."""

    GO = "go"
    HOME = "home"
    SWITCH = "switch"
    POWER = "power"
    RESTART = "restart"
    TRIP = "trip"
    FAULT = "fault"
    CLEAR = "clear"
    WAIT = "wait"
    STATUS = "status"
    HELP = "help"
    QUIT = "quit"


HELP = (
    "go 12 mm at 300 mm/min | home | switch off|on | power off|on | restart | trip | wait 2 s | status | quit",
    f"fault NAME [while inserting] | clear [NAME]: {', '.join(FAULTS)}",
    "with several axes, an order is for all of them, or begins with 'axis 2'",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """One order."""

    word: Word
    """What to do."""
    axis: int | None = None
    """At which axis; None: at all."""
    act: Callable[[Station], None] = lambda station: None
    """Does it at a station; nothing where the order is none for an axis."""
    wait_s: float = 0.0
    """How long `wait` waits."""


_AXIS = re.compile(r"axis\s+(\d{1,2})\s*:?\s*(.*)", re.IGNORECASE | re.DOTALL)
_WHILE = re.compile(r"\s+while[\s-]inserting$", re.IGNORECASE)


def parse_order(text: str) -> Order:
    """Read an order.

    Raises
    ------
    ArgumentError
        An unknown word, or a quantity without its unit.

    Examples
    --------
    >>> order = parse_order("axis 2 wait 3 s")
    >>> order.word.name, order.axis, order.wait_s
    ('WAIT', 2, 3.0)
    >>> from rtec.machine.station import StationSettings
    >>> station = Station(StationSettings())
    >>> parse_order("power off").act(station)
    >>> station.view.powered
    False
    """
    text = " ".join(text.split())
    axis = None
    if (match := _AXIS.fullmatch(text)) is not None:
        axis, text = int(match[1]), match[2]
    first, _, rest = text.partition(" ")
    words = {word.value: word for word in Word}
    word = words.get(first.lower())
    if word is None:
        raise unknown("order", text, words, noun="order")
    if word is Word.WAIT:
        wait_s = number_within("wait", parse_quantity(rest, TIME, name="wait"), 0.0, LONGEST_WAIT_S, unit="s")
        return Order(word=word, axis=axis, wait_s=wait_s)
    return Order(word=word, axis=axis, act=_act(word, rest))


def _act(word: Word, rest: str) -> Callable[[Station], None]:
    """Return what an order does at a station, by what stands behind its word."""
    if word is Word.GO:
        where, _, feed = rest.partition(" at ")
        speed_mm_s = parse_quantity(feed, SPEED, name="go ... at") if feed else FEED_MM_S
        target_mm = parse_quantity(where, LENGTH, name="go")
        return lambda station: station.go(target_mm, speed_mm_s)
    if word in (Word.SWITCH, Word.POWER):
        if rest.lower() not in ("on", "off"):
            raise ArgumentError(word.value, repr(rest[:40]), "on or off")
        on = rest.lower() == "on"
        return lambda station: station.switch(on) if word is Word.SWITCH else station.power(on)
    if word is Word.FAULT or (word is Word.CLEAR and rest):
        name = _WHILE.sub("", rest).lower()
        if name not in FAULTS:
            raise unknown(word.value, name, FAULTS, noun="fault")
        kind, waits = FAULTS[name], bool(_WHILE.search(rest))
        if word is Word.CLEAR:
            return lambda station: station.end(kind)
        return lambda station: station.begin(kind, while_inserting=waits)
    if rest:
        raise ArgumentError(word.value, repr(rest[:40]), "the word alone", problem="means nothing here")
    return _ALONE.get(word, lambda station: None)


def _clear(station: Station) -> None:
    """End the faults of encoder and position word; one of the cable's clears whatever is wrong with it."""
    for kind in (
        FaultKind.STALE_DATA_VALID, FaultKind.TORN_POSITION, FaultKind.CABLE_OPEN, FaultKind.GLITCHES,
    ):  # fmt: skip
        station.end(kind)


_ALONE: dict[Word, Callable[[Station], None]] = {
    Word.HOME: lambda station: station.go_home(),
    Word.RESTART: lambda station: station.restart(),
    Word.TRIP: lambda station: station.trip(),
    Word.CLEAR: _clear,
}
"""What the word alone does."""


def carry_out(order: Order, stations: Sequence[Station]) -> None:
    """Carry out an order at the axis that it names, or at all.

    Raises
    ------
    ArgumentError
        No such axis here, or a move outside its range.
    """
    meant = [s for s in stations if order.axis is None or s.settings.axis == order.axis]
    if not meant:
        here = ", ".join(str(s.settings.axis) for s in stations)
        raise ArgumentError("axis", order.axis or "", f"an axis of this process: {here}")
    for station in meant:
        view = station.view
        if order.word is Word.GO and view.held and not view.homing:
            raise ArgumentError(
                "go",
                f"axis {station.settings.axis}",
                "order 'home' first",
                problem="cannot move: the machine is held",
            )
    for station in meant:
        order.act(station)
