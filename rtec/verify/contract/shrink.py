"""A stream that breaks an algorithm, cut as short as it goes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import islice, takewhile

import numpy as np
from numpy.typing import NDArray

from rtec.verify.contract.judge import Fault
from rtec.verify.contract.streams import Stream, can_be
from rtec.verify.contract.trials import Case, Run, Trials

_AT_ONCE = 8
_LONG = 1_000
"""Events and steps of a run that is cut at the fault before anything else."""
_BUDGET, _RUN = 1_500_000, 700
"""Events and steps of all runs together, and what each run costs beside its own: those of 30 000 steps take a second
each where an algorithm is simulated."""
_LOOKS = 16
"""At a stream, for the price of playing it."""
_ROUND_PS = (10_000_000, 1_000_000, 100_000, 10_000, 1_000)
"""Times are cut to multiples of these where the stream still breaks."""


def shrink(trials: Trials, run: Run) -> tuple[Run, int]:
    """Cut the stream of a run that breaks the contract as short as it goes.

    Returns
    -------
    run
        With the fewest events found, and the roundest times; the fault is of the same kind.
    made
        Runs made.

    Examples
    --------
    Wires alone complete no step; neither edges nor times matter for that:

    >>> from rtec.verify.contract.contract import Contract
    >>> from rtec.injector import Response, Totals
    >>> class Wires:
    ...     def play(self, stimuli):
    ...         return [Response(edges=stimulus.edges, completed=Totals()) for stimulus in stimuli]
    >>> trials = Trials(Wires(), Contract(step_counts=2))
    >>> run = trials.one(trials.case("motion", Stream.read("00 1.234us:+ 1.987us:r1 2.5us:+ 9us:end")))
    >>> print(shrink(trials, run)[0].case.stream)
    11 10us:r1 410us:end
    """
    begun = trials.made
    fault = run.fault
    if fault is None or (run.response.broken is not None and run.response.broken.ended):
        return run, 0  # a start for each try would take minutes
    if _size(run.case.stream) > _LONG:
        run = next((again for again in map(trials.one, _up_to_the_fault(run, trials)) if again.fault is fault), run)
    run = _cut(trials, run, lambda again: again.fault is fault, _BUDGET)
    violation = run.judgement.violation
    if violation is not None and fault is not Fault.UNFINISHED:
        ended = replace(run.case.stream, until_ps=max(violation.time_ps, run.case.stream.last_ps) + trials.settle_ps)
        again = trials.one(replace(run.case, stream=ended, must_finish=False))
        run = again if again.fault is fault else run
    return run, trials.made - begun


def narrowest(trials: Trials, run: Run) -> Run:
    """Cut the stream of a run that is right, as long as A and B come as near to each other at the controller."""
    least_ps = run.judgement.separation_ps

    def keeps(again: Run) -> bool:
        seen_ps = again.judgement.separation_ps
        return again.right and least_ps is not None and seen_ps is not None and seen_ps <= least_ps

    return _cut(trials, run, keeps, _BUDGET // 4)


def _cut(trials: Trials, run: Run, keeps: Callable[[Run], bool], budget: int) -> Run:
    """Cut the stream of a run as short as it goes, then its times as round, while it keeps what matters."""
    moved = True
    left = _Left(budget)
    while moved:
        moved = False
        for way in (_without_beginning, _without_events, _nearer_to_zero, _sooner):
            while (found := _first_that_keeps(trials, run, way, keeps, left)) is not None:
                run, moved = found, True
    while (found := _first_that_keeps(trials, run, _rounder, keeps, left)) is not None:
        run = found
    return run


@dataclass(slots=True)
class _Left:
    """How far the cutting may go."""

    events: int

    def spend(self, events: int) -> bool:
        """Return whether there is anything left."""
        self.events -= events
        return self.events > 0


def _size(stream: Stream) -> int:
    """Return how many events a run has, and steps."""
    return len(stream) + int(np.abs(np.diff(stream.totals, prepend=0)).sum())


def _up_to_the_fault(run: Run, trials: Trials) -> Iterator[Case]:
    """Yield the case with nothing behind the fault, and no total far beyond those that were completed until then."""
    stream, violation = run.case.stream, run.judgement.violation
    if violation is None:
        return
    done = run.response.completed
    until = done.totals[done.times_ps < violation.time_ps]
    edges, asked = stream.edges_ps <= violation.time_ps, stream.requests_ps <= violation.time_ps
    for more in (1, 2):
        low, high = int(until.min(initial=0)) - more, int(until.max(initial=0)) + more
        cut = replace(
            stream, edges_ps=stream.edges_ps[edges], moves=stream.moves[edges], requests_ps=stream.requests_ps[asked],
            totals=np.clip(stream.totals[asked], low, high),
        )  # fmt: skip
        yield trials.case(run.case.title, cut)


def _first_that_keeps(
    trials: Trials,
    run: Run,
    way: Callable[[Stream, Trials], Iterable[Stream]],
    keeps: Callable[[Run], bool],
    left: _Left,
) -> Run | None:
    """Return the first of the streams that a way makes of a run's that keeps what matters."""
    looked_at = takewhile(lambda stream: left.spend(len(stream) // _LOOKS), way(run.case.stream, trials))
    cases = (trials.case(run.case.title, stream) for stream in looked_at if can_be(stream, trials.contract))
    at_once = _AT_ONCE if _size(run.case.stream) < _LONG else 1
    while left.events > 0 and (some := list(islice(cases, at_once))):
        left.spend(sum(_RUN + _size(case.stream) for case in some))
        for again in trials.all_of(some):
            if keeps(again):
                return again
    return None


def _without_events(stream: Stream, _: Trials) -> Iterator[Stream]:
    size = stream.edges_ps.size
    for rest in _without_pieces(size):
        yield _keeping(stream, rest)
    for k in range(size - 1):  # over and back leaves the state as it was
        if stream.moves[k] != stream.moves[k + 1]:
            yield _keeping(stream, np.r_[0:k, k + 2 : size])
    for rest in _without_pieces(stream.requests_ps.size):
        yield replace(stream, requests_ps=stream.requests_ps[rest], totals=stream.totals[rest])


def _without_pieces(size: int) -> Iterator[NDArray[np.int64]]:
    """Yield the places that are left without all, each half, each quarter, and so on."""
    cut = size
    while cut:
        for begin in range(0, size, cut):
            yield np.r_[0:begin, min(begin + cut, size) : size]
        cut //= 2


def _without_beginning(stream: Stream, _: Trials) -> Iterator[Stream]:
    """Yield streams that begin with a later edge, at the time of the first, or have none and stay where they end."""
    size = stream.edges_ps.size
    if size:
        nothing = np.zeros(0, np.int64)
        yield replace(stream, state=stream.final_state, edges_ps=nothing, moves=nothing)
    for k in sorted({size // 2, size // 4, size // 8, 1} - {0}, reverse=True):
        if k < size:
            by = int(stream.edges_ps[k] - stream.edges_ps[0])
            requests_ps = np.maximum(stream.requests_ps - by, 1)
            if np.all(np.diff(requests_ps) > 0):
                later = _keeping(stream, np.arange(k, size))
                yield replace(later, edges_ps=later.edges_ps - by, requests_ps=requests_ps)


def _keeping(stream: Stream, places: NDArray[np.int64]) -> Stream:
    ends = int(stream.moves.sum() - stream.moves[places].sum())
    begins = stream.state
    if places.size and places[0] > 0 and places[-1] == stream.moves.size - 1:  # its beginning is cut: ends as before
        begins = (stream.state + ends) % 4
    return replace(stream, state=begins, edges_ps=stream.edges_ps[places], moves=stream.moves[places])


def _nearer_to_zero(stream: Stream, _: Trials) -> Iterator[Stream]:
    for k in range(stream.totals.size):
        by = abs(int(stream.totals[k])) // 2
        while by:
            totals = stream.totals.copy()
            totals[k] -= by * np.sign(totals[k])
            yield replace(stream, totals=totals)
            by //= 2


def _sooner(stream: Stream, trials: Trials) -> Iterator[Stream]:
    """Yield streams in which everything from an event on comes sooner, so that long rests go."""
    least = trials.contract.quarter_ps
    before = 0
    for t in sorted({*stream.edges_ps.tolist(), *stream.requests_ps.tolist()}):
        rest = t - before
        for share in (0.0, 0.5, 0.9):
            by = rest - max(round(rest * share), least)
            if by > rest // 20 and by > 0:
                yield replace(
                    stream,
                    edges_ps=stream.edges_ps - by * (stream.edges_ps >= t),
                    requests_ps=stream.requests_ps - by * (stream.requests_ps >= t),
                )
        before = t


def _rounder(stream: Stream, _: Trials) -> Iterator[Stream]:
    """Yield streams with one time rounder than it is, the roundest first."""
    for places in ("edges_ps", "requests_ps"):
        times = getattr(stream, places)
        for k in range(times.size):
            for grain in _ROUND_PS:
                if times[k] % grain == 0:
                    break
                for rounded in (times[k] // grain * grain, -(-times[k] // grain) * grain):
                    other = times.copy()
                    other[k] = rounded
                    if rounded >= 1 and np.all(np.diff(other) > 0):
                        yield replace(stream, **{places: other})
