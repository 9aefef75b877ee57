"""Streams written as waveform files: one call from the signals of a run to what GTKWave shows."""

from __future__ import annotations

import enum
import math
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import BinaryIO, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from rtec.errors import ArgumentError
from rtec.signal import _checks
from rtec.signal._feed import Feed
from rtec.signal.gray import states_of_levels
from rtec.signal.line import LevelStream
from rtec.signal.stream import EdgeStream
from rtec.signal.vcd import TIMESCALES_PS, VcdSignal, VcdWriter

Waveform: TypeAlias = EdgeStream | LevelStream | Iterable[EdgeStream] | Iterable[LevelStream]
"""A stream, or the pieces of one."""

_CHUNK_EDGES = 1 << 17
_Changes: TypeAlias = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]


class Detail(enum.Enum):
    """What a waveform file shows of an edge stream: its lines alone, or also the number 1..4 of its state.

    GTKWave joins the three bits of the state to a number; PulseView shows each of them.
    """

    LINES = "lines"
    LINES_AND_STATE = "lines and state"


def coarsest_timescale(streams: Iterable[EdgeStream | LevelStream], *, end_ps: int, start_ps: int = 0) -> str:
    """Return the coarsest timescale that holds every time exactly.

    Examples
    --------
    >>> coarsest_timescale([LevelStream([2_000_000, 3_500_000], 0)], end_ps=10_000_000)
    '100 ns'
    """
    common = math.gcd(_checks.time_ps("end_ps", end_ps), _checks.time_ps("start_ps", start_ps))
    for stream in streams:
        common = int(np.gcd.reduce(stream.times_ps, initial=common))
    return next(text for text in reversed(TIMESCALES_PS) if common % TIMESCALES_PS[text] == 0)


def write_vcd(
    target: str | Path | BinaryIO,
    waveforms: Mapping[str, Waveform],
    *,
    end_ps: int,
    start_ps: int = 0,
    timescale: str = "1 ps",
    detail: Detail = Detail.LINES,
) -> None:
    """Write streams as one VCD file; an existing file is replaced once the new one is complete.

    Parameters
    ----------
    target
        Path, or binary file object.
    waveforms
        Streams by name. An :class:`EdgeStream` called ``encoder`` is shown as ``encoder.A`` and ``encoder.B``; a
        :class:`LevelStream` needs the full name, as in ``encoder.Z``. A stream may come in pieces; memory is then
        bounded by one piece of each.
    end_ps
        Closing time, not before the last edge.
    start_ps
        Time of the initial values, not after the first edge. An edge at this very time is shown as the value there.
    timescale
        Unit of the times in the file; see :func:`coarsest_timescale`.
    detail
        With ``LINES_AND_STATE``, each edge stream has a signal ``state`` of three bits, 1..4 as the report counts.

    Raises
    ------
    ArgumentError
        A name that VCD does not allow, an edge outside ``start_ps .. end_ps`` or no multiple of the timescale.
    OutputError
        The file cannot be written; nothing is left behind.

    Examples
    --------
    >>> import io
    >>> file = io.BytesIO()
    >>> write_vcd(file, {"encoder": EdgeStream([3, 5], [1, 3], initial=0)}, end_ps=9)
    >>> print(file.getvalue().decode())
    $version rtec $end
    $timescale 1 ps $end
    $scope module encoder $end
    $var wire 1 a A $end
    $var wire 1 b B $end
    $upscope $end
    $enddefinitions $end
    #0
    $dumpvars
    0a
    0b
    $end
    #3
    1a
    #5
    1b
    #9
    <BLANKLINE>
    """
    tracks: list[_EdgeTrack | _LineTrack] = []
    signals: list[VcdSignal] = []
    for name, waveform in waveforms.items():
        track = _track(name, waveform, len(signals), detail)
        tracks.append(track)
        signals += track.signals
    with VcdWriter(target, signals=signals, timescale=timescale, start_ps=start_ps) as writer:
        while not all(track.feed.done for track in tracks):
            before_ps = min(track.feed.known_before_ps for track in tracks)
            changes = [track.changes(before_ps) for track in tracks]
            times, which, values = (np.concatenate(column) for column in zip(*changes, strict=True))
            order = np.argsort(times, kind="stable")
            writer.write(times[order], which[order], values[order])
        writer.finish(end_ps)


class _LineTrack:
    """A line in the file."""

    def __init__(self, name: str, chunks: Iterable[LevelStream], first: int) -> None:
        scope, dot, wire = name.partition(".")
        if not dot:
            raise ArgumentError("waveforms", repr(name), "a name with its scope for a line", "such as 'encoder.Z'")
        self.feed = Feed(name, chunks)
        self._first = first
        self.signals = [VcdSignal(scope=scope, name=wire, initial=self.feed.level)]

    def changes(self, before_ps: int) -> _Changes:
        part = self.feed.take(before_ps)
        return part.times_ps, np.full(len(part), self._first), part.levels.astype(np.int64)


class _EdgeTrack:
    """A pair of lines in the file, and their state where it is asked for."""

    def __init__(self, name: str, chunks: Iterable[EdgeStream], first: int, detail: Detail) -> None:
        self.feed = Feed(name, chunks)
        self._first = first
        level = self.feed.level
        self.signals = [
            VcdSignal(scope=name, name="A", initial=level & 1),
            VcdSignal(scope=name, name="B", initial=level >> 1),
        ]
        self._shows_state = detail is Detail.LINES_AND_STATE
        if self._shows_state:
            self.signals.append(VcdSignal(scope=name, name="state", width=3, initial=_numbers([level])[0]))

    def changes(self, before_ps: int) -> _Changes:
        part = self.feed.take(before_ps)
        columns = [(line.times_ps, line.levels.astype(np.int64)) for line in part.lines()]
        if self._shows_state:
            columns.append((part.times_ps, _numbers(part.levels)))
        which = [np.full(times.size, self._first + k) for k, (times, _) in enumerate(columns)]
        times, values = (np.concatenate(column) for column in zip(*columns, strict=True))
        return times, np.concatenate(which), values


def _numbers(levels: NDArray[np.uint8] | list[int]) -> NDArray[np.int64]:
    return states_of_levels(levels).astype(np.int64) + 1


def _track(name: str, waveform: Waveform, first: int, detail: Detail) -> _EdgeTrack | _LineTrack:
    """Return the track of a waveform, whose kind shows in its first piece."""
    if isinstance(waveform, EdgeStream):
        return _EdgeTrack(name, waveform.chunks(_CHUNK_EDGES), first, detail)
    if isinstance(waveform, LevelStream):
        return _LineTrack(name, waveform.chunks(_CHUNK_EDGES), first)
    pieces = iter(waveform)
    head = next(pieces, None)
    if isinstance(head, EdgeStream):
        return _EdgeTrack(name, chain([head], cast(Iterator[EdgeStream], pieces)), first, detail)
    if isinstance(head, LevelStream):
        return _LineTrack(name, chain([head], cast(Iterator[LevelStream], pieces)), first)
    raise ArgumentError(f"waveforms[{name!r}]", repr(head)[:80], "an EdgeStream, a LevelStream, or pieces of one")
