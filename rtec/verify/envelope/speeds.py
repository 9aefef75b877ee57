"""What a board does at each frequency, under jitter and from rest, in the words of `rtec.verify.contract`."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

from rtec.units import PS_PER_S
from rtec.verify.contract.cases import start
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.frequencies import Does, Frequencies, search
from rtec.verify.contract.speeds import BELOW, JITTERS, Speeds, accelerations_of, to_a_hundredth, up_to, within
from rtec.verify.envelope.bench import Motion, PhaseSweepBench
from rtec.verify.envelope.trials import HARMFUL, Trials, phases_ps, streams

TO_HZ = 2.0e6
"""No higher frequency is tried: a controller's input takes 1 MHz at most."""
_PHASES = 4
"""Of a quarter period, at which a stream begins."""
_AFTER, _LONG_AFTER = (4.0, 32), (120.0, 256)
"""Readings and transitions that a step may take. The longer where only some trials insert: where two periods are
about the same, a state to wait for falls into the work on a reading many times in a row."""
_SLOWER = 0.01
"""No axis keeps its speed so well that this lasts for ever: the longer streams become slower by twice this share."""
_START_EDGES, _START_STRIDE, _START_READINGS = 8, 13, 1.2
"""Edges of a start from rest; clocks between two moments of it; readings over which they are swept."""
_DEPTHS = (1e-4, 1.0)
"""How far before the first edge the axis rests, counts."""


def _does(trials: Trials, safe_hz: float, frequency_hz: float) -> Does:
    """Say what a board does in steady streams, a step asked for in their midst.

    Where it inserts, the trials of the envelope, clock by clock, decide whether it is in time. Lines that pass
    through the processor are lost above the safe frequency.
    """
    above = frequency_hz > safe_hz
    if above and trials.bench.design.in_path:
        return Does.FAILS
    for after in (_AFTER, _LONG_AFTER):
        inserted = _inserted(trials.bench, frequency_hz, trials.jitter_ps, after)
        if inserted is None or (above and any(inserted)):
            return Does.FAILS
        if all(inserted):
            return Does.INSERTS
        if not any(inserted):
            break
    return Does.PASSES


def _inserted(
    bench: PhaseSweepBench, frequency_hz: float, jitter_ps: int, after: tuple[float, int] = _AFTER
) -> list[bool] | None:
    """Return which trials insert while the axis moves, or None where one does harm."""
    shifts_ps, inserted = phases_ps(bench, frequency_hz, _PHASES), list[bool]()
    slower = _SLOWER if after is _LONG_AFTER else 0.0
    for motion in streams(bench, frequency_hz, jitter_ps, after=after, slower=slower):
        verdicts, moving = bench.sweep(bench.rested, motion, shifts_ps, stop=False)
        if np.isin(verdicts, HARMFUL).any():
            return None
        inserted += moving.astype(np.bool_).tolist()
    return inserted


def speeds_of(trials: Trials, safe_hz: float, most_hz_s: float, top_hz: float) -> Speeds:
    """Return how far a board goes beyond its envelope, ``safe_hz``; what it does at ``top_hz`` is of interest.

    Its speed gate bears no higher acceleration than ``most_hz_s``.
    """
    bench = trials.bench
    found = search(partial(_does, trials, safe_hz), top_hz, from_hz=BELOW * top_hz, to_hz=TO_HZ)
    if found.at(top_hz) is Does.FAILS or found.max_inserting_hz == 0.0:
        return Speeds(frequencies=found, top_hz=top_hz)
    sharpest = replace(Contract.of(bench.design), frequency_hz=top_hz)
    instant_hz_s, levels = accelerations_of(sharpest)
    hz_s = up_to(levels, lambda hz_s: starts_are_right(bench, replace(sharpest, acceleration_hz_s=hz_s)), within)
    return Speeds(
        frequencies=found, top_hz=top_hz, max_jitter_ps=_jitter_ps(trials, found, top_hz),
        max_acceleration_hz_s=min(hz_s, most_hz_s), accelerations_to_hz_s=instant_hz_s,
    )  # fmt: skip


def passing_alone(safe_hz: float, top_hz: float) -> Speeds:
    """Return how far a board goes that nothing is asked of: it passes up to the safe frequency."""
    passing = [(hertz, Does.PASSES) for hertz in sorted({min(BELOW * top_hz, safe_hz), safe_hz}) if hertz > 0.0]
    top = [(top_hz, Does.PASSES if safe_hz >= top_hz else Does.FAILS)] if safe_hz != top_hz else []
    return Speeds(frequencies=Frequencies(rows=tuple(sorted([*passing, *top]))), top_hz=top_hz)


def _jitter_ps(trials: Trials, found: Frequencies, top_hz: float) -> int:
    """Return by how much two edges may come nearer at the highest frequency, and where the board stops inserting."""
    last_hz, quarter_ps, shaky = min(found.max_inserting_hz, top_hz), PS_PER_S / (4.0 * top_hz), copy(trials)

    def holds(share: float) -> bool:
        shaky.jitter_ps = round(share * quarter_ps / 2.0)  # one edge late, the next one early
        if shaky.fails(last_hz) is not None:
            return False
        return last_hz == top_hz or _inserted(shaky.bench, top_hz, shaky.jitter_ps) is not None

    return round(up_to(JITTERS, holds, to_a_hundredth) * quarter_ps)


def starts_are_right(bench: PhaseSweepBench, contract: Contract) -> bool:
    """Return whether every count is right where the axis starts at any moment of an insertion at rest.

    The acceleration of the contract holds up to its highest frequency.
    """
    clocks = np.arange(0, round(_START_READINGS * bench.reading_ps / bench.clock_ps), _START_STRIDE, dtype=np.int64)
    for sign in (1, -1):
        bench.reset(bench.rested)
        bench.board.ask(sign)
        moment = bench.keep()
        shifts_ps = bench.shifts(moment, clocks)
        for direction, depth in product((1, -1), _DEPTHS):
            times_ps = start(contract, direction, _START_EDGES, depth=depth)[:, 0]
            motion = Motion(times_ps=times_ps, direction=direction, total=sign)
            for some in np.array_split(shifts_ps, 16):
                if np.isin(bench.sweep(moment, motion, some, stop=False)[0], HARMFUL).any():
                    return False
    return True
