"""The hunt for the stream that breaks an algorithm: at random, then where the margin is smallest; then cut short."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rtec.conformance.contract import Contract
from rtec.conformance.judge import Fault
from rtec.conformance.streams import Stream, can_be, first_that_cannot_be
from rtec.conformance.trials import Case, Run, Trials
from rtec.units import PS_PER_S

_AT_RANDOM = 0.3
"""Share of the tries before the smallest margins lead."""
_KEPT = 24
"""Streams of smallest margin from which the next ones are made."""
_AT_ONCE = 16
_MOST_EVENTS = 40
_MOST_STEPS = 1
"""That a request lies from zero: where it changes by more at once, a box may take it for a fault of the PC."""
_MOST_WAITS = 8
"""Edges of a stream that are made to wait for the axis; with more of them it is another motion."""
_ROUND_PS = (1_000_000, 100_000, 10_000, 1_000)
"""Times are cut to multiples of these where the stream still breaks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hunted:
    """What a hunt has brought.

    Parameters
    ----------
    worst
        The shortest run found that breaks the contract, or None.
    made
        Runs made on the hunt.
    cut
        Runs made to cut it short.
    """

    worst: Run | None
    made: int
    cut: int


def hunt(
    trials: Trials, *, tries: int = 3000, seed: int = 0, progress: Callable[[float], None] = lambda share: None
) -> Hunted:
    """Look for a stream that breaks an algorithm.

    Parameters
    ----------
    trials
        The algorithm, with its time to settle measured.
    tries
        Runs that may be made.
    seed
        Of the random choices: the same hunt finds the same stream.
    progress
        Called with the share done.

    Notes
    -----
    The first third of the streams is drawn at random: from short motions, a trembling axis, turns and requests at
    times of all sizes between the shortest distance and the algorithm's own. After it, the streams whose runs came
    nearest to a fault (smallest separation, longest delay, most changes) are varied, and an event moves to where
    something has changed at the controller: into the insertion, whenever the algorithm makes it.

    Examples
    --------
    Gates alone, as the report first draws them, merge a real edge with an insertion:

    >>> from rtec.conformance.built_in import BuiltIn
    >>> from rtec.injector import Design, InjectorSettings, Processor, Timing
    >>> box = BuiltIn(InjectorSettings(design=Design.A, timing=Timing.of(Design.A, Processor.FAST)))
    >>> trials = Trials(box, Contract.of(Design.A))
    >>> trials.measure_settling(), len(hunt(trials).worst.case.stream) <= 3
    (None, True)
    """
    rng = np.random.default_rng(seed)
    kept: list[tuple[float, Run]] = []
    begun, made = trials.made, 0
    while made < tries:
        guided = made >= _AT_RANDOM * tries and kept
        streams = [
            _varied(kept[int(rng.integers(len(kept)))][1], trials, rng) if guided else _drawn(trials, rng)
            for _ in range(_AT_ONCE)
        ]
        cases = [_case(trials, stream) for stream in streams if can_be(stream, trials.contract)]
        made += _AT_ONCE
        for run in trials.all_of(cases):
            if not run.right:
                worst, cut = shortened(trials, run)
                return Hunted(worst=worst, made=trials.made - begun - cut, cut=cut)
            kept.append((_score(run, trials.contract), run))
        kept = sorted(kept, key=lambda pair: pair[0])[:_KEPT]
        progress(made / tries)
    return Hunted(worst=None, made=trials.made - begun, cut=0)


def shortened(trials: Trials, run: Run, *, tries: int = 2000) -> tuple[Run, int]:
    """Cut the stream of a run that breaks the contract as short as it goes.

    Parameters
    ----------
    trials
        The algorithm.
    run
        That breaks the contract; an end of its own is kept where the fault needs it.
    tries
        Runs that may be made.

    Returns
    -------
    run
        With the fewest events found, and the roundest times; the fault is of the same kind.
    made
        Runs made.
    """
    begun = trials.made
    fault = run.judgement.violation.fault if run.judgement.violation else None
    if fault is None or (fault is Fault.BROKEN and "within" in str(run.judgement.violation)):
        return run, 0  # one that does not come back costs seconds a run
    moved = True
    while moved and trials.made - begun < tries:
        moved = False
        for shorter in _shorter(run.case.stream, trials.contract):
            if trials.made - begun >= tries:
                break
            if not can_be(shorter, trials.contract):
                continue
            again = trials.one(replace(_case(trials, shorter), must_finish=_finishes(trials, shorter)))
            if again.judgement.violation is not None and again.judgement.violation.fault is fault:
                run, moved = again, True
                break
    violation = run.judgement.violation
    if violation is not None and fault is not Fault.UNFINISHED:
        ended = replace(run.case.stream, until_ps=max(violation.time_ps, run.case.stream.last_ps) + trials.settle_ps)
        again = trials.one(replace(run.case, stream=ended, must_finish=False))
        run = again if again.judgement.violation is not None else run
    return run, trials.made - begun


