"""A slow, plain model of the box between encoder and controller: it lives through every picosecond.

Nothing here imports rtec. Levels are pairs "A B" as in the report's state table; the states 1..4 are its positions.
An instant goes through in this order: what is asked or switched from outside, the box's own changes that are due,
the encoder's edge, a look of the processor.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

FORWARD = ("00", "10", "11", "01")
CHANGES = {"original": 4, "a": 4, "b": 1, "c": 2}


def turned(levels: str, states: int) -> str:
    """Return the levels so many states further on."""
    return FORWARD[(FORWARD.index(levels) + states) % 4]


def flipped(levels: str, line: str) -> str:
    """Return the levels with one line inverted."""
    swap = {"0": "1", "1": "0"}
    return swap[levels[0]] + levels[1] if line == "A" else levels[0] + swap[levels[1]]


def decoded(levels: Sequence[str]) -> tuple[int, int]:
    """Return (net count, changes of both lines at once) of a sequence of levels."""
    net = illegal = 0
    for before, after in pairwise(levels):
        turn = (FORWARD.index(after) - FORWARD.index(before)) % 4
        net += {0: 0, 1: 1, 2: 0, 3: -1}[turn]
        illegal += turn == 2
    return net, illegal


@dataclass
class BoxOracle:
    """The processor, its gates, and what one would write down standing beside them."""

    design: str
    poll: int
    offset: int
    decide: int
    step: int
    recover: int
    latency: int
    rest: int
    gate: int  # 0: none
    hold: bool = False
    release_inverters: bool = False
    lines: str = "00"

    # the processor
    doing: str = "watching"  # watching, thinking, inserting, releasing, copying
    noticed: int | None = None  # the edge right after which an insertion is to begin
    since: int | None = None  # the last look that led to something
    due: int | None = None  # the box's next own change
    seen: str = "00"  # what it recognised, or Design B's copy of the lines
    written: str = "00"  # Design B: the copy that it has put out
    must_copy: bool = False  # Design B: an edge has woken it
    caught: bool = False  # the hold latch has kept an edge back
    sign: int = 0
    made: int = 0
    behind: int | None = None  # what the insertion follows
    ready: int | None = None
    edges: list[int] = field(default_factory=list)  # what the speed gate has timed
    last_edge: int | None = None
    woken: int | None = None
    enabled: bool = True
    powered: bool = True
    requested: int = 0
    completed: int = 0
    # the gates
    high: set[str] = field(default_factory=set)
    low: set[str] = field(default_factory=set)
    inverted: set[str] = field(default_factory=set)
    latch: str | None = None
    ahead_states: int = 0
    # notes
    refused: int = 0
    inserted: int = 0
    longest: int = 0
    inside: int = 0

    def __post_init__(self) -> None:
        self.seen = self.written = self.lines

    # ---------------------------------------------------------------- gates

    def output(self) -> str:
        """Return the levels at the controller."""
        if self.design == "b":
            return turned(self.written, self.ahead_states) if self.powered else "00"
        levels = self.latch or self.lines
        for line in self.inverted:
            levels = flipped(levels, line)
        pair = dict(zip("AB", levels, strict=True))
        pair |= dict.fromkeys(self.high, "1") | dict.fromkeys(self.low, "0")
        return pair["A"] + pair["B"]

    # ------------------------------------------------------------ from outside

    def owes(self) -> bool:
        return self.requested != self.completed

    def may(self) -> bool:
        return self.owes() and self.enabled and self.powered

    def ask(self, total: int) -> None:
        self.requested = total
        if not self.owes():
            self.noticed = None

    def switch(self, on: bool) -> None:
        self.enabled = on
        if not on:
            self.noticed = None

    def power(self, t: int, on: bool) -> None:
        if on == self.powered:
            return
        self.powered = on
        self.doing, self.due, self.noticed = "watching", None, None
        self.must_copy = False
        self.high, self.low, self.latch = set(), set(), None
        if not on and self.release_inverters:
            self.inverted = set()
        if on:
            self.seen = self.written = self.lines
            self.ahead_states = self.requested = self.completed = 0
            self.ready = t + self.recover
            self.last_edge = t
            self.edges = [] if self.design == "original" else [t]
            self.woken = t

    # ---------------------------------------------------------------- time

    def instant(self, t: int, edge: str | None) -> None:
        """Live through one picosecond; ``edge`` holds the encoder's new levels, if they change."""
        self.fire(t)
        if edge is not None:
            self.lines = edge
            self.time_edge(t)
            self.take_edge(t)
        self.look(t)

    def fire(self, t: int) -> None:
        if self.must_copy and self.doing == "watching" and self.free_look(t):
            self.copy(t)
        if self.due != t:
            return
        if self.doing == "copying":
            self.written = self.seen
            self.doing, self.due, self.woken = "watching", None, t
            if not self.copy_again(t) and self.owes():
                self.consider(t)
                if self.noticed is not None:
                    # it is at the lines already
                    self.behind = self.last_edge
                    self.noticed = t
        elif self.doing == "releasing":
            self.doing, self.due, self.latch, self.woken = "watching", None, None, t
        elif self.doing == "thinking" and not self.owes():
            self.let_go(t)
            self.copy_again(t)
        else:
            if self.doing == "thinking":
                self.doing, self.made = "inserting", 0
                self.sign = 1 if self.requested > self.completed else -1
            self.change(t)

    def let_go(self, t: int) -> None:
        release = self.latch is not None and (self.doing == "inserting" or self.caught)
        self.doing, self.due = ("releasing", t + self.step) if release else ("watching", None)
        if not release:
            self.latch = None

    def change(self, t: int) -> None:
        """Make the next change of the insertion."""
        self.made += 1
        self.due = t + self.step
        if self.design == "b":
            self.ahead_states += self.sign
        elif self.design == "c":
            same = self.seen[0] == self.seen[1]
            first = "A" if same == (self.sign > 0) else "B"
            self.inverted ^= {first if self.made == 1 else {"A": "B", "B": "A"}[first]}
        else:
            # pulses that overlap by half: the first from change 1 to 3, the second from 2 to 4
            same = self.seen[0] == self.seen[1]
            first = "A" if same == (self.sign > 0) else "B"
            second = {"A": "B", "B": "A"}[first]
            line = first if self.made in (1, 3) else second
            pulses = self.high if self.seen["AB".index(line)] == "0" else self.low
            (pulses.add if self.made <= 2 else pulses.remove)(line)
        if self.made == CHANGES[self.design]:
            self.completed += self.sign
            self.inserted += 1
            self.longest = max(self.longest, t - self.behind)
            self.ready = t + self.recover
            self.let_go(t)
            self.copy_again(t)

    def copy_again(self, t: int) -> bool:
        """Design B: see whether the lines have moved while it was busy."""
        self.must_copy = self.design == "b" and self.lines != self.seen
        if self.must_copy and self.free_look(t):
            self.copy(t)
        return self.must_copy or self.doing == "copying"

    def time_edge(self, t: int) -> None:
        if self.design != "original" or self.lines == "00":
            self.edges.append(t)
        self.last_edge = t

    def interval(self) -> int | None:
        """Return what the speed gate has timed: a cycle (Original), else half a cycle; None while it is unknown."""
        back = 1 if self.design == "original" else 2
        return self.edges[-1] - self.edges[-1 - back] if len(self.edges) > back else None

    def take_edge(self, t: int) -> None:
        if self.design == "b":
            self.noticed = None
            self.must_copy = self.must_copy or (self.doing == "watching" and self.powered)
            return
        if self.doing in ("thinking", "inserting"):
            self.inside += 1
            self.caught = True
        self.noticed = None
        if self.doing == "watching":
            self.consider(t)

    def consider(self, t: int) -> None:
        """Decide at a transition whether an insertion is to follow it."""
        if not self.may() or (self.design == "original" and self.lines != "00"):
            return
        interval = self.interval()
        if self.gate and (interval is None or interval < self.gate):
            self.refused += 1
        elif self.ready is None or t >= self.ready:
            self.noticed = t
            self.behind = t

    def free_look(self, t: int) -> bool:
        at_lines = self.poll == 0 or (t - self.offset) % self.poll == 0
        return at_lines and (self.ready is None or t >= self.ready)

    def copy(self, t: int) -> None:
        self.seen = self.lines
        self.must_copy = False
        self.doing, self.due = "copying", t + self.latency

    def look(self, t: int) -> None:
        """Let a free processor look at the lines at the end of the instant."""
        if self.doing != "watching" or not self.powered:
            return
        if self.must_copy:
            if self.free_look(t):
                self.copy(t)
            return
        right_behind = self.design == "b" and self.noticed == t
        if not right_behind and not self.free_look(t):
            return
        if not self.may() or (self.design == "original" and self.lines != "00"):
            return
        rests = self.last_edge is None or t >= self.last_edge + self.rest
        if self.noticed is None and not rests:
            return
        if self.noticed is None:
            self.behind = self.rest_began(t)
        if self.design != "b":
            self.seen = self.lines
            if self.hold:
                self.latch = self.lines
        self.noticed, self.caught = None, False
        self.doing, self.due = "thinking", t + self.decide

    def rest_began(self, t: int) -> int:
        """Return when everything that an insertion at rest waits for was there, but for the look."""
        moments = [self.woken, self.ready]
        moments += [] if self.last_edge is None else [self.last_edge + self.rest]
        return max([m for m in moments if m is not None and m <= t], default=t)


