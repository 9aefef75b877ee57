"""The edge stream: the two lines of an encoder as times and levels."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rtec.errors import ArgumentError
from rtec.signal import _checks, gray
from rtec.signal._kernels import ILLEGAL


class Counts(NamedTuple):
    """What an ideal x4 decoder makes of a stream."""

    net: int
    """Counts in the positive direction less those in the negative; an illegal transition adds none."""
    illegal: int
    """Transitions of both lines at once."""


@dataclass(frozen=True, slots=True, eq=False)
class EdgeStream:
    """The A and B signals of an encoder, as the changes of their common level code.

    Parameters
    ----------
    times_ps
        Times of the edges, strictly increasing, int64 ps, shape (n,). An int64 array is not copied; it must not be
        changed afterwards.
    levels
        Level code ``A + 2 * B`` after each edge, 0..3, each other than the one before, uint8, shape (n,).
    initial
        Level code before the first edge.

    Raises
    ------
    ArgumentError
        A broken invariant, named with its index and value.

    Notes
    -----
    Where both lines change at one time there is one edge, an illegal transition. The stream is right-continuous: at
    the time of an edge the level is the one after it.

    Examples
    --------
    Five edges forward through the states 1 to 4, and to 1 and 2 again:

    >>> stream = EdgeStream([10, 20, 30, 40, 50], [1, 3, 2, 0, 1], initial=0)
    >>> stream.counts()
    Counts(net=5, illegal=0)
    >>> stream.level_at(35), stream.window(20, 40).counts().net
    (2, 2)
    """

    times_ps: NDArray[np.int64]
    levels: NDArray[np.uint8]
    initial: int

    def __init__(self, times_ps: ArrayLike, levels: ArrayLike, initial: int) -> None:
        object.__setattr__(self, "times_ps", _checks.times_ps("times_ps", times_ps))
        object.__setattr__(self, "levels", _checks.codes("levels", levels, 3))
        object.__setattr__(self, "initial", _checks.code("initial", initial, 3))
        if self.times_ps.size != self.levels.size:
            raise ArgumentError("levels", f"{self.levels.size} values", f"one for each of {self.times_ps.size} times")
        if not len(self):
            return
        if self.levels[0] == self.initial:
            raise ArgumentError("levels[0]", self.initial, "a level other than the initial one")
        same = self.levels[1:] == self.levels[:-1]
        if same.any():
            index = int(np.argmax(same)) + 1
            raise ArgumentError(f"levels[{index}]", self.levels[index], "a level other than the one before it")

    def __len__(self) -> int:
        return int(self.times_ps.size)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, EdgeStream):
            return NotImplemented
        return (
            self.initial == other.initial
            and np.array_equal(self.times_ps, other.times_ps)
            and np.array_equal(self.levels, other.levels)
        )

    __hash__ = None  # type: ignore[assignment]  # arrays are compared, not hashed

    @classmethod
    def from_states(cls, times_ps: ArrayLike, states: ArrayLike, initial_state: int) -> EdgeStream:
        """Make a stream from angle states 0..3 instead of level codes.

        Examples
        --------
        >>> EdgeStream.from_states([10, 20], [1, 2], initial_state=0).levels.tolist()
        [1, 3]
        """
        initial = _checks.code("initial_state", initial_state, 3)
        return cls(times_ps, gray.levels_of_states(states), initial ^ (initial >> 1))

    @property
    def final(self) -> int:
        """The level code after the last edge."""
        return int(self.levels[-1]) if len(self) else self.initial

    def counts(self) -> Counts:
        """Return the net count and the number of illegal transitions."""
        deltas = gray.count_deltas(self.levels, self.initial)
        illegal = int(np.count_nonzero(deltas == ILLEGAL))
        return Counts(net=int(deltas.sum()) - ILLEGAL * illegal, illegal=illegal)

    def min_separation_ps(self) -> int | None:
        """Return the shortest time between two edges, or None where there are fewer than two."""
        return int(np.diff(self.times_ps).min()) if len(self) > 1 else None

    def level_at(self, t_ps: int) -> int:
        """Return the level code at ``t_ps``; an edge at that very time has happened."""
        return int(self.levels_at([_checks.time_ps("t_ps", t_ps)])[0])

    def levels_at(self, t_ps: ArrayLike) -> NDArray[np.uint8]:
        """Return the level codes at the times ``t_ps``, in any order, as uint8 of shape (m,)."""
        moments = _checks.whole_numbers("t_ps", t_ps, "whole picoseconds")
        edges = np.searchsorted(self.times_ps, moments, side="right")
        return np.concatenate([[np.uint8(self.initial)], self.levels])[edges]

    def window(self, start_ps: int, stop_ps: int) -> EdgeStream:
        """Return the part ``start_ps <= t < stop_ps``, starting at the level just before ``start_ps``.

        Raises
        ------
        ArgumentError
            ``stop_ps`` before ``start_ps``.
        """
        start, stop = _checks.time_ps("start_ps", start_ps), _checks.time_ps("stop_ps", stop_ps)
        if stop < start:
            raise ArgumentError("stop_ps", f"{stop} ps", f"a time not before start_ps = {start} ps")
        first, last = np.searchsorted(self.times_ps, [start, stop], side="left")
        return self.part(int(first), int(last))

    def part(self, first: int, last: int) -> EdgeStream:
        """Return the edges with the indices ``first <= i < last``; ``first`` is not negative."""
        initial = int(self.levels[first - 1]) if first else self.initial
        return EdgeStream(self.times_ps[first:last], self.levels[first:last], initial)

    def check_joins(self, level: int, from_ps: int, until_ps: int) -> None:
        """See that the stream goes on from a level, and lies between two times.

        Raises
        ------
        ArgumentError
            Edges that do not join the last ones, or lie outside ``from_ps`` and ``until_ps``.
        """
        if self.initial != level:
            raise ArgumentError("edges.initial", self.initial, f"{level}, where the last stream ended")
        if self.times_ps.size and not from_ps <= self.times_ps[0] <= self.times_ps[-1] < until_ps:
            raise ArgumentError(
                "edges.times_ps",
                f"{self.times_ps[0]} to {self.times_ps[-1]} ps",
                f"times from {from_ps} ps to before {until_ps} ps",
            )

    def shift(self, delay_ps: int) -> EdgeStream:
        """Return the same signals ``delay_ps`` later; negative is earlier."""
        # both are within ±2**62, so that the sum cannot wrap
        return EdgeStream(self.times_ps + _checks.time_ps("delay_ps", delay_ps), self.levels, self.initial)

    @staticmethod
    def concatenate(chunks: Iterable[EdgeStream]) -> EdgeStream:
        """Join pieces that follow one another.

        Raises
        ------
        ArgumentError
            No piece at all, or one that does not start at the level and after the time where the one before it ended.

        Examples
        --------
        >>> stream = EdgeStream([10, 20, 30], [1, 3, 1], initial=0)
        >>> EdgeStream.concatenate([stream.part(0, 2), stream.part(2, 3)]) == stream
        True
        """
        pieces = list(chunks)
        if not pieces:
            raise ArgumentError("chunks", "an empty sequence", "at least one stream")
        last_ps: int | None = None
        for index, piece in enumerate(pieces):
            where, times = f"chunks[{index}]", piece.times_ps
            if index and piece.initial != pieces[index - 1].final:
                allowed = f"{pieces[index - 1].final}, the level where the chunk before it ended"
                raise ArgumentError(f"{where}.initial", piece.initial, allowed)
            if times.size and last_ps is not None and times[0] <= last_ps:
                allowed = f"a time after {last_ps} ps, the last of the chunks before it"
                raise ArgumentError(f"{where}.times_ps[0]", f"{times[0]} ps", allowed)
            last_ps = int(times[-1]) if times.size else last_ps
        return EdgeStream(
            np.concatenate([piece.times_ps for piece in pieces]),
            np.concatenate([piece.levels for piece in pieces]),
            pieces[0].initial,
        )
