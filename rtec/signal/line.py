"""One line in time: the moments at which a signal of two levels toggles."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rtec.errors import ArgumentError
from rtec.signal import _checks


@dataclass(frozen=True, slots=True, eq=False)
class LevelStream:
    """A signal of one bit: A, B, Z or a train of pulses.

    Parameters
    ----------
    times_ps
        Times at which the level toggles, strictly increasing, int64 ps, shape (n,). An int64 array is not copied; it
        must not be changed afterwards.
    initial
        Level before the first toggle, 0 or 1.

    Raises
    ------
    ArgumentError
        Times that are no whole numbers or do not increase (named with index and value), a level other than 0 and 1.

    Examples
    --------
    >>> pulse = LevelStream([2_000_000, 4_000_000], initial=0)
    >>> pulse.level_at(3_000_000), pulse.final
    (1, 0)
    """

    times_ps: NDArray[np.int64]
    initial: int

    def __init__(self, times_ps: ArrayLike, initial: int) -> None:
        object.__setattr__(self, "times_ps", _checks.times_ps("times_ps", times_ps))
        object.__setattr__(self, "initial", _checks.code("initial", initial, 1))

    def __len__(self) -> int:
        return int(self.times_ps.size)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, LevelStream):
            return NotImplemented
        return self.initial == other.initial and np.array_equal(self.times_ps, other.times_ps)

    __hash__ = None  # type: ignore[assignment]  # arrays are compared, not hashed

    @property
    def levels(self) -> NDArray[np.uint8]:
        """The level after each toggle, uint8, shape (n,)."""
        return ((np.arange(1, len(self) + 1) + self.initial) & 1).astype(np.uint8)

    @property
    def final(self) -> int:
        """The level after the last toggle."""
        return (self.initial + len(self)) & 1

    def level_at(self, t_ps: int) -> int:
        """Return the level at ``t_ps``; a toggle at that very time has happened."""
        return int(self.levels_at([_checks.time_ps("t_ps", t_ps)])[0])

    def levels_at(self, t_ps: ArrayLike) -> NDArray[np.uint8]:
        """Return the levels at the times ``t_ps``, in any order, as uint8 of shape (m,)."""
        moments = _checks.whole_numbers("t_ps", t_ps, "whole picoseconds")
        toggles = np.searchsorted(self.times_ps, moments, side="right")
        return ((toggles + self.initial) & 1).astype(np.uint8)

    def window(self, start_ps: int, stop_ps: int) -> LevelStream:
        """Return the part ``start_ps <= t < stop_ps``, starting at the level just before ``start_ps``.

        Raises
        ------
        ArgumentError
            ``stop_ps`` before ``start_ps``.

        Examples
        --------
        >>> LevelStream([10, 20, 30], initial=0).window(20, 30)
        LevelStream(times_ps=array([20]), initial=1)
        """
        first, last = window_indices(self.times_ps, start_ps, stop_ps)
        return self.part(first, last)

    def part(self, first: int, last: int) -> LevelStream:
        """Return the toggles with the indices ``first <= i < last``; ``first`` is not negative."""
        return LevelStream(self.times_ps[first:last], (self.initial + first) & 1)

    def shift(self, delay_ps: int) -> LevelStream:
        """Return the same signal ``delay_ps`` later; negative is earlier."""
        return LevelStream(shifted(self.times_ps, delay_ps), self.initial)

    def inverted(self) -> LevelStream:
        """Return the signal with the other level everywhere."""
        return LevelStream(self.times_ps, 1 - self.initial)

    def chunks(self, chunk_edges: int) -> Iterator[LevelStream]:
        """Yield the signal in pieces of at most ``chunk_edges`` toggles, at least one piece."""
        size = _checks.chunk_size(chunk_edges)
        for first in range(0, max(len(self), 1), size):
            yield self.part(first, first + size)

    @staticmethod
    def concatenate(chunks: Iterable[LevelStream]) -> LevelStream:
        """Join pieces that follow one another; the reverse of :meth:`chunks`.

        Raises
        ------
        ArgumentError
            No piece at all, or one that does not start at the level and after the time where the one before it ended.

        Examples
        --------
        >>> line = LevelStream([10, 20, 30], initial=1)
        >>> LevelStream.concatenate(line.chunks(2)) == line
        True
        """
        pieces = list(chunks)
        return LevelStream(_checks.joined_times_ps(pieces), pieces[0].initial)


def window_indices(times_ps: NDArray[np.int64], start_ps: int, stop_ps: int) -> tuple[int, int]:
    """Return the indices that bound the part ``start_ps <= t < stop_ps`` of increasing times."""
    start, stop = _checks.time_ps("start_ps", start_ps), _checks.time_ps("stop_ps", stop_ps)
    if stop < start:
        raise ArgumentError("stop_ps", f"{stop} ps", f"a time not before start_ps = {start} ps")
    first, last = np.searchsorted(times_ps, [start, stop], side="left")
    return int(first), int(last)


def shifted(times_ps: NDArray[np.int64], delay_ps: int) -> NDArray[np.int64]:
    """Return times later by ``delay_ps``; both are within ±2**62, so that the sum cannot wrap."""
    return times_ps + _checks.time_ps("delay_ps", delay_ps)