def _case(trials: Trials, stream: Stream) -> Case:
    return replace(trials.case("a stream of the hunt", stream), must_finish=_finishes(trials, stream))


def _finishes(trials: Trials, stream: Stream) -> bool:
    return stream.final_state in trials.contract.states


def _score(run: Run, contract: Contract) -> float:
    """Return how far a run is from a fault, the smaller the nearer."""
    seen = run.judgement
    apart = 10.0 if seen.separation_ps is None else seen.separation_ps / max(contract.separation_ps, 1)
    behind = seen.delay_ps / contract.delay_ps
    return apart - behind - 0.01 * min(len(run.response.edges), _MOST_EVENTS)


# --- streams at random ---
def _drawn(trials: Trials, rng: np.random.Generator) -> Stream:
    """Draw a stream: pieces of motion, with requests between them."""
    contract = trials.contract
    edges: list[tuple[int, int]] = []
    t_ps = contract.quarter_ps
    direction = 1 if rng.random() < 0.5 else -1
    slowest_ps = max(2 * trials.settle_ps, 100 * contract.quarter_ps)
    for _ in range(int(rng.integers(1, 4))):
        apart_ps = int(np.exp(rng.uniform(np.log(contract.quarter_ps), np.log(slowest_ps))))
        count = int(rng.integers(1, 9))
        trembles = rng.random() < 0.4
        for _ in range(count):
            if trembles:
                gap = int(np.exp(rng.uniform(np.log(contract.turn_ps), np.log(max(apart_ps, 2 * contract.turn_ps)))))
                direction = -direction
            else:
                gap = round(apart_ps * (1.0 + rng.uniform(-0.5, 0.5) * contract.jitter))
            t_ps += gap
            edges.append((t_ps, direction))
        if rng.random() < 0.5:
            direction = -direction
        if rng.random() < 0.6:
            t_ps += int(rng.uniform(0.0, trials.settle_ps))
    requests: list[tuple[int, int]] = []
    total = 0
    for at in np.sort(rng.uniform(1, t_ps + 1, int(rng.integers(1, 4)))).astype(np.int64).tolist():
        total = int(rng.choice([other for other in (-1, 0, 1) if other != total]))
        if not requests or at > requests[-1][0]:
            requests.append((at, total))
    return _possible(Stream.of(int(rng.integers(4)), edges, requests, 1), contract)


def _possible(stream: Stream, contract: Contract) -> Stream:
    """Move edges apart until an encoder can send them."""
    wait_ps = int(np.sqrt(0.5 / contract.acceleration_hz_s) * PS_PER_S) + contract.quarter_ps
    for _ in range(_MOST_WAITS):
        k = first_that_cannot_be(stream, contract)
        if k == stream.edges_ps.size:
            break
        later = stream.edges_ps.copy()
        later[k:] += wait_ps  # the first edge that comes too early waits, and all behind it
        stream = replace(stream, edges_ps=later)
    return stream


