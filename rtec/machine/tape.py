"""What is seen of an open path while it runs: a waveform file of all of it, or rows around one insertion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record
from rtec.board.board import reading_ps
from rtec.injector import _wave_kernels as columns
from rtec.injector.waves import BoxWaves
from rtec.machine._recorder_kernels import ROWS_AN_EDGE, STEPS_AN_EDGE
from rtec.machine.open_path import OpenPath
from rtec.signal import TIMESCALES_PS, VcdSignal, VcdWriter, coarsest_timescale
from rtec.units import PS_PER_S

_ROOM = 1 << 18

NO_SINK = np.empty((0, columns.COLUMNS), np.int64), np.ones(1, np.int64)
"""A tape that is not read: where writing it costs little beside the rest, loops are compiled with one only."""


Mark = tuple[str, int, int]
"""What it is called, and from when to when it is there, ps."""


class TraceSink(Protocol):
    """Who looks at the rows of a tape."""

    @property
    def done(self) -> bool:
        """Return whether it wants no more of them."""

    def show(self, rows: NDArray[np.int64]) -> None:
        """Take rows; the first of them is the last one shown before."""


class TraceRecorder:
    """Rows on their way from the compiled loop to the reader; its memory does not grow with the run.

    Parameters
    ----------
    sinks
        Who looks at them.
    initial
        Level codes of encoder and controller at the start.
    """

    def __init__(self, sinks: list[TraceSink], initial: tuple[int, int]) -> None:
        self._sinks = sinks
        self._rows, self._used = np.empty((_ROOM, columns.COLUMNS), np.int64), np.ones(1, np.int64)
        self._rows[0] = (0, *initial, 0, 0, 0)

    @property
    def arrays(self) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
        """Return the tape as kernels want it; None where it is not read any more."""
        return None if all(sink.done for sink in self._sinks) else (self._rows, self._used)

    def flush(self, injector: Record, requests_left: int = 0) -> None:
        """Show what stands on the tape, and make room for what is owed and for requests that are still to come."""
        used = int(self._used[0])
        for sink in self._sinks:
            if used > 1 and not sink.done:
                sink.show(self._rows[:used])
        last = self._rows[used - 1].copy()
        owed = abs(int(injector.requested) - int(injector.completed)) + requests_left + STEPS_AN_EDGE
        room = 2 * (ROWS_AN_EDGE + owed * (int(injector.changes) + 4))
        if room > self._rows.shape[0]:
            self._rows = np.empty((room, columns.COLUMNS), np.int64)
        self._rows[0] = last
        self._used[0] = 1


class WaveFile:
    """A waveform file that is written while the path runs.

    Parameters
    ----------
    path
        The run.
    file
        Where to.
    initial
        Level codes of encoder and controller at the start.
    marks
        When something else is there: a signal for each, high meanwhile.
    """

    done = False

    def __init__(self, path: OpenPath, file: Path, initial: tuple[int, int], marks: Sequence[Mark] = ()) -> None:
        # a wrong request may ask for all that its word holds
        more = path.injector.design.word_limit if marks else 0
        self._waves = BoxWaves(
            initial,
            most_counts=most_counts(path) + more * path.injector.design.step_counts,
            most_steps=abs(path.corrections) + more,
        )
        timescale = timescale_of(path) if not marks else "1 ps"
        self._unit_ps = TIMESCALES_PS[timescale]
        first = len(self._waves.signals)
        signals = [VcdSignal(scope="faults", name=name.replace("-", "_")) for name, _, _ in marks]
        # ascending: time, index of the signal, value
        self._marks = sorted(
            (t_ps, first + k, value) for k, mark in enumerate(marks) for value, t_ps in ((1, mark[1]), (0, mark[2]))
        )
        self._writer = VcdWriter(file, signals=[*self._waves.signals, *signals], timescale=timescale)

    def __enter__(self) -> WaveFile:
        self._writer.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._writer.__exit__(*error)

    def show(self, rows: NDArray[np.int64]) -> None:
        """Write what the rows change."""
        changes = self._waves.changes(rows)
        due = [mark for mark in self._marks if mark[0] <= rows[-1, columns.TIME]]
        if due:
            self._marks = self._marks[len(due) :]
            both = [np.concatenate(pair) for pair in zip(changes, np.array(due, np.int64).T, strict=True)]
            order = np.argsort(both[0], kind="stable")
            changes = both[0][order], both[1][order], both[2][order]
        self._writer.write(*changes)

    def finish(self, end_ps: int) -> None:
        """Write the closing time, the next that the timescale has."""
        left = np.array([mark for mark in self._marks if mark[0] < end_ps], np.int64).reshape(-1, 3).T
        self._writer.write(*left)
        self._writer.finish(-(-end_ps // self._unit_ps) * self._unit_ps)


def most_counts(path: OpenPath) -> int:
    """Return how far the counts on either side of the box can go from 0."""
    return 4 * path.cycles + abs(path.corrections) * path.injector.design.step_counts + ROWS_AN_EDGE


def timescale_of(path: OpenPath) -> str:
    """Return the coarsest timescale of a file that holds every time of a run exactly.

    Samplers such as PulseView take one sample a unit, so 1 ps would be a million of them in a microsecond. Where
    edges come at times that follow no rhythm (a motion, jitter, glitches, an eccentric disc, a period of no whole
    picoseconds), nothing else holds them.

    Examples
    --------
    >>> from rtec.injector import Design, InjectorSettings, Timing
    >>> from rtec.machine import OpenPath
    >>> box = InjectorSettings(design=Design.A, timing=Timing())
    >>> [timescale_of(OpenPath(injector=box, frequency_hz=hz, cycles=1)) for hz in (500e3, 30e3)]
    ['10 ns', '1 ps']
    """
    flaws, state, processor = path.encoder.imperfections, path.state(), path.microcontroller
    e, s = state.encoder, state.injector
    uneven = e.quarter_left or flaws.jitter_ps or flaws.glitch_probability or flaws.eccentricity_counts
    uneven = uneven or path.motion is not None
    common = math.gcd(int(e.quarter_whole_ps), int(e.quarter_whole_ps) // 2, *e.shift_ps.tolist())
    if processor is None:
        times = (s.poll_ps, s.poll_offset_ps, s.decide_ps, s.step_ps, s.recover_ps, s.latency_ps, s.rest_ps)
        common = math.gcd(common, *(int(time) for time in times))
    else:
        cycle_ps, parts = processor.cycle_ps
        uneven = uneven or parts != 1
        common = math.gcd(common, cycle_ps, reading_ps(processor))
    return coarsest_timescale([1 if uneven else common])


def estimated_bytes(path: OpenPath) -> int:
    """Return about how long the waveform file of a run becomes, without running it.

    Examples
    --------
    >>> from rtec.injector import Design, InjectorSettings, Timing
    >>> from rtec.machine import OpenPath
    >>> box = InjectorSettings(design=Design.C, timing=Timing())
    >>> f"{estimated_bytes(OpenPath(injector=box, frequency_hz=500e3, cycles=10**9)) / 1e9:.0f} GB"
    '176 GB'
    """
    design, edges = path.injector.design, 4 * path.cycles
    steps = abs(path.corrections)
    flaws = path.encoder.imperfections
    edges += round(2 * edges * flaws.glitch_probability)
    end_ps = path.cycles / path.frequency_hz * PS_PER_S if path.motion is None else path.motion.total_ps
    time_line = 2 + _mean_digits(round(end_ps / TIMESCALES_PS[timescale_of(path)]))
    # a bit with its code and the end of its line; a state and a count change two bits each, more or less
    bit, long_bit = 3, 4
    side = bit + 2 * bit + 2 * bit
    an_edge = time_line * (2 if design.in_path else 1) + 2 * side
    a_step = design.step_counts * (time_line + side) + 2 * bit + 4 * long_bit + time_line
    return round(edges * an_edge + steps * a_step)


def _mean_digits(largest: int) -> float:
    digits = len(str(max(largest, 1)))
    return digits - (10 ** (digits - 1) - 1) / 9 / max(largest, 1)
