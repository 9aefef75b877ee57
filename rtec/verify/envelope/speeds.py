"""What a board does at each frequency, under jitter and from rest, in the words of `rtec.verify.contract`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rtec.units import PS_PER_S
from rtec.verify.contract.cases import start
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.frequencies import Does, Frequencies, search
from rtec.verify.contract.speeds import BELOW, JITTERS, Speeds, accelerations_of, to_a_hundredth, up_to, within
from rtec.verify.envelope import _kernels as kernels
from rtec.verify.envelope.bench import Moment, Motion, PhaseSweepBench
from rtec.verify.envelope.gate import Gate
from rtec.verify.envelope.trials import Bursts, Streams

TO_HZ = 2.0e6
"""No higher frequency is tried: a controller's input takes 1 MHz at most."""
_PHASES = 4
"""Of a quarter period, at which a stream begins."""
_AFTER, _LONG_AFTER = (4.0, 32), (120.0, 256)
"""Readings and transitions that a step may take. The longer where only some trials insert: where two periods are
about the same, a state to wait for falls into the work on a reading many times in a row."""
_SLOWER = 0.01
"""No axis keeps its speed so well that this lasts for ever: the longer streams become slower by twice this share."""
_HARMFUL = (kernels.ILLEGAL, kernels.WRONG_COUNT, kernels.FAULT)
_START_EDGES, _START_STRIDE, _START_READINGS = 8, 13, 1.2
"""Edges of a start from rest; clocks between two moments of it; readings over which they are swept."""
_DEPTHS = (1e-4, 1.0)
"""How far before the first edge the axis rests, counts."""


class Steady:
    """Steady streams over several readings, a step asked for in the midst of them.

    Parameters
    ----------
    bench
        The board.
    safe_hz
        Up to which bursts or streams are safe at every phase.
    jitter_ps
        Bound of the encoder's jitter, taken at its worst.
    """

    def __init__(self, bench: PhaseSweepBench, safe_hz: float, jitter_ps: int = 0) -> None:
        self.bench, self.safe_hz = bench, safe_hz
        self.streams = Streams(bench, jitter_ps, owed=(1, -1), after=_AFTER)

    def does(self, frequency_hz: float) -> Does:
        """Say what the board does at a frequency.

        Notes
        -----
        Where it inserts, the trials of the envelope, clock by clock, decide whether it is in time. Lines that pass
        through the processor are lost above the safe frequency.
        """
        above = frequency_hz > self.safe_hz
        if above and self.bench.design.in_path:
            return Does.FAILS
        for after in (_AFTER, _LONG_AFTER):
            harmful, inserted = self._tried(frequency_hz, after)
            if harmful or (above and inserted.any()):
                return Does.FAILS
            if inserted.all():
                return Does.INSERTS
            if not inserted.any():
                break
        return Does.PASSES

    def _tried(self, frequency_hz: float, after: tuple[float, int]) -> tuple[bool, NDArray[np.bool_]]:
        """Return whether a trial does harm, and which of them insert while the axis moves."""
        self.streams.after, self.streams.slower = after, _SLOWER if after is _LONG_AFTER else 0.0
        shifts_ps, inserted = self.streams.phases_ps(frequency_hz, _PHASES), []
        for motion in self.streams.motions(frequency_hz):
            verdicts, moving = self.bench.sweep(self.bench.rested, motion, shifts_ps, stop=False)
            if np.isin(verdicts, _HARMFUL).any():
                return True, np.zeros(0, np.bool_)
            inserted.append(moving.astype(np.bool_))
        return False, np.concatenate(inserted)

    def right(self, frequency_hz: float, jitter_ps: int) -> bool:
        """Return whether every count is right at a frequency under another jitter."""
        before, self.streams.jitter_ps = self.streams.jitter_ps, jitter_ps
        try:
            return not self._tried(frequency_hz, _AFTER)[0]
        finally:
            self.streams.jitter_ps = before


