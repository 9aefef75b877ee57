"""Slow, plain models of the signal room: states looked up, VCD read word by word.

Nothing here imports rtec.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

FORWARD = ("00", "10", "11", "01")
"""Levels "A B" of the states 1..4 (Yee 1992, design A, state table)."""

ILLEGAL = "illegal"


def decode_step(before: str, after: str) -> int | str:
    """Return the count of one transition between levels written "A B"."""
    if before == after:
        return 0
    if before[0] != after[0] and before[1] != after[1]:
        return ILLEGAL
    return 1 if FORWARD[(FORWARD.index(before) + 1) % 4] == after else -1


def running_counts(levels: Sequence[str]) -> list[int]:
    """Return the count after each of a sequence of levels, 0 at the first; an illegal transition is an error."""
    counts = [0]
    for before, after in pairwise(levels):
        step = decode_step(before, after)
        if step == ILLEGAL:
            raise AssertionError(f"illegal transition {before} -> {after} in {levels}")
        counts.append(counts[-1] + int(step))
    return counts


def text(code: int) -> str:
    """Return a level code A + 2 B as "A B"."""
    return f"{code % 2}{code // 2}"


def pulsed(levels: str, first: tuple[str, str], second: tuple[str, str]) -> list[str]:
    """Return the output of OR and AND gates on lines at rest, with two pulses that overlap by half, after each step.

    A pulse is (line, polarity), as in ("A", "high").
    """
    output = []
    for step in (1, 2, 3, 4):
        line = {"A": levels[0], "B": levels[1]}
        for (name, polarity), start in ((first, 1), (second, 2)):
            if start <= step < start + 2:
                line[name] = {"high": "1", "low": "0"}[polarity]
        output.append(line["A"] + line["B"])
    return output


def inverted(levels: str, lines: Iterable[str]) -> list[str]:
    """Return the levels after each of a series of inversions of "A" or "B"."""
    output = []
    for name in lines:
        a, b = levels
        flip = {"0": "1", "1": "0"}
        levels = flip[a] + b if name == "A" else a + flip[b]
        output.append(levels)
    return output


def joined(a: tuple[Sequence[int], int], b: tuple[Sequence[int], int]) -> tuple[list[int], list[int], int]:
    """Return times, level codes A + 2 B and initial code of two lines, given by their toggles and initial levels."""
    times = sorted({*a[0], *b[0]})

    def level_at(line: tuple[Sequence[int], int], now: int) -> int:
        return (line[1] + sum(1 for t in line[0] if t <= now)) % 2

    return times, [level_at(a, t) + 2 * level_at(b, t) for t in times], a[1] + 2 * b[1]


@dataclass
class Waves:
    """What a VCD file says: timescale, and for each full name its width, initial value and changes."""

    timescale: str = ""
    widths: dict[str, int] = field(default_factory=dict)
    initial: dict[str, int] = field(default_factory=dict)
    changes: dict[str, list[tuple[int, int]]] = field(default_factory=dict)
    start: int = -1
    end: int = -1
    times: list[int] = field(default_factory=list)
    scopes: list[str] = field(default_factory=list)
    names: dict[str, tuple[str, int]] = field(default_factory=dict)
    """By code: the full name of a signal, and the bit of it that the code stands for."""
    also: dict[str, str] = field(default_factory=dict)
    """By second name: the first one."""

    def declare(self, keyword: str, body: list[str]) -> None:
        """Take one declaration of the header."""
        if keyword == "$timescale":
            self.timescale = " ".join(body)
        elif keyword == "$scope":
            self.scopes.append(body[1])
        elif keyword == "$upscope":
            self.scopes.pop()
        elif keyword == "$var":
            kind, width, code, word = body
            assert width == "1", "a signal of several bits"
            name, _, index = ".".join([*self.scopes, word]).partition("[")
            if kind == "integer":
                self.also[name] = self.names[code][0]
                return
            assert code not in self.names, "an identifier twice"
            bit = int(index.removesuffix("]") or 0)
            self.names[code] = (name, bit)
            self.widths[name] = max(self.widths.get(name, 0), bit + 1)
            self.changes[name] = []

    def change(self, code: str, value: int) -> None:
        """Take a change of a bit; bits of a signal that change at one time are one change of it."""
        name, bit = self.names[code]
        changes = self.changes[name]
        before = changes[-1][1] if changes else self.initial[name]
        after = before & ~(1 << bit) | value << bit
        if changes and self.widths[name] > 1 and changes[-1][0] == self.times[-1]:
            changes.pop()
        changes.append((self.times[-1], after))


DECLARATIONS = ("$comment", "$date", "$version", "$timescale", "$scope", "$upscope", "$var", "$enddefinitions")


def read_vcd(data: bytes) -> Waves:
    """Read the part of VCD that logic signals need, word by word (IEEE 1364-2005, 18.2)."""
    words = iter(data.decode("ascii").split())
    waves, dumping = Waves(), False
    for word in words:
        if word in DECLARATIONS:
            body = []
            while (part := next(words)) != "$end":
                body.append(part)
            waves.declare(word, body)
        elif word == "$dumpvars":
            dumping = True
        elif word == "$end":
            assert dumping, "$end without a beginning"
            dumping = False
        elif word.startswith("#"):
            waves.times.append(int(word[1:]))
        elif dumping:
            name, bit = waves.names[word[1:]]
            waves.initial[name] = waves.initial.get(name, 0) | int(word[0], 2) << bit
        else:
            waves.change(word[1:], int(word[0], 2))
    waves.start, waves.end = waves.times[0], waves.times[-1]
    return waves
