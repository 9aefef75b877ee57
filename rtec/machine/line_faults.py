"""Faults of the lines between encoder and box, applied to a stream of edges window by window.

Each stage takes the edges of a window and returns those that come out of it in the same window; what a stage puts off
beyond the window's end it keeps for the next one.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rtec.machine.fault_kinds import CABLE, GLITCHES, FaultRow
from rtec.machine.faults import Fault
from rtec.machine.open_fault_kinds import LINE_A, LINE_B, MISSED, PULSES, OpenFaultRow
from rtec.signal import NEVER, EdgeStream

_Ints = NDArray[np.int64]


class LineFault(Protocol):
    """A fault of the lines, fed with one window after the other."""

    def through(self, edges: EdgeStream, from_ps: int, until_ps: int) -> EdgeStream:
        """Return what comes out of ``from_ps`` to before ``until_ps``, where ``edges`` go in and the next follows."""


def line_fault(fault: Fault, initial: int) -> LineFault:
    """Return the stage of a fault of the lines.

    Parameters
    ----------
    fault
        Its class, with a code of `rtec.machine.open_fault_kinds.LINE_CODES`; when it begins and is over; its seed.
    initial
        Level code before the first window.

    Examples
    --------
    A sticks at low from 25 ps on, and misses what would have been its fall at 30 ps:

    >>> from rtec.machine.open_fault_kinds import open_fault_named
    >>> stage = line_fault(Fault(kind=open_fault_named("a-stuck-low"), place=1, from_ps=25), 0)
    >>> stage.through(EdgeStream([10, 20, 30], [1, 3, 2], initial=0), 0, 100)
    EdgeStream(times_ps=array([10, 20, 25]), levels=array([1, 3, 2], dtype=uint8), initial=0)
    """
    code = fault.kind.code
    if code == CABLE:
        return _Levels(fault, initial)
    if code == GLITCHES:
        return _Glitches(fault, initial)
    if code == PULSES:
        return _Pulses(initial, *burst(fault))
    return _Missed(fault, initial) if code == MISSED else _Shifted(fault)


def stream_of(times_ps: _Ints, levels: NDArray[np.integer[Any]], initial: int) -> EdgeStream:
    """Return the stream of levels at ascending times, of which some may change nothing."""
    changed = levels != np.concatenate([[initial], levels[:-1]]) if levels.size else np.zeros(0, bool)
    return EdgeStream(times_ps[changed], levels[changed].astype(np.uint8), int(initial))


def differences(right: EdgeStream, wrong: EdgeStream) -> tuple[int | None, int]:
    """Return when two streams first differ, and at how many moments of either they do.

    Examples
    --------
    >>> differences(EdgeStream([10, 20, 30], [1, 3, 2], 0), EdgeStream([10, 25], [1, 3], 0))
    (20, 2)
    """
    times = np.union1d(right.times_ps, wrong.times_ps)
    differ = times[right.levels_at(times) != wrong.levels_at(times)]
    return (int(differ[0]) if differ.size else None), int(differ.size)


def burst(fault: Fault) -> tuple[_Ints, _Ints]:
    """Return times and lines of the toggles of a burst of pulses, as its seed has them.

    Returns
    -------
    tuple of ndarray
        Times in ps, not ordered, and masks of lines, int64 (2 n,): begin and end of each pulse.
    """
    row = fault.kind
    if not isinstance(row, OpenFaultRow):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    generator = np.random.default_rng(fault.seed)
    begins = fault.from_ps + np.sort(generator.integers(0, row.within_ps + 1, row.number))
    lasts = generator.integers(row.lasts_ps[0], row.lasts_ps[1] + 1, row.number)
    lines = [line for line in (LINE_A, LINE_B) if row.line & line]
    masks = np.array(lines, np.int64)[generator.integers(0, len(lines), row.number)]
    return np.concatenate([begins, begins + lasts]), np.concatenate([masks, masks])


class _Levels:
    """Levels that follow from those of the encoder: lines that are open, stuck or exchanged."""

    def __init__(self, fault: Fault, initial: int) -> None:
        self._fault, self._last, self._before = fault, initial, initial
        self._table = _table(fault.kind)

    def through(self, edges: EdgeStream, from_ps: int, until_ps: int) -> EdgeStream:
        begin_ps, over_ps = self._fault.from_ps, self._fault.over_ps
        moments = [t for t in (begin_ps, over_ps) if from_ps <= t < until_ps]
        times = np.union1d(edges.times_ps, np.array(moments, np.int64))
        if from_ps <= begin_ps < until_ps:
            self._before = edges.level_at(begin_ps - 1)
        right = edges.levels_at(times)
        levels = np.where((begin_ps <= times) & (times < over_ps), self._table[self._before][right], right)
        made = stream_of(times, levels, self._last)
        self._last = made.final
        return made


def _table(row: FaultRow) -> NDArray[np.uint8]:
    """Return the levels behind the cable, by those before the fault and those now, shape (4, 4)."""
    bits = row.cable
    levels = [[level ^ (bits >> (8 * before + 2 * level)) & 3 for level in range(4)] for before in range(4)]
    return np.array(levels, np.uint8)


class _Toggles:
    """A stage that adds toggles to those of the lines; those beyond a window wait."""

    def __init__(self, initial: int, times_ps: _Ints, masks: _Ints) -> None:
        self._last, self._times_ps, self._masks = initial, times_ps, masks

    def with_own(self, times_ps: _Ints, masks: _Ints, until_ps: int) -> EdgeStream:
        """Return the stream of all toggles before ``until_ps``: given ones, and own ones that are due."""
        due = self._times_ps < until_ps
        times = np.concatenate([times_ps, self._times_ps[due]])
        masks = np.concatenate([masks, self._masks[due]])
        self._times_ps, self._masks = self._times_ps[~due], self._masks[~due]
        moments, at = np.unique(times, return_inverse=True)
        toggled = np.zeros(moments.size, np.int64)
        np.bitwise_xor.at(toggled, at, masks)
        made = stream_of(moments, np.bitwise_xor.accumulate(toggled) ^ self._last, self._last)
        self._last = made.final
        return made


def _masks_of(edges: EdgeStream) -> _Ints:
    """Return the lines that each edge toggles, int64 (n,)."""
    before = np.concatenate([[edges.initial], edges.levels[:-1]])
    return edges.levels.astype(np.int64) ^ before.astype(np.int64)


class _Pulses(_Toggles):
    """Pulses at times of their own."""

    def through(self, edges: EdgeStream, from_ps: int, until_ps: int) -> EdgeStream:
        return self.with_own(edges.times_ps, _masks_of(edges), until_ps)


class _Glitches(_Toggles):
    """Pulses that follow edges, as the encoder of a cell makes them: one at a time, within the next interval."""

    def __init__(self, fault: Fault, initial: int) -> None:
        super().__init__(initial, np.zeros(0, np.int64), np.zeros(0, np.int64))
        self._fault, self._generator = fault, np.random.default_rng(fault.seed)
        self._edge_ps, self._busy_ps = -NEVER, -NEVER

    def through(self, edges: EdgeStream, from_ps: int, until_ps: int) -> EdgeStream:
        share, width_ps = self._fault.kind.glitches
        times = edges.times_ps
        since = np.diff(times, prepend=self._edge_ps)
        draws, sixteenths = self._generator.random(times.size), self._generator.integers(0, 16, times.size)
        lines = self._generator.integers(1, 3, times.size)
        on = (self._fault.from_ps <= times) & (times < self._fault.over_ps) & (draws < share) & (since < NEVER)
        begun, masks = [], []
        for begin_ps, mask in zip((times + 1 + (since >> 4) * sixteenths)[on].tolist(), lines[on], strict=True):
            if begin_ps > self._busy_ps:
                self._busy_ps = begin_ps + width_ps
                begun += [begin_ps, self._busy_ps]
                masks += [mask, mask]
        self._times_ps = np.concatenate([self._times_ps, np.array(begun, np.int64)])
        self._masks = np.concatenate([self._masks, np.array(masks, np.int64)])
        self._edge_ps = int(times[-1]) if times.size else self._edge_ps
        return self.with_own(times, _masks_of(edges), until_ps)


class _Missed(_Toggles):
    """An edge that has no effect; the line is right again with its next one."""

    def __init__(self, fault: Fault, initial: int) -> None:
        super().__init__(initial, np.zeros(0, np.int64), np.zeros(0, np.int64))
        self._from_ps, self._wrong, self._done = fault.from_ps, 0, False

    def through(self, edges: EdgeStream, from_ps: int, until_ps: int) -> EdgeStream:
        masks, first = _masks_of(edges), 0
        if not self._done:
            first = int(np.searchsorted(edges.times_ps, self._from_ps))
            if first == masks.size:
                return self.with_own(edges.times_ps, masks, until_ps)
            self._wrong, masks[first], self._done, first = int(masks[first]), 0, True, first + 1
        for line in (LINE_A, LINE_B):
            next_of_line = np.flatnonzero(masks[first:] & line)
            if self._wrong & line and next_of_line.size:
                masks[first + next_of_line[0]] ^= line
                self._wrong ^= line
        return self.with_own(edges.times_ps, masks, until_ps)


class _Shifted:
    """Edges of a line that come late: by a share of the shorter of the intervals around them, so in their order."""

    def __init__(self, fault: Fault) -> None:
        self._fault, self._edge_ps = fault, -NEVER

    def through(self, edges: EdgeStream, from_ps: int, until_ps: int) -> EdgeStream:
        row, times = self._fault.kind, edges.times_ps
        if not isinstance(row, OpenFaultRow) or not times.size:
            return edges
        shorter = np.minimum(np.diff(times, prepend=self._edge_ps), np.diff(times, append=until_ps))
        moved = (_masks_of(edges) == row.line) & (self._fault.from_ps <= times) & (times < self._fault.over_ps)
        if row.falls_only:
            moved &= edges.levels & row.line == 0
        self._edge_ps = int(times[-1])
        return EdgeStream(
            times + np.where(moved, (shorter * row.factor).astype(np.int64), 0), edges.levels, edges.initial
        )
