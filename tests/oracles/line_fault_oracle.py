"""A slow, plain model of faults of an encoder's lines: levels of A and B at every single picosecond.

Nothing here imports rtec. A signal is a list of pairs (A, B), one for each picosecond from 0 on. Each function takes
a signal and returns the one behind the fault; ``begin`` and ``over`` are the first picoseconds with and without it.
"""

from __future__ import annotations

import itertools

Signal = list[tuple[int, int]]
A, B = 0, 1


def signal_of(edges: list[tuple[int, int, int]], first: tuple[int, int], length: int) -> Signal:
    """Return the signal of edges (time, A, B)."""
    levels, signal = first, []
    todo = sorted(edges)
    for t in range(length):
        while todo and todo[0][0] == t:
            levels = todo.pop(0)[1:]
        signal.append(levels)
    return signal


def edges_of(signal: Signal, line: int | None = None) -> list[int]:
    """Return when the signal changes, or one of its lines does."""
    seen = signal if line is None else [levels[line] for levels in signal]
    return [t for t in range(1, len(seen)) if seen[t] != seen[t - 1]]


def _where(signal: Signal, begin: int, over: int, wrong) -> Signal:
    return [wrong(levels) if begin <= t < over else levels for t, levels in enumerate(signal)]


def stuck(signal: Signal, line: int, level: int, begin: int, over: int) -> Signal:
    """One line stays at a level."""
    return _where(signal, begin, over, lambda levels: (level, levels[B]) if line == A else (levels[A], level))


def cable_open(signal: Signal, begin: int, over: int) -> Signal:
    """Both lines are pulled up."""
    return _where(signal, begin, over, lambda levels: (1, 1))


def exchanged(signal: Signal, begin: int, over: int) -> Signal:
    """A is where B should be, and B where A should be."""
    return _where(signal, begin, over, lambda levels: (levels[B], levels[A]))


def line_broken(signal: Signal, begin: int, over: int) -> Signal:
    """A keeps the level that it had just before."""
    kept = signal[begin - 1][A]
    return _where(signal, begin, over, lambda levels: (kept, levels[B]))


def pulses(signal: Signal, inverted: list[tuple[int, int, int]]) -> Signal:
    """Invert lines for a while: (line, begin, over) each; twice inverted is right again."""
    wrong = [list(levels) for levels in signal]
    for line, begin, over in inverted:
        for t in range(begin, min(over, len(signal))):
            wrong[t][line] = 1 - wrong[t][line]
    return [(a, b) for a, b in wrong]


def missed_edge(signal: Signal, begin: int) -> Signal:
    """The line that changes first keeps its level until it changes next."""
    t = next((t for t in edges_of(signal) if t >= begin), len(signal))
    if t == len(signal):
        return list(signal)
    line = A if signal[t][A] != signal[t - 1][A] else B
    back = next((later for later in edges_of(signal, line) if later > t), len(signal))
    return stuck(signal, line, signal[t - 1][line], t, back)


def late_edges(signal: Signal, line: int, share: float, begin: int, over: int, *, falls_only: bool) -> Signal:
    """Edges of a line come late by a share of the shorter of the two intervals beside them."""
    every = edges_of(signal)
    late = [(0, signal[0][line])]
    for t in edges_of(signal, line):
        k = every.index(t)
        beside = [every[k] - every[k - 1]] if k > 0 else []
        beside += [every[k + 1] - every[k]] if k + 1 < len(every) else []
        moved = begin <= t < over and beside and not (falls_only and signal[t][line] == 1)
        late.append((t + int(min(beside) * share) if moved else t, signal[t][line]))
    wrong = []
    for t, levels in enumerate(signal):
        level = [value for when, value in late if when <= t][-1]
        wrong.append((level, levels[B]) if line == A else (levels[A], level))
    return wrong


def counted(signal: Signal) -> int:
    """Return what an ideal decoder counts: forward is A before B; a change of both lines counts nothing."""
    ring = [(0, 0), (1, 0), (1, 1), (0, 1)]
    count = 0
    for before, after in itertools.pairwise(signal):
        step = (ring.index(after) - ring.index(before)) % 4
        count += {0: 0, 1: 1, 2: 0, 3: -1}[step]
    return count
