"""Attacks of one insertion: short moves around a line, and which crossing is to fall into the insertion.

Lengths are in counts. Line k lies at k - 1/2; every attack begins and ends at rest in the middle of a count.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rtec.checks import whole_within
from rtec.units import PS_PER_S

GOLDEN = 0.618_033_988_749_895
"""Multiples of it, modulo 1, fill an interval evenly however many there are."""
TURN_PS = 100_000
"""After a turn the line that has changed does not change back sooner."""
LEAST_TRAVEL = 8
"""Counts that an attack may need."""

_MARGIN = 0.2
"""Of an insertion's length: so far before and behind it crossings are aimed, too."""
_DEPTHS = (0.0005, 0.02, 0.3, 0.9)
"""How far behind its last line the axis turns, counts."""
_MOST_DEPTH = 0.9


def depth_of(apart_ps: float, acceleration: float) -> float:
    """Return how far behind a line the axis turns to cross it again after this time, or the shortest there is."""
    apart_s = max(apart_ps, 1.001 * TURN_PS) / PS_PER_S  # times are rounded to picoseconds
    return min(acceleration * apart_s**2 / 8.0, _MOST_DEPTH)


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """An insertion at rest, as a box makes it.

    Parameters
    ----------
    begin_ps, end_ps
        Its first and its last change, after the request.
    pause_ps
        Rest that it needs before the request so as to insert at once, and after it to be ready again.
    every_ps
        Requests that are multiples of this apart are answered alike: a polling loop, a program's readings.
    """

    begin_ps: int
    end_ps: int
    pause_ps: int
    every_ps: int = 1

    def __post_init__(self) -> None:
        whole_within("begin_ps", self.begin_ps, 0, 1000 * PS_PER_S)
        whole_within("end_ps", self.end_ps, self.begin_ps, 1000 * PS_PER_S)
        whole_within("pause_ps", self.pause_ps, 0, 1000 * PS_PER_S)
        whole_within("every_ps", self.every_ps, 1, PS_PER_S)


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where and how an attack is made."""

    window: Window
    """The insertion at rest that crossings are aimed into."""
    speed: float
    acceleration: float
    """The highest, counts/s and counts/s^2."""
    travel: int
    """Counts that an attack may travel, there and back."""
    sign: int
    """Direction of the motion as a whole."""
    seed: int
    """Of an adversary."""

    def lead_ps(self, phase: float) -> int:
        """Return how long after the request a phase 0..1 of an insertion lies, with a margin at both ends."""
        begin_ps = self.window.begin_ps
        length = self.window.end_ps - begin_ps
        return round(begin_ps + ((1.0 + 2.0 * _MARGIN) * phase - _MARGIN) * length)

    def depth(self, apart_ps: float) -> float:
        """Return how far behind a line the axis turns to cross it again after this time."""
        return depth_of(apart_ps, self.acceleration)


@dataclass(frozen=True, slots=True, kw_only=True)
class Attack:
    """Moves from a rest, and the crossing that is aimed."""

    targets: tuple[float, ...]
    """Ends of the moves, counts from where the attack begins; the last is a whole number."""
    speeds: tuple[float, ...]
    """Of each move, counts/s."""
    aimed: int
    into: float
    """Which move crosses the aimed line, and how far from its start."""
    lead_ps: int
    """How long after the request it does."""


Make = Callable[[int, Place], Attack]
"""Returns attack number i, which depends on nothing but its number and the place."""


def reversal(i: int, place: Place) -> Attack:
    """Return a turn: every second one so close behind a line that it comes again within the insertion behind it.

    The others sweep the phase with one of three lines before the turn, or behind it.
    """
    way = place.sign if i % 2 == 0 else -place.sign
    turn, after_it = divmod(i // 4, 6)
    phase = (0.5 + (i // 4) * GOLDEN) % 1.0
    leg = max((place.travel - 1) // 2, 1)
    home = place.sign if i % 4 == 3 else 0
    if i // 2 % 2 == 0:
        return _turn(place, way, leg, home, depth=place.depth((1.0 + _MARGIN) * phase * place.window.end_ps))
    line = min(after_it % 3, leg - 1)
    behind = after_it >= 3 and not (way == home and line == leg - 1)
    depth = _DEPTHS[turn % len(_DEPTHS)]
    out = leg - 0.5 + depth
    return Attack(
        targets=(way * out, float(home)),
        speeds=(place.speed, place.speed),
        aimed=int(behind),
        into=depth + line if behind else out - depth - line,
        lead_ps=place.lead_ps(phase),
    )


def _turn(place: Place, way: int, leg: int, home: int, *, depth: float) -> Attack:
    """Return a turn behind a line, with a request shortly before the axis crosses it."""
    out = leg - 0.5 + depth
    # a quarter of what the last count before the turn takes
    lead_s = math.sqrt(2.0 / place.acceleration) / 4.0
    return Attack(
        targets=(way * out, float(home)),
        speeds=(place.speed, place.speed),
        aimed=0,
        into=leg - 0.5,
        lead_ps=round(lead_s * PS_PER_S),
    )


def adversary(i: int, place: Place) -> Attack:
    """Return an attack drawn at random: a creeping edge, over an edge and back once or more, a turn, a start."""
    rng = np.random.default_rng((place.seed, i))
    way = 1 if rng.random() < 0.5 else -1
    lead_ps = place.lead_ps(rng.random())
    most_ps = max(16.0 * TURN_PS, 2.0 * (place.window.end_ps - place.window.begin_ps))
    apart_ps = math.exp(rng.uniform(math.log(TURN_PS), math.log(most_ps)))
    slow = place.speed * math.exp(rng.uniform(math.log(1e-4), 0.0))
    kind = int(rng.integers(4))
    if kind == 0:  # one edge, or a few, from rest
        leg = int(rng.integers(1, min(place.travel, 4) + 1))
        return Attack(targets=(float(way * leg),), speeds=(slow,), aimed=0, into=0.5, lead_ps=lead_ps)
    if kind == 1:  # at speed past the request
        leg = place.travel
        line = int(rng.integers(leg // 2, leg))
        return Attack(targets=(float(way * leg),), speeds=(slow,), aimed=0, into=0.5 + line, lead_ps=lead_ps)
    if kind == 2:  # a turn in motion
        leg = int(rng.integers(1, max((place.travel - 1) // 2, 1) + 1))
        home = int(rng.integers(-1, 2)) if leg > 1 else 0
        return _turn(place, way, leg, home, depth=place.depth(apart_ps))
    depth = place.depth(apart_ps)
    times = 2 * int(rng.integers(1, 4)) - 1  # so often the line is crossed again
    swings = [way * (0.5 + (depth if k % 2 == 0 else -depth)) for k in range(times)]
    targets = (*swings, 0.0 if rng.random() < 0.5 else float(way))
    if times > 1 and rng.random() < 0.5:
        return Attack(targets=targets, speeds=(slow,) * len(targets), aimed=1, into=depth, lead_ps=lead_ps)
    return Attack(targets=targets, speeds=(slow,) * len(targets), aimed=0, into=0.5, lead_ps=lead_ps)
