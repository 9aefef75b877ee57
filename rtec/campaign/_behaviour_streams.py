"""Edge streams and requests that go into the firmware and into the behavioural box."""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.injector import Design, Processor, Timing

_US = 1_000_000
_MS = 1_000 * _US
_CLOCKS_PER_US = 12
_LEVELS = np.array([0, 1, 3, 2], np.uint8)
_SHARES = (0.1, 0.5, 0.9)
"""Speeds of the steady motion, as shares of the fastest that the gate lets through."""
_STEADY_MS = 4
_TURNS_PS = 6 * _US
"""Whole turns of the waiting loop of two cycles, and of Design B's of six."""
_MOST_STEPS = 120

Longs = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Exercise:
    """A motion in stretches, each with a request at its beginning; times from the beginning of a reading."""

    times_ps: Longs
    levels: NDArray[np.uint8]
    asked_ps: Longs
    totals: Longs
    end_ps: int

    def after(self, begin_ps: int) -> Exercise:
        """Return the same, from ``begin_ps`` on."""
        return dataclasses.replace(
            self,
            times_ps=self.times_ps + begin_ps,
            asked_ps=self.asked_ps + begin_ps,
            end_ps=self.end_ps + begin_ps,
        )


def quarter_ps(design: Design) -> float:
    """Return the time between two transitions at the fastest motion that the firmware's gate lets through."""
    gate_ps = Timing.of(design, Processor.FIRMWARE).gate_ps(design)
    return gate_ps / (4 if design is Design.ORIGINAL else 2)


def steady_motion(design: Design, phases: int) -> list[Exercise]:
    """Return trials of three steps each: three speeds, both directions and signs, every phase a clock later.

    The transitions are whole turns of the waiting loop apart, so that the phase is the same behind each of them. The
    motion is under way by the time of the first reading that can see the request: nothing is inserted at rest.
    """
    trials = []
    for share in _SHARES:
        interval_ps = -round(-quarter_ps(design) / share // _TURNS_PS) * _TURNS_PS
        edges = max(int(_STEADY_MS * _MS / interval_ps), 24) // 4 * 4
        for direction, phase, sign in itertools.product((1, -1), range(phases), (1, -1)):  # a byte holds the total
            first_ps = 600 * _US + round(phase * _US / _CLOCKS_PER_US)
            times = first_ps + interval_ps * np.arange(edges, dtype=np.int64)
            trials.append(
                Exercise(
                    times_ps=times,
                    levels=_LEVELS[direction * np.arange(1, edges + 1) & 3],
                    asked_ps=np.array([850 * _US]),
                    totals=np.array([3 * sign]),
                    end_ps=int(times[-1]) // _US * _US + 900 * _US,
                )
            )
    return trials


def long_run(design: Design, edges: int, seed: int) -> Exercise:
    """Return a motion whose speed changes now and then, with jitter and reversals, and requests at any time."""
    rng = np.random.default_rng(seed)
    fastest_ps = quarter_ps(design)
    intervals, directions, made = [], [], 0
    while made < edges:
        size = min(int(rng.integers(20, 400)), edges - made)
        intervals.append(fastest_ps / rng.uniform(0.05, 1.2) * (1.0 + rng.uniform(-0.15, 0.15, size)))
        directions.append(np.full(size, rng.choice((-1, 1))))
        made += size
    times = _MS + np.cumsum(np.concatenate(intervals)).astype(np.int64)
    end_ps = int(times[-1]) + _MS
    asked, totals = [_MS], [100]
    while (at_ps := asked[-1] + int(rng.integers(10 * _MS, 150 * _MS))) < end_ps:
        asked.append(at_ps)
        totals.append(int(rng.integers(-_MOST_STEPS, _MOST_STEPS + 1)))
    return Exercise(
        times_ps=times,
        levels=_LEVELS[np.cumsum(np.concatenate(directions)) & 3],
        asked_ps=np.asarray(asked, np.int64),
        totals=np.asarray(totals, np.int64),
        end_ps=end_ps,
    )
