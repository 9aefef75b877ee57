"""The speed gate: up to which steady frequency it lets insertions through, and which acceleration they bear."""

from __future__ import annotations

import math

import numpy as np

from rtec.board.board import Snapshot
from rtec.units import PS_PER_S
from rtec.verify.envelope.bench import Longs, Motion, PhaseSweepBench
from rtec.verify.envelope.trials import HARMFUL, largest_safe, phases_ps, shaken, streams

_PHASES = 8
_STEPS = 4
"""Of the grid of frequencies, an octave."""
_BELOW = 8.0
"""The gate is looked for from the safe frequency over this on."""
_OWED = 40
_FROM, _TO, _BEYOND = 0.75, 2.0, 1.3
"""A ramp's first and least last speed over the gate's, and its least last speed over the safe one."""
_SMALLEST, _FIRST, _LARGEST = 1e-5, 4e-3, 1.0
"""Accelerations over the square of the gate's speed: from one transition to the next it grows by these shares."""
_BEGIN, _RUN_CYCLES = 0.6, 150
"""Readings from an answer to the PC to the first transition, and cycles from the next answer to the kept moment."""
_PLACES, _JOINTS = 16, 2
"""A ramp begins behind up to so many transitions, at so many places between two: wherever the program is by then."""


def gate_of(
    bench: PhaseSweepBench, safe_hz: float, jitter_ps: int = 0, *, top_hz: float = math.inf, phases: int = 2
) -> tuple[float | None, float | None]:
    """Return what the speed gate of a board does; up to ``safe_hz`` bursts or streams are safe.

    Returns
    -------
    gate_hz
        Largest steady frequency at which something is still inserted; None where nothing ever is in motion.
    max_acceleration_counts_s2
        Largest acceleration at which every insertion that the gate lets through is over in time; 0.0 where the
        smallest one tried already breaks one, None where none does or nothing is inserted in motion.

    Notes
    -----
    Beyond ``top_hz`` nothing is tried: lines that pass through the processor are lost there, gate or not. Ramps begin
    from so many phases between transitions and program.
    """

    def refuses(frequency_hz: float) -> bool | None:
        return None if _inserts(bench, frequency_hz, jitter_ps) else True

    gate_hz = largest_safe(refuses, safe_hz / _BELOW, min(4.0 * safe_hz, top_hz), steps=_STEPS).safe
    if gate_hz == 0.0:
        return None, None
    last_hz = min(max(_TO * gate_hz, _BEYOND * safe_hz), top_hz)
    return gate_hz, _acceleration(bench, gate_hz, last_hz, jitter_ps, phases)


def _inserts(bench: PhaseSweepBench, frequency_hz: float, jitter_ps: int) -> bool:
    shifts_ps = phases_ps(bench, frequency_hz, _PHASES)
    return any(
        bench.sweep(bench.rested, motion, some, stop=False)[1].any()
        for some in (shifts_ps[:1], shifts_ps[1:])
        for motion in streams(bench, frequency_hz, jitter_ps)
    )


def ramp(speed: float, acceleration: float, steady: int, joint: float, last: float) -> Longs:
    """Return the times of transitions at a speed in counts/s that grows, by counts/s², behind some steady ones.

    It begins to grow at a joint of 0..1 between two, and does so up to the last speed, for at least 8 transitions.

    Examples
    --------
    >>> (ramp(100_000.0, 1e9, 2, 0.0, 150_000.0)[:5] // 1_000_000).tolist()
    [0, 10, 19, 28, 36]
    """
    grown = max(8, int((last**2 - speed**2) / (2.0 * acceleration)))
    counts = np.arange(1, grown + 1) - joint
    begun_s = (steady - 1 + joint) / speed
    since_s = (np.sqrt(speed**2 + 2.0 * acceleration * counts) - speed) / acceleration
    times_s = np.concatenate([np.arange(steady) / speed, begun_s + since_s])
    return np.round(times_s * PS_PER_S).astype(np.int64)


def _acceleration(
    bench: PhaseSweepBench, gate_hz: float, last_hz: float, jitter_ps: int, phases: int
) -> float | None:
    speed, slow = 4.0 * gate_hz, _FROM * 4.0 * gate_hz
    running = [
        (*_running(bench, slow, direction, sign, phase / phases), direction, sign)
        for direction in (1, -1)
        for sign in (1, -1)
        for phase in range(phases)
    ]

    def breaks(share: float) -> bool | None:
        for steady in range(_PLACES * _JOINTS):
            times_ps = ramp(slow, share * speed**2, steady // _JOINTS, steady % _JOINTS / _JOINTS, 4.0 * last_hz)
            times_ps = shaken(times_ps, jitter_ps)
            for moment, first_ps, direction, sign in running:
                motion = Motion(times_ps=times_ps, direction=direction, total=sign * _OWED)
                if bench.sweep(moment, motion, np.array([first_ps]))[0][0] in HARMFUL:
                    return True
        return None

    limit = largest_safe(breaks, _FIRST, _LARGEST, steps=2, least=_SMALLEST, lower=4.0)
    return None if limit.failure is None else limit.safe * speed**2


def _running(bench: PhaseSweepBench, speed: float, direction: int, sign: int, phase: float) -> tuple[Snapshot, int]:
    """Return a moment in which the axis moves at a steady speed and insertions are made, and when it goes on."""
    bench.reset(bench.rested)
    bench.run_readings(1.0)
    answered_ps = int(bench.board.state.published_ps)
    bench.run_for((answered_ps - bench.now_ps) % bench.reading_ps + round(_BEGIN * bench.reading_ps))
    bench.board.ask(sign * _OWED, large=True)  # read once the axis moves: nothing is inserted at rest
    run_ps = (1.0 - _BEGIN) * bench.reading_ps + bench.cycles_ps(_RUN_CYCLES)
    count = max(4, round(speed * run_ps / PS_PER_S))
    between_ps = PS_PER_S / speed
    times_ps = np.round((np.arange(count + 1) + phase) * between_ps).astype(np.int64) + bench.now_ps
    bench.edges(times_ps[:-1], direction)
    bench.run_until(int(times_ps[-1]) - round(0.05 * between_ps))
    return bench.keep(), int(times_ps[-1]) - bench.now_ps
