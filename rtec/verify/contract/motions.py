"""Motions of one description as runs of any algorithm: cases for the suite."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from rtec.axis import Dwell, Encoder, Move, Program, Rapid, Window
from rtec.axis.motion import COUNT_MM, Motion, MotionKind, motion_of, programme_counts, programme_motion
from rtec.readable import hertz_text
from rtec.signal import count_deltas
from rtec.units import PS_PER_S
from rtec.verify.contract import cases
from rtec.verify.contract.contract import STATES, Contract
from rtec.verify.contract.streams import Stream
from rtec.verify.contract.trials import Case, Trials

AIMED = (MotionKind.REVERSAL, MotionKind.ADVERSARY)
"""Motions that aim crossings into insertions."""
_LONGEST_COUNTS = 12_000
"""Edges of one run: up to 500 kHz and back to rest take 10 000 counts at 100 MHz/s."""
_DITHER_COUNTS = 48
_TRAVELS = (8, 12, 24)
"""Counts of one attack, in turns."""
_RUNS = {
    MotionKind.RAMP: 6, MotionKind.PROGRAMME: 6, MotionKind.DITHER: 24, MotionKind.REVERSAL: 96,
    MotionKind.ADVERSARY: 1000,
}  # fmt: skip
"""Runs for each direction and sign; of the adversary all in all."""


def motion_cases(
    kind: MotionKind, *, program: Program | None = None, seed: int = 0
) -> Callable[[Trials], Iterator[Case]]:
    """Return what makes the runs of a motion for an algorithm whose time to settle is known.

    Parameters
    ----------
    kind
        How the axis moves. Its top speed and its acceleration are those of the contract.
    program
        Of a programme. It is shrunk to some thousand counts, and its dwells to what an insertion needs; the fastest
        feed stays at the top speed.
    seed
        Of the adversary.

    Examples
    --------
    >>> from rtec.verify.contract.built_in import BuiltIn
    >>> from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
    >>> fast = Timing.of(Design.C, Processor.FAST)
    >>> box = BuiltIn(InjectorSettings(design=Design.C, timing=fast, real_edges=RealEdges.HOLD))
    >>> trials = Trials(box, Contract.of(Design.C))
    >>> trials.measure_settling(), trials.first_wrong(motion_cases(MotionKind.DITHER)(trials))
    (None, (None, 96))
    """

    def make(trials: Trials) -> Iterator[Case]:
        contract = trials.contract
        if kind is MotionKind.STEADY:
            yield from cases.in_motion(trials, [contract.frequency_hz * share for share in (1.0, 0.5, 0.2, 0.05)], 24)
            return
        window = insertion_window(trials) if kind in AIMED else None
        if kind in AIMED and window is None:
            return
        for i, direction, sign, state in _numbers(kind):
            motion = motion_for(kind, i, contract, direction=direction, window=window, program=program, seed=seed)
            title = f"{sign:+d} step, {kind.value} up to {hertz_text(motion.top_hz)} from state {STATES[state]}"
            yield trials.case(title, stream_of(motion, state, sign))

    return make


def _numbers(kind: MotionKind) -> Iterator[tuple[int, int, int, int]]:
    """Yield number, direction, sign and state at power-up of each run."""
    if kind is MotionKind.ADVERSARY:
        for i in range(_RUNS[kind]):
            yield i, 1, (1, -1)[i % 2], i // 2 % 4
        return
    for i, direction, sign in product(range(_RUNS[kind]), (1, -1), (1, -1)):
        yield i, direction, sign, i % 4 if kind is not MotionKind.REVERSAL else (i + i // 4) % 4


def insertion_window(trials: Trials) -> Window | None:
    """Measure an insertion at rest; None where an algorithm makes none."""
    _, measured = trials.at_rest(trials.contract.states[0], 1)
    if measured is None:
        return None
    begin_ps, end_ps = (max(t_ps - trials.asked_ps, 0) for t_ps in measured)
    return Window(begin_ps=begin_ps, end_ps=end_ps, pause_ps=trials.settle_ps)


def motion_for(
    kind: MotionKind,
    i: int,
    contract: Contract,
    *,
    direction: int = 1,
    window: Window | None = None,
    program: Program | None = None,
    seed: int = 0,
) -> Motion:
    """Plan motion number ``i`` of a kind, with one request, under the limits of a contract."""
    hertz, gain = contract.frequency_hz, contract.acceleration_hz_s
    if kind is MotionKind.PROGRAMME and program is not None:
        shrunk = _shrunk(program, _LONGEST_COUNTS / programme_counts(program, hertz), direction)
        motion = programme_motion(shrunk, frequency_hz=hertz, corrections=1, acceleration_hz_s=gain)
    else:
        counts = {
            MotionKind.RAMP: min(round(4.0 * hertz**2 / gain) + 8, _LONGEST_COUNTS), MotionKind.DITHER: _DITHER_COUNTS
        }.get(kind, _TRAVELS[i % len(_TRAVELS)])  # fmt: skip
        motion = motion_of(
            kind, counts=counts, frequency_hz=hertz, corrections=1, acceleration_hz_s=gain, direction=direction,
            window=window, seed=seed, first=i,
        )  # fmt: skip
    if kind in (MotionKind.RAMP, MotionKind.PROGRAMME):
        phase = (0.5 + i * cases.GOLDEN) % 1.0
        motion = replace(motion, requests_ps=np.array([max(round(phase * motion.segments.total_ps), 1)], np.int64))
    return motion


def stream_of(motion: Motion, state: int, sign: int, *, encoder: Encoder | None = None) -> Stream:
    """Return the edges of a motion from a state, and its requests as totals; a picosecond at least after power-up.

    The encoder is a perfect one that is at home in the state, or a given one with counts of `COUNT_MM`.
    """
    edges = (encoder or Encoder(count_mm=COUNT_MM, home_state=state)).edges(motion.segments)
    moves = count_deltas(edges.levels, edges.initial).astype(np.int64)
    totals = sign * np.arange(1, motion.requests_ps.size + 1)
    return Stream(
        state=state, edges_ps=edges.times_ps, moves=moves, requests_ps=motion.requests_ps, totals=totals,
        until_ps=motion.total_ps + 1,
    )  # fmt: skip


def _shrunk(program: Program, share: float, direction: int) -> Program:
    """Return a programme with shorter ways and shorter dwells."""
    share = direction * min(share, 1.0)
    blocks: list[Move | Rapid | Dwell] = []
    for block in program.blocks:
        if isinstance(block, Dwell):
            blocks.append(Dwell(seconds=min(block.dwell_ps / PS_PER_S, 1e-3)))
        else:
            blocks.append(replace(block, target_mm=share * block.target_mm))
    return Program(blocks=tuple(blocks), start_mm=share * program.start_mm)
