"""A slow, plain model of the controller's input: it samples both lines at every tick of its clock.

Nothing here imports rtec. Levels are pairs "A B". Ticks fall at k / clock_hz, exactly.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from math import ceil

FORWARD = ("00", "10", "11", "01")
PS_PER_S = 10**12


def turn(before: str, after: str) -> int:
    """Return 0, 1, -1, or 2 where both lines change."""
    steps = (FORWARD.index(after) - FORWARD.index(before)) % 4
    return -1 if steps == 3 else steps


@dataclass
class ReceiverOracle:
    """Filter, decoder and counter; :meth:`run` goes through raw edges and moments at which the count is read."""

    samples: int
    clock_hz: int
    multiplication: int
    policy: str
    levels: str
    count: int = 0
    last_turn: int = 0
    filtered: int = 0
    fault_ps: int | None = None
    illegal: list[tuple[int, str]] = field(default_factory=list)
    readings: list[int] = field(default_factory=list)

    def run(self, edges: list[tuple[int, str]], moments: list[int]) -> None:
        """Take raw edges (time in ps, levels); note the count at each moment."""
        self.raw = self.accepted = self.levels
        self.at_tick = list(self.levels)  # what the last tick saw of each line
        self.in_a_row = [self.samples, self.samples]
        self.left_ps: list[int | None] = [None, None]  # when the line left what the last tick saw
        self.began_ps: list[int | None] = [None, None]  # and when it began to be what the ticks see now
        events = sorted([(t, 0, levels) for t, levels in edges] + [(t, 1, "") for t in moments])
        tick = None
        for number, (t, kind, levels) in enumerate(events):
            if self.samples and tick is not None:
                # the ticks since the last event; later than so many, nothing is left to settle
                upto = self.last_tick(t, inclusive=kind == 1)
                for k in range(tick, min(upto, tick + self.samples + 2) + 1):
                    self.sample(k)
            if kind == 0:
                self.change(t, levels)
            else:
                self.readings.append(self.count)
            tick = self.last_tick(t, inclusive=kind == 1) + 1 if number or self.samples else None

    def last_tick(self, t: int, *, inclusive: bool) -> int:
        """Return the last tick before ``t``, or before the picosecond that begins with it is over."""
        return ceil(Fraction((t + inclusive) * self.clock_hz, PS_PER_S)) - 1

    def change(self, t: int, levels: str) -> None:
        lines = [line for line in (0, 1) if levels[line] != self.raw[line]]
        if any(self.raw[line] != self.accepted[line] for line in lines):
            self.filtered += 1
        self.raw = levels
        for line in lines:
            if self.left_ps[line] is None:
                self.left_ps[line] = t
        if self.samples == 0:
            self.take(t, levels, same_instant=True)

    def sample(self, k: int) -> None:
        """Look at both lines at tick ``k``."""
        new = list(self.accepted)
        for line in (0, 1):
            if self.raw[line] == self.at_tick[line]:
                self.in_a_row[line] += 1
            else:
                self.at_tick[line], self.in_a_row[line] = self.raw[line], 1
                self.began_ps[line] = self.left_ps[line]
            self.left_ps[line] = None
            if self.in_a_row[line] >= self.samples:
                new[line] = self.at_tick[line]
        if "".join(new) != self.accepted:
            time_ps = ceil(Fraction(k * PS_PER_S, self.clock_hz))
            self.take(time_ps, "".join(new), same_instant=self.began_ps[0] == self.began_ps[1])

    def take(self, t: int, levels: str, *, same_instant: bool) -> None:
        """Take filtered levels over and count."""
        step = turn(self.accepted, levels)
        if step == 2:
            self.illegal.append((t, "simultaneous" if same_instant else "unresolved"))
            if self.policy == "fault" and self.fault_ps is None:
                self.fault_ps = t
            if self.policy == "guess" and self.last_turn:
                middle = FORWARD[(FORWARD.index(self.accepted) + self.last_turn) % 4]
                self.count_step(self.accepted, middle)
                self.count_step(middle, levels)
        else:
            self.last_turn = step
            self.count_step(self.accepted, levels)
        self.accepted = levels

    def count_step(self, before: str, after: str) -> None:
        moves_a = before[0] != after[0]
        counts = {4: True, 2: moves_a, 1: moves_a and after[1] == "0"}[self.multiplication]
        self.count += turn(before, after) if counts else 0
