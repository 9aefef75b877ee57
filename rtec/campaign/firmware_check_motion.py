"""An axis at constant speed, cut into pieces as they are needed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rtec.signal import EdgeStream, states_of_levels
from rtec.units import PS_PER_S


class Moving(Protocol):
    """Something that moves the axis."""

    def edges(self, from_ps: int, to_ps: int) -> EdgeStream:
        """Return the edges from one time to before another."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """Constant speed from a first edge on."""

    first_ps: int
    frequency_hz: float
    direction: int
    level: int
    """Before the first edge."""

    def edges(self, from_ps: int, to_ps: int) -> EdgeStream:
        """Return the edges from one time to before another."""
        period_ps = PS_PER_S / (4.0 * self.frequency_hz)
        begin, end = (max(0, int((t - self.first_ps) / period_ps) - 1) for t in (from_ps, to_ps))
        k = np.arange(begin, end + 4, dtype=np.int64)
        times = self.first_ps + np.rint(k * period_ps).astype(np.int64)
        gone = begin + int(np.count_nonzero(times < from_ps))
        inside = (times >= from_ps) & (times < to_ps)
        home = int(states_of_levels(np.array([self.level]))[0])
        states = (home + self.direction * (k + 1)) & 3
        return EdgeStream.from_states(times[inside], states[inside], (home + self.direction * gone) & 3)


@dataclass(frozen=True, slots=True)
class Given:
    """An axis whose edges are known beforehand."""

    stream: EdgeStream

    def edges(self, from_ps: int, to_ps: int) -> EdgeStream:
        """Return the edges from one time to before another."""
        begin, end = np.searchsorted(self.stream.times_ps, (from_ps, to_ps)).tolist()
        before = int(self.stream.levels[begin - 1]) if begin else self.stream.initial
        return EdgeStream(self.stream.times_ps[begin:end], self.stream.levels[begin:end], before)