# --- streams near others ---
def _varied(run: Run, trials: Trials, rng: np.random.Generator) -> Stream:
    """Vary a stream; most of the time an event is aimed at a change at the controller."""
    stream, contract = run.case.stream, trials.contract
    edges = list(zip(stream.edges_ps.tolist(), stream.moves.tolist(), strict=True))
    requests = list(zip(stream.requests_ps.tolist(), stream.totals.tolist(), strict=True))
    for _ in range(int(rng.integers(1, 3))):
        changes = run.response.edges.times_ps
        at_ps = contract.quarter_ps
        if changes.size:
            away = int(np.exp(rng.uniform(0.0, np.log(8 * contract.quarter_ps)))) * (1 if rng.random() < 0.6 else -1)
            at_ps = max(int(changes[int(rng.integers(changes.size))]) + away, 1)
        what = rng.random()
        if what < 0.25 and edges:  # one edge goes there
            k = int(rng.integers(len(edges)))
            edges[k] = (at_ps, edges[k][1])
        elif what < 0.5:  # over an edge, and back a while later
            direction = 1 if rng.random() < 0.5 else -1
            back = int(np.exp(rng.uniform(np.log(contract.turn_ps), np.log(16 * contract.turn_ps))))
            edges += [(at_ps, direction), (at_ps + back, -direction)]
        elif what < 0.6:  # one more edge
            edges.append((at_ps, 1 if rng.random() < 0.5 else -1))
        elif what < 0.7 and edges:
            edges.pop(int(rng.integers(len(edges))))
        elif what < 0.85 and requests:  # what was asked for changes there
            requests.append((at_ps, int(rng.integers(-_MOST_STEPS, _MOST_STEPS + 1))))
        elif requests:  # it was asked for at another time
            k = int(rng.integers(len(requests)))
            requests[k] = (max(requests[k][0] + int(rng.normal(0.0, trials.settle_ps / 4)), 1), requests[k][1])
    return _possible(_in_order(stream.state, edges[:_MOST_EVENTS], requests[:_MOST_EVENTS]), contract)


def _in_order(state: int, edges: list[tuple[int, int]], requests: list[tuple[int, int]]) -> Stream:
    """Return a stream of events in any order; of two at one time the first stays."""
    moved = sorted({t: (t, move) for t, move in reversed(edges)}.values())
    asked = sorted({t: (t, total) for t, total in reversed(requests)}.values())
    return Stream.of(state, moved, asked, 1)


# --- shorter ones ---
def _shorter(stream: Stream, contract: Contract) -> Iterator[Stream]:
    """Yield streams with less in them, the boldest cuts first, then with rounder times."""
    yield from _without_edges(stream)
    yield from _without_requests(stream)
    yield from _sooner(stream, contract)
    yield from _rounder(stream)


def _without_edges(stream: Stream) -> Iterator[Stream]:
    size = stream.edges_ps.size
    cut = size
    while cut:
        for begin in range(0, size, cut):
            yield _keeping(stream, np.r_[0:begin, min(begin + cut, size) : size])
        cut //= 2
    for k in range(size - 1):  # over and back leaves the state as it was
        if stream.moves[k] != stream.moves[k + 1]:
            yield _keeping(stream, np.r_[0:k, k + 2 : size])


def _keeping(stream: Stream, places: NDArray[np.int64]) -> Stream:
    places = places.astype(np.int64)
    ends = int(stream.moves.sum() - stream.moves[places].sum())
    begins = stream.state
    if places.size and places[0] > 0 and places[-1] == stream.moves.size - 1:  # its beginning is cut: ends as before
        begins = (stream.state + ends) % 4
    return replace(stream, state=begins, edges_ps=stream.edges_ps[places], moves=stream.moves[places])


def _without_requests(stream: Stream) -> Iterator[Stream]:
    for k in range(stream.requests_ps.size):
        yield replace(stream, requests_ps=np.delete(stream.requests_ps, k), totals=np.delete(stream.totals, k))


def _sooner(stream: Stream, contract: Contract) -> Iterator[Stream]:
    """Yield streams in which everything from an event on comes sooner, so that long rests go."""
    times = sorted({*stream.edges_ps.tolist(), *stream.requests_ps.tolist()})
    before = 0
    for t in times:
        rest = t - before
        least = contract.quarter_ps
        for share in (0.0, 0.5, 0.9):
            by = rest - max(round(rest * share), least)
            if by > rest // 20 and by > 0:
                yield replace(
                    stream,
                    edges_ps=stream.edges_ps - by * (stream.edges_ps >= t),
                    requests_ps=stream.requests_ps - by * (stream.requests_ps >= t),
                )
        before = t


def _rounder(stream: Stream) -> Iterator[Stream]:
    for places in ("edges_ps", "requests_ps"):
        times = getattr(stream, places)
        for k in range(times.size):
            for grain in _ROUND_PS:
                for rounded in (times[k] // grain * grain, -(-times[k] // grain) * grain):
                    if times[k] % grain and rounded >= 1 and not (times % grain == 0)[k]:
                        other = times.copy()
                        other[k] = rounded
                        if np.all(np.diff(other) > 0):
                            yield replace(stream, **{places: other})
