"""Streams for the hunt: drawn at random, or near another one with events aimed at what it has shown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rtec.units import PS_PER_S
from rtec.verify.contract.cases import steady, turn
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.streams import Stream, first_that_cannot_be
from rtec.verify.contract.trials import Run, Trials

MOST_EVENTS = 40
MOST_STEPS = 3
"""Between the smallest total of a stream and the largest: what lies further away at once, a box takes for a fault of
the PC (Yee 1992: a window of three steps)."""
_MOST_WAITS = 8
"""Edges of a stream that are made to wait for the axis; with more of them it is another motion."""
_NEAREST_PS = 1_000


def random_stream(trials: Trials, rng: np.random.Generator) -> Stream:
    """Draw a stream for an algorithm whose time to settle is known: a motion, and requests in it."""
    kind = rng.random()
    if kind < 0.3:
        edges = _run(trials.contract, rng)
    elif kind < 0.45:
        edges = _turn(trials.contract, rng)
    else:
        edges = _pieces(trials, rng)
    moved = [(int(t_ps), int(move)) for t_ps, move in edges[:MOST_EVENTS]]
    requests = _requests(trials, rng, [t_ps for t_ps, _ in moved])
    return possible(Stream.of(int(rng.integers(4)), moved, requests, 1), trials.contract)


def varied(run: Run, trials: Trials, rng: np.random.Generator) -> Stream:
    """Vary the stream of a run; most of the time an event is aimed at a change at the controller."""
    stream, contract = run.case.stream, trials.contract
    edges = list(zip(stream.edges_ps.tolist(), stream.moves.tolist(), strict=True))
    requests = list(zip(stream.requests_ps.tolist(), stream.totals.tolist(), strict=True))
    changes = run.response.edges.times_ps
    for _ in range(int(rng.integers(1, 3))):
        at_ps = contract.quarter_ps
        if changes.size:
            away = _log_uniform(rng, 1, 8 * contract.quarter_ps) * (1 if rng.random() < 0.6 else -1)
            at_ps = max(int(changes[int(rng.integers(changes.size))]) + away, 1)
        what = rng.random()
        if what < 0.2 and edges:  # one edge goes there
            k = int(rng.integers(len(edges)))
            edges[k] = (at_ps, edges[k][1])
        elif what < 0.4:  # over an edge, and back a while later
            direction = _sign(rng)
            back = _log_uniform(rng, contract.turn_ps, 16 * contract.turn_ps)
            edges += [(at_ps, direction), (at_ps + back, -direction)]
        elif what < 0.5:  # one more edge
            edges.append((at_ps, _sign(rng)))
        elif what < 0.6 and edges:
            edges.pop(int(rng.integers(len(edges))))
        elif what < 0.8 and requests:  # what was asked for changes there
            requests.append((at_ps, _next_total(rng, [total for _, total in requests])))
        elif what < 0.9 and requests:  # it was asked for at another time
            k = int(rng.integers(len(requests)))
            requests[k] = (max(requests[k][0] + int(rng.normal(0.0, trials.settle_ps / 4)), 1), requests[k][1])
        elif edges:  # the motion comes sooner or later than the requests
            by = _log_uniform(rng, _NEAREST_PS, trials.settle_ps) * _sign(rng)
            by = max(by, 1 - min(t for t, _ in edges))
            edges = [(t + by, move) for t, move in edges]
    return possible(_in_order(stream.state, edges[:MOST_EVENTS], requests[:MOST_EVENTS]), contract)


def possible(stream: Stream, contract: Contract) -> Stream:
    """Return a stream with its edges moved apart until an encoder can send them, or as far as that goes."""
    wait_ps = int(np.sqrt(0.5 / contract.acceleration_hz_s) * PS_PER_S) + contract.quarter_ps
    for _ in range(_MOST_WAITS):
        k = first_that_cannot_be(stream, contract)
        if k == stream.edges_ps.size:
            break
        later = stream.edges_ps.copy()
        later[k:] += wait_ps  # the first edge that comes too early waits, and all behind it
        stream = replace(stream, edges_ps=later)
    return stream


def _run(contract: Contract, rng: np.random.Generator) -> NDArray[np.int64]:
    """Draw a run at one speed, from the highest one down to a fortieth, already moving at power-up."""
    apart_ps = _log_uniform(rng, contract.quarter_ps, 40 * contract.quarter_ps)
    hertz = PS_PER_S / (4.0 * apart_ps)
    count = int(rng.integers(2, MOST_EVENTS // 2))
    shifts = rng.uniform(0.0, contract.jitter * contract.quarter_ps / apart_ps, count) if rng.random() < 0.5 else None
    first_ps = max(int(rng.uniform(0.05, 1.0) * apart_ps), 1)
    return steady(hertz, _sign(rng), count, first_ps=first_ps, jitter=shifts)


def _turn(contract: Contract, rng: np.random.Generator) -> NDArray[np.int64]:
    """Draw a turn as sharp as can be, its depth from a ten-thousandth of a count up to one."""
    return turn(contract, _sign(rng), int(rng.integers(2, 8)), depth=float(np.exp(rng.uniform(np.log(1e-4), 0.0))))


def _pieces(trials: Trials, rng: np.random.Generator) -> NDArray[np.int64]:
    """Draw pieces of motion, each with a speed of its own or trembling, and rests between them."""
    contract = trials.contract
    edges: list[tuple[int, int]] = []
    t_ps = 0
    direction = _sign(rng)
    slowest_ps = max(2 * trials.settle_ps, 100 * contract.quarter_ps)
    for _ in range(int(rng.integers(1, 4))):
        apart_ps = _log_uniform(rng, contract.quarter_ps, slowest_ps)
        trembles = rng.random() < 0.4
        for _ in range(int(rng.integers(1, 9))):
            if trembles:
                gap = _log_uniform(rng, contract.turn_ps, max(apart_ps, 2 * contract.turn_ps))
                direction = -direction
            else:
                gap = round(apart_ps * (1.0 + rng.uniform(-0.5, 0.5) * contract.jitter))
            t_ps += gap
            edges.append((t_ps, direction))
        if rng.random() < 0.5:
            direction = -direction
        if rng.random() < 0.6:
            t_ps += int(rng.uniform(0.0, trials.settle_ps))
    return np.array(edges, np.int64)


def _requests(trials: Trials, rng: np.random.Generator, edges_ps: list[int]) -> list[tuple[int, int]]:
    """Draw requests: the first anywhere or shortly before an edge, others at times of all sizes behind it."""
    if rng.random() < 0.5:
        at_ps = int(rng.uniform(1, edges_ps[-1] + 1))
    else:
        at_ps = edges_ps[int(rng.integers(len(edges_ps)))] - _log_uniform(rng, _NEAREST_PS, trials.settle_ps)
    at_ps = max(at_ps, 1)
    requests = [(at_ps, _sign(rng))]
    for _ in range(int(rng.integers(4))):
        at_ps += _log_uniform(rng, _NEAREST_PS, 2 * trials.settle_ps)
        requests.append((at_ps, _next_total(rng, [total for _, total in requests])))
    return requests


def _next_total(rng: np.random.Generator, totals: list[int]) -> int:
    seen = [0, *totals]
    lowest, highest = max(seen) - MOST_STEPS, min(seen) + MOST_STEPS
    if rng.random() < 0.7:
        step = _sign(rng)
        total = totals[-1] + (step if lowest <= totals[-1] + step <= highest else -step)
    else:
        total = int(rng.integers(lowest, highest + 1))
    return total


def _log_uniform(rng: np.random.Generator, low: int, high: int) -> int:
    return int(np.exp(rng.uniform(np.log(low), np.log(max(high, low + 1)))))


def _sign(rng: np.random.Generator) -> int:
    return 1 if rng.random() < 0.5 else -1


def _in_order(state: int, edges: list[tuple[int, int]], requests: list[tuple[int, int]]) -> Stream:
    """Return a stream of events in any order; of two at one time the first stays."""
    moved = sorted({t: (t, move) for t, move in reversed(edges)}.values())
    asked = sorted({t: (t, total) for t, total in reversed(requests)}.values())
    return Stream.of(state, moved, asked, 1)
