"""What an operator types at the box: moves, switches, faults."""

from __future__ import annotations

import enum
import re
from collections.abc import Sequence
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
    """One order; what its word does not need is left at its default.

    Parameters
    ----------
    word
        What to do.
    axis
        At which axis; None: at all.
    target_mm, speed_mm_s
        Of a move.
    on
        Of the switch or the power.
    fault
        Which fault; None with `clear`: all.
    while_inserting
        Whether the fault waits for an insertion to be under way.
    wait_s
        How long.
    """

    word: Word
    axis: int | None = None
    target_mm: float = 0.0
    speed_mm_s: float = FEED_MM_S
    on: bool = True
    fault: FaultKind | None = None
    while_inserting: bool = False
    wait_s: float = 0.0


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
    >>> order = parse_order("axis 2 go 12 mm at 300 mm/min")
    >>> order.word.name, order.axis, order.target_mm, order.speed_mm_s
    ('GO', 2, 12.0, 5.0)
    >>> parse_order("fault cable-open while inserting").fault.name
    'CABLE_OPEN'
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
    return _with_rest(word, axis, rest)


def _with_rest(word: Word, axis: int | None, rest: str) -> Order:
    if word is Word.GO:
        where, _, feed = rest.partition(" at ")
        speed = parse_quantity(feed, SPEED, name="go ... at") if feed else FEED_MM_S
        return Order(word=word, axis=axis, target_mm=parse_quantity(where, LENGTH, name="go"), speed_mm_s=speed)
    if word in (Word.SWITCH, Word.POWER):
        if rest.lower() not in ("on", "off"):
            raise ArgumentError(word.value, repr(rest[:40]), "on or off")
        return Order(word=word, axis=axis, on=rest.lower() == "on")
    if word is Word.WAIT:
        wait_s = number_within("wait", parse_quantity(rest, TIME, name="wait"), 0.0, LONGEST_WAIT_S, unit="s")
        return Order(word=word, axis=axis, wait_s=wait_s)
    if word is Word.FAULT or (word is Word.CLEAR and rest):
        name = _WHILE.sub("", rest).lower()
        if name not in FAULTS:
            raise unknown(word.value, name, FAULTS, noun="fault")
        return Order(word=word, axis=axis, fault=FAULTS[name], while_inserting=bool(_WHILE.search(rest)))
    if rest:
        raise ArgumentError(word.value, repr(rest[:40]), "the word alone", problem="means nothing here")
    return Order(word=word, axis=axis)


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
        _carry_out_at(order, station)


def _carry_out_at(order: Order, station: Station) -> None:
    if order.word is Word.GO:
        station.go(order.target_mm, order.speed_mm_s)
    elif order.word is Word.HOME:
        station.go_home()
    elif order.word is Word.SWITCH:
        station.switch(order.on)
    elif order.word is Word.POWER:
        station.power(order.on)
    elif order.word is Word.RESTART:
        station.restart()
    elif order.word is Word.TRIP:
        station.trip()
    elif order.word is Word.FAULT and order.fault is not None:
        station.begin(order.fault, while_inserting=order.while_inserting)
    elif order.word is Word.CLEAR:
        for fault in [order.fault] if order.fault is not None else _LASTING:
            station.end(fault)


_LASTING = (
    FaultKind.STALE_DATA_VALID,
    FaultKind.TORN_POSITION,
    FaultKind.CABLE_OPEN,
    FaultKind.GLITCHES,
)
"""Faults of encoder and position word; ending one of them clears whatever is wrong with the cable."""