@dataclass
class Lived:
    """What happened: output edges, and the box at the end."""

    edges: list[tuple[int, str]]
    ahead: int
    illegal: int
    box: BoxOracle


def live(
    box: BoxOracle,
    edges: Iterable[tuple[int, str]],
    orders: Iterable[tuple[int, str, int]],
    first: int,
    until: int,
) -> Lived:
    """Let the box live from ``first`` to before ``until`` with the encoder's edges and the orders from outside.

    Orders are (time, "ask" | "switch" | "power", value), in the order in which they come.
    """
    coming = dict(edges)
    todo = list(orders)
    out = box.output()
    made: list[tuple[int, str]] = []
    ahead = illegal = 0
    for t in range(first, until):
        while todo and todo[0][0] == t:
            _, what, value = todo.pop(0)
            could = box.may()
            if what == "ask":
                box.ask(value)
            elif what == "switch":
                box.switch(bool(value))
            else:
                box.power(t, bool(value))
            if box.may() and not could:
                box.woken = t
        lines_before = box.lines
        box.instant(t, coming.get(t))
        now = box.output()
        net_in, jumps_in = decoded([lines_before, box.lines])
        net_out, jumps_out = decoded([out, now])
        if jumps_out == 1 and jumps_in == 0:
            illegal += 1
        elif jumps_out == jumps_in == 0:
            ahead += net_out - net_in
        if now != out:
            made.append((t, now))
            out = now
    return Lived(made, ahead, illegal, box)
