"""A slow, plain model of an encoder: every line followed through the motion by dense sampling and bisection.

Nothing here imports rtec. Positions are in counts. Track A is high over half of each cycle of four counts, from
half a count behind the middle of state 1 on; track B comes one count later.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction


@dataclass(frozen=True)
class Segment:
    """Motion of constant jerk: start and length in ps, then counts, counts/s, counts/s^2, counts/s^3."""

    start_ps: int
    duration_ps: int
    x: float
    v: float
    a: float
    j: float

    def at(self, s: float) -> float:
        return self.x + self.v * s + self.a * s**2 / 2 + self.j * s**3 / 6

    def speed(self, s: float) -> float:
        return self.v + self.a * s + self.j * s**2 / 2


@dataclass(frozen=True)
class Disc:
    """Lines and their errors: lag of B and lengthening of the high parts in degrees and shares of a cycle."""

    lag_deg: float = 0.0
    longer_a: float = 0.0
    longer_b: float = 0.0
    eccentric: float = 0.0
    eccentric_deg: float = 0.0
    counts_per_rev: int = 0
    home: int = 0  # 0..3: how far into the cycle count 0 lies

    def lines(self, low: float, high: float) -> list[tuple[float, str, int]]:
        """Return the lines between two positions: (position, track, 1 where it rises going forward)."""
        found = []
        lag = self.lag_deg / 360 * 4
        for cycle in range(math.floor(low / 4) - 3, math.ceil(high / 4) + 4):
            nominal = 4 * cycle - self.home
            for track, at, shift, rises in (
                ("A", nominal + 0.5, -4 * self.longer_a / 2, 1),
                ("A", nominal + 2.5, 4 * self.longer_a / 2, 0),
                ("B", nominal + 1.5, lag - 4 * self.longer_b / 2, 1),
                ("B", nominal + 3.5, lag + 4 * self.longer_b / 2, 0),
            ):
                position = at + shift
                if self.eccentric:
                    # the line's place on the disc is that of the count that begins with it
                    turn = 2 * math.pi * (at + 0.5) / self.counts_per_rev + math.radians(self.eccentric_deg)
                    position += self.eccentric * math.sin(turn)
                if low - 1e-9 <= position <= high + 1e-9:
                    found.append((position, track, rises))
        return sorted(found)


def levels_at(disc: Disc, x: float) -> dict[str, int]:
    """Return the levels of both tracks at rest at ``x``: what the nearest line below says."""
    levels = {}
    for position, track, rises in disc.lines(x - 40, x):
        if position <= x:
            levels[track] = rises
    return levels


def bisect(place: Callable[[float], float], goal: float, low: float, high: float) -> float:
    up = place(high) > place(low)
    for _ in range(200):
        middle = (low + high) / 2
        if middle in (low, high):
            break
        if (place(middle) > goal) == up:
            high = middle
        else:
            low = middle
    return high


def edges(
    disc: Disc, motion: Sequence[Segment], samples: int = 400
) -> tuple[tuple[int, int], list[tuple[float, str, int, float]]]:
    """Return the levels (A, B) at the start, and the edges: (time in ps, track, new level, speed there).

    Within a segment the motion is sampled densely; between neighbouring samples a line is crossed at most once unless
    the motion turns there, and the turn is sampled, too.
    """
    start = levels_at(disc, motion[0].x)
    found: list[tuple[float, str, int, float]] = []
    before = motion[0].x
    for segment in motion:
        end_s = segment.duration_ps / 1e12
        moments = {end_s * k / samples for k in range(samples + 1)}
        moments |= {s for s in turns(segment) if 0 < s < end_s}
        ordered = sorted(moments)
        places = [before, *(segment.at(s) for s in ordered)]
        times = [0.0, *ordered]
        for (s0, s1), (x0, x1) in zip(itertools.pairwise(times), itertools.pairwise(places), strict=True):
            for position, track, rises in disc.lines(min(x0, x1), max(x0, x1)):
                if (x0 < position) == (x1 < position):
                    continue
                up = x1 > x0
                s = bisect(segment.at, position, s0, s1) if s1 > s0 else s1
                time_ps = segment.start_ps + s * 1e12
                found.append((time_ps, track, rises if up else 1 - rises, segment.speed(s)))
        before = places[-1]
    return (start["A"], start["B"]), sorted(found)


def turns(segment: Segment) -> list[float]:
    """Return where the velocity is zero."""
    if segment.j == 0:
        return [-segment.v / segment.a] if segment.a else []
    inside = segment.a**2 - 2 * segment.j * segment.v
    if inside < 0:
        return []
    return [(-segment.a + sign * math.sqrt(inside)) / segment.j for sign in (1, -1)]


def steady_crossings(frequency_hz: float, numbers: Sequence[int]) -> list[Fraction]:
    """Return the exact times of crossings at constant speed, the first line half a count away; in ps."""
    quarter = Fraction(10**12) / (4 * Fraction(frequency_hz))
    return [quarter * n + quarter / 2 for n in numbers]
