"""What an open path's encoder sends and what is asked for, in windows of bounded memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from rtec.axis import _kernels
from rtec.axis.motion import COUNT_MM, Motion
from rtec.machine.open_path import OpenPath
from rtec.signal import NEVER, EdgeStream

Asks = tuple[NDArray[np.int64], NDArray[np.int64]]
"""When requests come, ps, not decreasing, and the totals that they ask for; int64 (n,) each."""
_CHUNK_EDGES = 1 << 16


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Window:
    """From the end of the last window to before ``until_ps``."""

    edges: EdgeStream
    asks: Asks
    from_ps: int
    until_ps: int
    """The time of the next edge; ``NEVER`` for the last window."""


class Source:
    """The encoder of an open path, as `rtec.machine.simulate` moves it.

    Examples
    --------
    >>> from rtec.injector import Design, InjectorSettings, Timing
    >>> box = InjectorSettings(design=Design.C, timing=Timing())
    >>> source = Source(OpenPath(injector=box, frequency_hz=250e3, cycles=1, corrections=2))
    >>> window = next(source.windows())
    >>> window.edges.times_ps.tolist(), window.asks[0].tolist(), int(source.encoder.count)
    ([500000, 1500000, 2500000, 3500000], [500000, 2500000], 4)
    """

    def __init__(self, path: OpenPath) -> None:
        self._path = path
        self._sign = 1 if path.corrections >= 0 else -1
        self.encoder = path.state().encoder
        """The record of the kernels, with count, number of edges and glitches so far."""
        asks_ps = np.zeros(0, np.int64) if path.motion is None else path.motion.requests_ps
        self._asks: Asks = asks_ps, self._sign * np.arange(1, asks_ps.size + 1)

    def windows(self) -> Iterator[Window]:
        """Yield the windows, at least one."""
        motion = self._path.motion
        chunks = self._steady() if motion is None else self._moved(motion)
        none = EdgeStream([], [], self._path.encoder.level_at_home)
        before, from_ps = next(chunks, none), 0
        for after in chain(chunks, [None]):
            until_ps = NEVER if after is None else int(after.times_ps[0])
            asks_ps, totals = self._asks
            k = int(np.searchsorted(asks_ps, until_ps))
            self._asks = asks_ps[k:], totals[k:]
            yield Window(edges=before, asks=(asks_ps[:k], totals[:k]), from_ps=from_ps, until_ps=until_ps)
            if after is not None:
                before, from_ps = after, until_ps

    def _steady(self) -> Iterator[EdgeStream]:
        path = self._path
        total, steps, rest_ps = 4 * path.cycles, abs(path.corrections), path.injector.timing.rest_ps
        done, asked, level = 0, 0, path.encoder.level_at_home
        while done < total:
            some = min(total - done, _CHUNK_EDGES)
            room = 3 * some + 8
            times, levels, real = np.empty(room, np.int64), np.empty(room, np.uint8), np.empty(room, np.uint8)
            last_ps = rest_ps if done + some == total else 0
            n = _kernels.trace_steady(self.encoder, some, last_ps, times, levels, real)
            # a step is due whenever the sum of the steps passes the number of edges
            whole, rest = divmod(total - 1 + done * steps, total)
            due = whole + (rest + np.arange(1, some + 1) * steps) // total
            new = np.diff(due, prepend=asked) > 0
            asks = times[:n][real[:n] == 1][new], self._sign * due[new]
            self._asks = np.concatenate([self._asks[0], asks[0]]), np.concatenate([self._asks[1], asks[1]])
            asked, done = int(due[-1]), done + some
            yield EdgeStream(times[:n], levels[:n], level)
            level = int(levels[n - 1])

    def _moved(self, motion: Motion) -> Iterator[EdgeStream]:
        encoder = replace(self._path.encoder, count_mm=COUNT_MM)
        return (chunk for chunk in encoder.edge_chunks(motion.segments, self.encoder) if len(chunk))