def speeds_of(
    bench: PhaseSweepBench, trials: Bursts | Streams, safe_hz: float, gate: Gate | None, top_hz: float
) -> Speeds:
    """Return how far a board goes.

    Parameters
    ----------
    bench, trials
        The board, and the trials of its envelope.
    safe_hz
        The envelope; 0 where there is none.
    gate
        What its speed gate does, or None.
    top_hz
        What it does there is of interest.
    """
    steady = Steady(bench, safe_hz, trials.jitter_ps)
    found = search(steady.does, top_hz, from_hz=BELOW * top_hz, to_hz=TO_HZ)
    if found.at(top_hz) is Does.FAILS or found.max_inserting_hz == 0.0:
        return Speeds(frequencies=found, top_hz=top_hz)
    sharpest = replace(Contract.of(bench.design), frequency_hz=top_hz)
    instant_hz_s, levels = accelerations_of(sharpest)
    acceleration = up_to(
        levels, lambda hz_s: starts_are_right(bench, replace(sharpest, acceleration_hz_s=hz_s)), within
    )
    if gate is not None and gate.max_acceleration_counts_s2 is not None:
        acceleration = min(acceleration, gate.max_acceleration_counts_s2 / 4.0)
    return Speeds(
        frequencies=found,
        top_hz=top_hz,
        max_jitter_ps=_jitter_ps(steady, trials, found, top_hz),
        max_acceleration_hz_s=acceleration,
        accelerations_to_hz_s=instant_hz_s,
    )


def passing_alone(safe_hz: float, top_hz: float) -> Speeds:
    """Return how far a board goes that nothing is asked of: it passes up to the safe frequency."""
    passing = [(hertz, Does.PASSES) for hertz in sorted({min(BELOW * top_hz, safe_hz), safe_hz}) if hertz > 0.0]
    top = [(top_hz, Does.PASSES if safe_hz >= top_hz else Does.FAILS)] if safe_hz != top_hz else []
    return Speeds(frequencies=Frequencies(rows=tuple(sorted([*passing, *top]))), top_hz=top_hz)


def _jitter_ps(steady: Steady, trials: Bursts | Streams, found: Frequencies, top_hz: float) -> int:
    """Return by how much two edges may come nearer at the highest frequency, and where the board stops inserting."""
    last_hz, quarter_ps, before = min(found.max_inserting_hz, top_hz), PS_PER_S / (4.0 * top_hz), trials.jitter_ps

    def holds(share: float) -> bool:
        bound_ps = round(share * quarter_ps / 2.0)  # one edge late, the next one early
        trials.jitter_ps = bound_ps
        try:
            return trials.fails(last_hz) is None and (last_hz == top_hz or steady.right(top_hz, bound_ps))
        finally:
            trials.jitter_ps = before

    return round(up_to(JITTERS, holds, to_a_hundredth) * quarter_ps)


def starts_are_right(bench: PhaseSweepBench, contract: Contract) -> bool:
    """Return whether every count is right where the axis starts at any moment of an insertion at rest.

    Parameters
    ----------
    bench
        The board.
    contract
        Its acceleration holds up to its highest frequency.
    """
    board = bench.board
    clocks = np.arange(0, round(_START_READINGS * bench.reading_ps / bench.clock_ps), _START_STRIDE, dtype=np.int64)
    for sign in (1, -1):
        board.restore(bench.rested.kept)
        board.ask(sign)
        moment = Moment(kept=board.snapshot(), at_ps=board.now_ps, state=bench.rested.state)
        shifts_ps = bench.shifts(moment, clocks)
        for direction in (1, -1):
            for depth in _DEPTHS:
                times_ps = start(contract, direction, _START_EDGES, depth=depth)[:, 0]
                motion = Motion(times_ps=times_ps, direction=direction, total=sign)
                for some in np.array_split(shifts_ps, 16):
                    if np.isin(bench.sweep(moment, motion, some, stop=False)[0], _HARMFUL).any():
                        return False
    return True
