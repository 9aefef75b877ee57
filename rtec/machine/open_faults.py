"""The open path with faults: lines, box and requests that go wrong at a moment, and what becomes of the counts.

The run is carried out beside its twins, window by window: one without any fault, and for each fault of the box one
without this fault alone. Memory does not grow with the length of the run.
"""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record
from rtec.errors import ArgumentError
from rtec.injector._wave_kernels import COMPLETED, LEVEL_OUT, TIME
from rtec.machine import _faulty_kernels as kernels
from rtec.machine.box_faults import change_box
from rtec.machine.fault_kinds import FaultRow
from rtec.machine.faults import Fault
from rtec.machine.line_faults import LineFault, differences, line_fault
from rtec.machine.open_fault_kinds import BOX_CODES, LINE_CODES, REQUEST, check_pair, why_not, word_of
from rtec.machine.open_fault_outcome import FaultEffect, FaultOutcome, Watched
from rtec.machine.open_path import OpenPath, OpenPathResult
from rtec.machine.open_run import MotionRun, box_of, result_of_path, settle_ps, stop
from rtec.machine.tape import TraceRecorder, TraceSink, WaveFile
from rtec.machine.windows import Asks, Source, Window
from rtec.signal import NEVER, EdgeStream
from rtec.units import PS_PER_S


def faults_at(
    path_ps: int, wanted: Sequence[tuple[FaultRow, int | None, int | None]], seed: int, *, name: str = "fault"
) -> tuple[Fault, ...]:
    """Return faults with their moments, those that are not given drawn.

    Parameters
    ----------
    path_ps
        How long the run lasts.
    wanted
        Class, begin and end of each; None: a drawn moment, and for good. An end behind that of the run is none.
    seed
        Of the moments and of what a fault draws.
    name
        By which the user knows the faults.

    Raises
    ------
    ArgumentError
        More than two, the same twice, a moment behind the end, an end that means nothing.

    Examples
    --------
    >>> from rtec.machine.open_fault_kinds import open_fault_named
    >>> [fault.from_ps for fault in faults_at(10**9, [(open_fault_named("missed edge"), None, None)], 1)]
    [134364244]
    """
    check_pair([row for row, _, _ in wanted], name=name)
    found = []
    for number, (row, from_ps, until_ps) in enumerate(wanted):
        moment_ps = from_ps
        if moment_ps is None:
            moment_ps = int(random.Random(seed + 1000 * number).random() * path_ps)  # noqa: S311 - a draw, no secret
        if moment_ps < 0:
            raise ArgumentError(name, f"{word_of(row)} at {moment_ps / PS_PER_S:.9g} s", "a moment from 0 s on")
        if moment_ps >= path_ps:
            allowed = f"a moment before the run ends, at {path_ps / PS_PER_S:.9g} s"
            raise ArgumentError(name, f"{word_of(row)} at {moment_ps / PS_PER_S:.9g} s", allowed)
        if until_ps is not None and row.over_at_once:
            raise ArgumentError(name, word_of(row), "it without an end", problem="is over at once")
        if until_ps is not None and until_ps <= moment_ps:
            raise ArgumentError(name, f"until {until_ps / PS_PER_S:.9g} s", "a time after its begin")
        over_ps = None if until_ps is None or until_ps >= path_ps else until_ps
        found.append(Fault(kind=row, place=1, from_ps=max(moment_ps, 1), until_ps=over_ps, seed=seed + 1000 * number))
    return tuple(found)


def check_possible(path: OpenPath, faults: Sequence[Fault], *, name: str = "fault") -> None:
    """Check that the box of a path can have the faults.

    Raises
    ------
    ArgumentError
        One that it cannot have, and why.
    """
    for fault in faults:
        reason = why_not(fault.kind, path.injector.design, path.injector.real_edges)
        if reason is not None:
            raise ArgumentError(name, word_of(fault.kind), "another fault", reason, problem="cannot happen here")


def length_ps(path: OpenPath) -> int:
    """Return how long the motion of a path lasts."""
    return path.motion.total_ps if path.motion is not None else round(path.cycles / path.frequency_hz * PS_PER_S)


def corrupted(asks: Asks, fault: Fault, bits: int) -> tuple[Asks, int | None]:
    """Return requests of which the first from the fault's moment on has a wrong bit, and when that comes, if any."""
    asks_ps, totals = asks
    k = int(np.searchsorted(asks_ps, fault.from_ps))
    if k == asks_ps.size:
        return asks, None
    totals = totals.copy()
    totals[k] ^= 1 << random.Random(fault.seed).randrange(bits)  # noqa: S311 - a draw, no secret
    return (asks_ps, totals), int(asks_ps[k])


