"""The cases of each check: at rest, in steady motion, through reversals, dithering, with requests that change."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec.readable import hertz_text
from rtec.units import PS_PER_S
from rtec.verify.contract.contract import STATES, Contract
from rtec.verify.contract.streams import Stream
from rtec.verify.contract.trials import Case, Trials

GOLDEN = 0.618_033_988_749_895
"""Multiples of it, modulo 1, fill an interval evenly however many there are."""

_SIGNS = ((1, 1), (1, -1), (-1, 1), (-1, -1))
"""Direction of the motion and sign of the step."""
_FEW_EDGES, _MANY_EDGES = 24, 40_000
_SLOW_EDGES, _DRIFT_PS = 300, 150_000_000_000
_ANOTHER = 7
"""Times a phase, modulo 1, is one that does not go with it."""
_SPEEDS = (1.0, 0.7, 0.4, 0.2, 0.1, 0.05, 0.02, 0.01, 0.001)
"""Shares of the highest frequency."""
_WINDOW_PHASES = 24
"""Moments of an insertion that edges are aimed at; a fifth of it lies before and behind."""


def steady(
    frequency_hz: float, direction: int, edges: int, *, first_ps: int, jitter: NDArray[np.float64] | None = None
) -> NDArray[np.int64]:
    """Return edges at constant speed as (time, move), shape (edges, 2).

    Parameters
    ----------
    frequency_hz
        Of the square waves.
    jitter
        Shift of each edge in shares of the distance, shape (edges,).

    Examples
    --------
    >>> steady(500e3, -1, 3, first_ps=1_000_000).tolist()
    [[1000000, -1], [1500000, -1], [2000000, -1]]
    """
    places = np.arange(edges) + (0.0 if jitter is None else jitter - jitter.min())
    times = first_ps + np.rint(places * (PS_PER_S / (4.0 * frequency_hz))).astype(np.int64)
    return np.stack([times, np.full(edges, direction, np.int64)], axis=1)


def turn(contract: Contract, direction: int, edges: int, *, depth: float) -> NDArray[np.int64]:
    """Return a turn as sharp as a contract allows, as (time, move), shape (2 * edges, 2).

    Parameters
    ----------
    contract
        Its acceleration holds throughout, up to the highest frequency.
    direction, edges
        Before the turn, and on each side of it.
    depth
        How far behind the last edge it lies, in counts, 0..1; this edge comes again after ``turn_ps`` at least.

    Examples
    --------
    A turn a hundredth of a count behind an edge sends this edge twice within 14 us:

    >>> turn(Contract(step_counts=2), 1, 2, depth=0.01).tolist()
    [[500000, 1], [64492284, 1], [78634420, -1], [142626704, -1]]
    """
    gain = contract.acceleration_hz_s
    away = _leaving_s(contract, np.arange(edges) + max(depth, gain * (contract.turn_ps / PS_PER_S) ** 2 / 2.0))
    times = np.rint(np.concatenate([-away[::-1], away]) * PS_PER_S).astype(np.int64)
    return np.stack([times - times[0] + contract.quarter_ps, np.repeat([direction, -direction], edges)], axis=1)


def start(contract: Contract, direction: int, edges: int, *, depth: float) -> NDArray[np.int64]:
    """Return a start from rest as sharp as a contract allows, as (time, move), shape (edges, 2).

    Parameters
    ----------
    depth
        How far before the first edge the axis rests, in counts, 0..1; it begins to move at time 0.

    Examples
    --------
    >>> start(Contract(step_counts=2), 1, 2, depth=0.01).tolist()
    [[7071068, 1], [71063352, 1]]
    """
    times = np.rint(_leaving_s(contract, np.arange(edges) + depth) * PS_PER_S).astype(np.int64)
    return np.stack([times, np.full(edges, direction, np.int64)], axis=1)


def _leaving_s(contract: Contract, counts: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """Return how long after a standstill an axis is so many counts away, under the acceleration of a contract."""
    hertz, gain = contract.frequency_hz, contract.acceleration_hz_s
    full = 2.0 * hertz**2 / gain  # counts within which the highest frequency is reached
    gaining = np.sqrt(np.minimum(counts, full) / (2.0 * gain))
    return np.where(counts < full, gaining, hertz / gain + (counts - full) / (4.0 * hertz))


def _to_inserting(contract: Contract, edges: NDArray[np.int64]) -> int:
    """Return the state at power-up from which the motion ends where the algorithm inserts."""
    return int(contract.states[0] - edges[:, 1].sum()) % 4


def running(trials: Trials) -> Iterator[Case]:
    """Yield power-up in each state, then a few slow edges either way."""
    slow_hz = trials.contract.frequency_hz / 1000.0
    first_ps = round(PS_PER_S / (4.0 * slow_hz))
    for state in range(4):
        yield trials.case(f"power-up in state {state + 1}", Stream.of(state, (), (), 1))
        for direction in (1, -1):
            edges = steady(slow_hz, direction, 9, first_ps=first_ps)
            yield trials.case(f"nine slow edges from state {state + 1}", Stream.of(state, edges, (), 1))


def passing(trials: Trials) -> Iterator[Case]:
    """Yield motion up to the highest frequency, with jitter and turns, and nothing asked for."""
    contract = trials.contract
    rng = np.random.default_rng(1)
    for index, (share, direction, state) in enumerate(product(_SPEEDS, (1, -1), range(4))):
        hertz = share * contract.frequency_hz
        first_ps = 1 + round((index * GOLDEN % 1.0) * contract.quarter_ps)
        shifts = rng.uniform(0.0, share * contract.jitter, _FEW_EDGES * 4) if index % 2 else None
        edges = steady(hertz, direction, _FEW_EDGES * 4, first_ps=first_ps, jitter=shifts)
        yield trials.case(f"{hertz_text(hertz)}{_way(direction)}, nothing asked for", Stream.of(state, edges, (), 1))
    for direction, depth in product((1, -1), np.geomspace(1e-4, 1.0, 12)):
        edges = turn(contract, direction, _FEW_EDGES, depth=depth)
        yield trials.case("a turn, nothing asked for", Stream.of(0, edges, (), 1))


def at_rest(trials: Trials) -> Iterator[Case]:
    """Yield one step and two, taken back again, in each state; where it waits, the axis moves on to another state."""
    contract = trials.contract
    first_ps = contract.quarter_ps
    for state, sign in product(range(4), (1, -1)):
        if state in contract.states:
            asked = Stream.of(state, (), [(first_ps, sign)], 1)
            yield trials.case(f"{sign:+d} step at rest in state {STATES[state]}", asked)
            away = first_ps + 2 * trials.settle_ps
            back = asked.asking((first_ps, sign), (away, 2 * sign), (away + 2 * trials.settle_ps, 0))
            yield trials.case(f"two steps of {sign:+d} and back at rest in state {STATES[state]}", back)
            continue
        for direction in (1, -1):
            edges = steady(contract.frequency_hz / 1000.0, direction, 4, first_ps=first_ps + trials.settle_ps)
            to = next(k for k in range(1, 5) if (state + direction * k) % 4 in contract.states)
            moved = Stream.of(state, edges[:to], [(first_ps, sign)], 1)
            yield trials.case(f"{sign:+d} step in state {STATES[state]}, then a move to another", moved)


def in_motion(trials: Trials, frequencies_hz: Sequence[float] = (), phases: int = 8) -> Iterator[Case]:
    """Yield a step during steady motion: each speed, direction and sign, at many phases between edge and request."""
    contract = trials.contract
    for hertz in frequencies_hz or [share * contract.frequency_hz for share in _SPEEDS]:
        for phase, (direction, sign) in product(range(phases), _SIGNS):
            yield step_in_motion(trials, hertz, direction, sign, (0.5 + phase * GOLDEN) % 1.0)


def aimed_in_motion(trials: Trials, hertz: float, moments_ps: Sequence[int]) -> Iterator[Case]:
    """Yield a step during steady motion whose request comes so long before an edge, each direction and sign."""
    quarter_ps = PS_PER_S / (4.0 * hertz)
    for before_ps, (direction, sign) in product(moments_ps, _SIGNS):
        yield step_in_motion(trials, hertz, direction, sign, -before_ps / quarter_ps % 1.0)


def moments_of_insertion(trials: Trials) -> list[int]:
    """Return moments inside an insertion at rest, in ps from its request; none where nothing is inserted there."""
    _, window = trials.at_rest(trials.contract.states[0], 1)
    if window is None:
        return []
    return [round(window[0] + share * (window[1] - window[0])) - trials.asked_ps for share in (0.1, 0.5, 0.9)]


def step_in_motion(trials: Trials, hertz: float, direction: int, sign: int, phase: float) -> Case:
    """Return a step during steady motion; the axis halts where the algorithm inserts."""
    quarter_ps = round(PS_PER_S / (4.0 * hertz))
    # a program that looks in a rhythm of its own may meet slow edges in one phase for long, until the two drift apart
    slow = hertz <= trials.contract.frequency_hz / 100.0
    least = int(np.clip(_DRIFT_PS // quarter_ps, _FEW_EDGES, _SLOW_EDGES)) if slow else _FEW_EDGES
    count = int(np.clip(2 * trials.settle_ps // quarter_ps, least, _MANY_EDGES))
    # a clock of the algorithm's own meets the edges of round frequencies in the same phase for ever: another one each
    first_ps = quarter_ps - round(_ANOTHER * phase % 1.0 * (quarter_ps - 1))
    edges = steady(hertz, direction, count, first_ps=first_ps)
    ask_ps = int(edges[count // 3, 0]) + round(phase * quarter_ps)
    stream = Stream.of(_to_inserting(trials.contract, edges), edges, [(ask_ps, sign)], 1)
    return trials.case(f"{sign:+d} step at {hertz_text(hertz)}{_way(direction)}", stream)


def jittering(trials: Trials) -> Iterator[Case]:
    """Yield a step at the highest frequency and at half of it, with edges that jitter."""
    contract = trials.contract
    rng = np.random.default_rng(2)
    for index, (share, (direction, sign)) in enumerate(product((1.0, 0.5), _SIGNS * 6)):
        plain = step_in_motion(trials, share * contract.frequency_hz, direction, sign, index * GOLDEN % 1.0)
        shifts = rng.uniform(0.0, contract.jitter * contract.quarter_ps, plain.stream.edges_ps.size)
        yield shaken(trials, plain, shifts)


def shaken(trials: Trials, plain: Case, shifts_ps: NDArray[np.floating[Any]]) -> Case:
    """Return a case whose edges come later by whole picoseconds."""
    stream = replace(plain.stream, edges_ps=plain.stream.edges_ps + shifts_ps.astype(np.int64))
    return replace(plain, title=f"{plain.title}, with jitter", stream=trials.settled(stream))


def reversing(trials: Trials) -> Iterator[Case]:
    """Yield edges and turns at every moment of an insertion, one way and over and back."""
    contract = trials.contract
    for state, sign, base, window in _insertions(trials):
        for at_ps, direction in product(_moments(window), (1, -1)):
            if at_ps < 1:
                continue
            title = f"{sign:+d} step in state {STATES[state]}, the axis"
            edge = [(at_ps, direction)]
            yield trials.case(f"{title} creeps over an edge", base.stream.moving(edge))
            back = [*edge, (at_ps + contract.turn_ps, -direction)]
            yield trials.case(f"{title} goes over an edge and back", base.stream.moving(back))
    yield from turning(trials, contract)


def turning(trials: Trials, contract: Contract, depths: Sequence[float] = (0.0005, 0.02, 0.3, 1.0)) -> Iterator[Case]:
    """Yield turns under the acceleration of a contract, with an insertion at every moment of them."""
    for direction, sign, depth in product((1, -1), (1, -1), depths):
        edges = turn(contract, direction, 6, depth=depth)
        state = _to_inserting(contract, edges)
        for edge_ps in edges[3:9, 0].tolist():
            base = Stream.of(state, edges, [(edge_ps, sign)], 1)
            window = trials.window(trials.case("a turn", base))
            if window is None:
                continue
            # the request comes earlier, so that the edge falls into the insertion
            for shift_ps in sorted({round(at) - edge_ps for at in _moments(window)[::2]}):
                if edge_ps - shift_ps >= 1:
                    yield trials.case(f"{sign:+d} step in a turn", base.asking((edge_ps - shift_ps, sign)))


def starting(trials: Trials, contract: Contract) -> Iterator[Case]:
    """Yield starts under the acceleration of a contract, with edges at every moment of an insertion at rest."""
    for state, sign, base, window in _insertions(trials):
        for at_ps, direction, depth, which in product(_moments(window), (1, -1), (1e-4, 1.0), (0, 2)):
            edges = start(contract, direction, 12, depth=depth)
            edges[:, 0] += at_ps - edges[which, 0]
            if edges[0, 0] >= 1:
                stream = base.stream.moving(edges)
                yield trials.case(f"{sign:+d} step in state {STATES[state]}, the axis starts", stream)


def dithering(trials: Trials) -> Iterator[Case]:
    """Yield an axis that trembles over one edge while steps are asked for."""
    contract = trials.contract
    rng = np.random.default_rng(3)
    for state, sign, direction, scale in product(range(4), (1, -1), (1, -1), (1, 4, 30, 400)):
        apart = rng.integers(contract.turn_ps, contract.turn_ps * (scale + 1), 2 * _FEW_EDGES)
        times = contract.quarter_ps + np.cumsum(apart)
        moves = np.where(np.arange(times.size) % 2 == 0, direction, -direction)
        ask_ps = int(times[times.size // 3]) + int(rng.integers(0, contract.turn_ps * scale))
        stream = Stream.of(state, np.stack([times, moves], axis=1), [(ask_ps, sign)], 1)
        yield trials.case(f"{sign:+d} step while the axis trembles from state {STATES[state]}", stream)


def asking(trials: Trials) -> Iterator[Case]:
    """Yield requests that change at every moment of an insertion, at rest and in motion."""
    moving = [step_in_motion(trials, trials.contract.frequency_hz / 50.0, 1, sign, 0.5) for sign in (1, -1)]
    in_motion = [(base, window) for base in moving if (window := trials.window(base)) is not None]
    for base, window in chain(((base, window) for *_, base, window in _insertions(trials)), in_motion):
        first_ps, sign = int(base.stream.requests_ps[0]), int(base.stream.totals[0])
        for at_ps, (total, what) in product(
            _moments(window)[::2], ((0, "withdrawn"), (2 * sign, "doubled"), (-sign, "turned round"))
        ):
            if at_ps > first_ps:
                asked = base.stream.asking((first_ps, sign), (at_ps, total))
                yield trials.case(f"{sign:+d} step, {what} during the insertion", asked)


def _insertions(trials: Trials) -> Iterator[tuple[int, int, Case, tuple[int, int]]]:
    """Yield state, sign, case and window of each insertion at rest."""
    for state, sign in product(trials.contract.states, (1, -1)):
        case, window = trials.at_rest(state, sign)
        if window is not None:
            yield state, sign, case, window


def _moments(window: tuple[int, int]) -> list[int]:
    begin_ps, end_ps = window
    margin_ps = max((end_ps - begin_ps) / 5.0, 1.0)
    return [round(t) for t in np.linspace(begin_ps - margin_ps, end_ps + margin_ps, _WINDOW_PHASES)]


def _way(direction: int) -> str:
    return " forward" if direction > 0 else " backward"