class _Route:
    """Lines, box and controller with some of the faults."""

    def __init__(self, path: OpenPath, effects: Sequence[FaultEffect], sinks: Sequence[TraceSink] = ()) -> None:
        self.path, self.effects = path, effects
        initial = path.encoder.level_at_home
        self._lines: list[tuple[FaultEffect, LineFault]] = [
            (effect, line_fault(effect.fault, initial)) for effect in effects if effect.fault.kind.code in LINE_CODES
        ]
        self.state, self.board = path.state(), path.board()
        self._box = box_of(self.state, self.board)
        first = initial, int(self.state.receiver.raw)
        self._kept = Kept(first)
        self._tape = TraceRecorder([self._kept, *sinks], first)
        self._at = np.array([0, 0, NEVER], np.int64)
        self.counts_in, self.illegal_in, self._asked_wrong = 0, 0, False

    def run(self, window: Window, *, notes: bool) -> None:
        """Pass a window; the effects of lines and requests are noted where that is wanted."""
        edges, asks = window.edges, window.asks
        for effect, stage in self._lines:
            wrong = stage.through(edges, window.from_ps, window.until_ps)
            if notes:
                effect.add(differences(edges, wrong))
            edges = wrong
        for effect in self.effects:
            if effect.fault.kind.code == REQUEST and not self._asked_wrong:
                asks, wrong_ps = corrupted(asks, effect.fault, self.path.injector.design.word_limit.bit_length())
                self._asked_wrong = wrong_ps is not None
                if notes:
                    effect.add((wrong_ps, int(self._asked_wrong)))
        seen = edges.counts()
        self.counts_in, self.illegal_in = self.counts_in + seen.net, self.illegal_in + seen.illegal
        moments = sorted(self._moments(window), key=lambda one: one[0])
        self._at[kernels.EDGES_DONE] = self._at[kernels.ASKS_DONE] = 0
        for t_ps, fault, begins in moments:
            self._pass(edges, asks, t_ps)
            level = edges.level_at(t_ps - 1)
            change_box(self.state, self._box, fault.kind, t_ps, level, begins=begins)
            self._at[kernels.UNSEEN_PS] = t_ps
        until_ps = window.until_ps
        if until_ps == NEVER:
            ends = [int(times[-1]) for times in (edges.times_ps, asks[0]) if times.size]
            until_ps = max([window.from_ps, *ends, *(t_ps for t_ps, _, _ in moments)]) + 1
        self._pass(edges, asks, until_ps)

    def _moments(self, window: Window) -> Iterator[tuple[int, Fault, bool]]:
        """Yield when faults of the box begin and end in a window."""
        for effect in self.effects:
            fault = effect.fault
            if fault.kind.code in BOX_CODES:
                if window.from_ps <= fault.from_ps < window.until_ps:
                    yield fault.from_ps, fault, True
                if not fault.kind.over_at_once and window.from_ps <= fault.over_ps < window.until_ps:
                    yield fault.over_ps, fault, False

    def _pass(self, edges: EdgeStream, asks: Asks, until_ps: int) -> None:
        """Pass what comes before ``until_ps``."""
        while not kernels.run_window(
            self.state, self._box, self._tape.arrays, edges.times_ps, edges.levels, *asks, self._at, until_ps
        ):
            self._tape.flush(self.state.injector, 1)

    def finish(self, encoder: Record) -> int:
        """Let what is under way come to its end; return when all is settled."""
        state, path = self.state, self.path
        self._tape.flush(state.injector, 1)
        if path.motion is None:
            end_ps = stop(state, settle_ps(path), self._box, self._tape.arrays)
        else:
            moves = MotionRun(path.motion)
            moves.skip_requests()
            end_ps = moves.finish(state, settle_ps(path), self._box, self._tape.arrays)
        state.injector.requested = path.corrections  # a corrupted request is nobody's wish
        for name in ("count", "serial", "glitches"):
            state.encoder[name] = encoder[name]
        return end_ps

    def rows(self) -> NDArray[np.int64]:
        """Return what the box has driven since the last call, the row before it first."""
        self._tape.flush(self.state.injector, 1)
        return self._kept.taken()

    def result(self, end_ps: int, wall_s: float) -> OpenPathResult:
        """Return what came out, by the counts of the encoder itself."""
        return result_of_path(self.path, self.state, self.board, end_ps, wall_s)

    def watched(self, result: OpenPathResult) -> Watched:
        """Return what can be noticed, by the counts of the box, which sees the lines behind their faults."""
        path = self.path
        added = result.insertions.completed * path.injector.design.step_counts
        by_box = path.receiver.counted(self.counts_in + added, path.encoder.home_state)
        return Watched(
            illegal=result.received.illegal_transitions, illegal_in=self.illegal_in,
            agrees=result.received.count == by_box and result.insertions.ahead_counts == added,
            pending=result.pending, stopped=result.received.fault_ps is not None,
        )  # fmt: skip


class Kept:
    """Rows of a tape (`rtec.injector._wave_kernels`), kept until they are taken.

    Parameters
    ----------
    first
        Level codes of encoder and controller at the start.
    """

    done = False

    def __init__(self, first: tuple[int, int]) -> None:
        self._rows = [np.array([[0, *first, 0, 0, 0]], np.int64)]

    def show(self, rows: NDArray[np.int64]) -> None:
        """Keep rows; the first of them is the last one shown before."""
        self._rows.append(rows[1:].copy())

    def taken(self) -> NDArray[np.int64]:
        """Return the rows since the last call, int64 (n, 6); the first of them held before."""
        rows = np.concatenate(self._rows)
        self._rows = [rows[-1:]]
        return rows


def outputs_differ(right: NDArray[np.int64], wrong: NDArray[np.int64]) -> tuple[int | None, int]:
    """Return when what two boxes drive and have completed first differs, and at how many moments it does.

    Parameters
    ----------
    right, wrong
        Rows as of `rtec.injector._wave_kernels`; the first of each held before.
    """
    times = np.union1d(right[1:, TIME], wrong[1:, TIME])
    seen = [rows[np.searchsorted(rows[:, TIME], times, side="right") - 1] for rows in (right, wrong)]
    differ = times[(seen[0][:, [LEVEL_OUT, COMPLETED]] != seen[1][:, [LEVEL_OUT, COMPLETED]]).any(axis=1)]
    return (int(differ[0]) if differ.size else None), int(differ.size)


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultyResult:
    """What came out of an open path with faults."""

    result: OpenPathResult
    """By the counts of the encoder itself."""
    outcome: FaultOutcome

    @property
    def good(self) -> bool:
        """Return whether every fault took effect and the run is good all the same."""
        return self.result.good and self.outcome.activated

    def to_dict(self) -> dict[str, object]:
        """Return it under the names that scripts rely on."""
        return self.result.to_dict() | self.outcome.to_dict()


def simulate_faults(
    path: OpenPath,
    faults: Sequence[Fault],
    *,
    vcd: Path | None = None,
    seen: TraceSink | None = None,
    progress: Callable[[float], None] | None = None,
) -> FaultyResult:
    """Run the open path with one fault, or with two.

    Parameters
    ----------
    path
        The run.
    faults
        Of `rtec.machine.open_fault_kinds.OPEN_FAULTS`, as `faults_at` returns them. Those of the lines act in this
        order, from the encoder to the box.
    vcd, seen, progress
        As of `rtec.machine.simulate`; the waveform has a signal for each fault, high from its moment to its
        end, or to that of the run.

    Raises
    ------
    ArgumentError
        A fault that this box cannot have.
    OutputError
        The waveform file could not be written.

    Examples
    --------
    Box and controller see the same wrong lines, so that no comparison between them can tell:

    >>> from rtec.injector import Design, InjectorSettings, Processor, Timing
    >>> from rtec.machine.open_fault_kinds import open_fault_named
    >>> box = InjectorSettings(design=Design.C, timing=Timing.of(Design.C, Processor.FAST))
    >>> path = OpenPath(injector=box, frequency_hz=100e3, cycles=100, corrections=4)
    >>> faults = faults_at(length_ps(path), [(open_fault_named("missed edge"), 200_000_000, None)], 0)
    >>> outcome = simulate_faults(path, faults).outcome
    >>> outcome.word, outcome.off_counts, outcome.effects[0].activated_ps
    ('silent corruption', -4, 201250000)
    """
    check_possible(path, faults)
    effects = [FaultEffect(fault=fault) for fault in faults]
    source, total_ps = Source(path), length_ps(path)
    begun = time.perf_counter()
    with ExitStack() as stack:
        marks = [(word_of(one.kind), one.from_ps, one.until_ps or NEVER) for one in faults]
        initial = path.encoder.level_at_home, int(path.state().receiver.raw)
        file = None if vcd is None else stack.enter_context(WaveFile(path, vcd, initial, marks))
        whole = _Route(path, effects, [sink for sink in (file, seen) if sink is not None])
        plain = _Route(path, [])
        # the run without one of the faults of the box; the one without any fault where this is the only one
        without = {
            k: _Route(path, [other for other in effects if other is not effect]) if len(effects) > 1 else plain
            for k, effect in enumerate(effects)
            if effect.fault.kind.code in BOX_CODES
        }
        routes = [whole, plain, *(route for route in without.values() if route is not plain)]

        def compare() -> None:
            rows = {id(route): route.rows() for route in routes}
            for k, route in without.items():
                effects[k].add(outputs_differ(rows[id(route)], rows[id(whole)]))

        for window in source.windows():
            for route in routes:
                route.run(window, notes=route is whole)
            compare()
            if progress is not None:
                progress(min(window.until_ps / total_ps, 1.0))
        ends_ps = [route.finish(source.encoder) for route in routes]
        compare()
        if file is not None:
            file.finish(ends_ps[0])
    wall_s = time.perf_counter() - begun
    result, right = whole.result(ends_ps[0], wall_s), plain.result(ends_ps[1], wall_s)
    added = result.insertions.completed * path.injector.design.step_counts
    outcome = FaultOutcome(
        effects=tuple(effects),
        noticed=whole.watched(result).noticed(plain.watched(right)),
        off_counts=result.received.count
        - path.receiver.counted(result.encoder_counts + added, path.encoder.home_state),
        good_without=right.good,
        sound_without=right.audit and right.received.illegal_transitions == 0,
    )
    return FaultyResult(result=result, outcome=outcome)
