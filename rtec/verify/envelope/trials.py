"""What is tried at a frequency: a burst behind a slow transition, or a steady stream; and the largest safe one."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from rtec.board.board import Snapshot
from rtec.units import PS_PER_S
from rtec.verify.bench import quarter_ps
from rtec.verify.envelope import _kernels as kernels
from rtec.verify.envelope.bench import Longs, Motion, PhaseSweepBench
from rtec.verify.envelope.moments import armed_moments, loop_cycles, waiting_ps

F = TypeVar("F")

HARMFUL = (kernels.ILLEGAL, kernels.WRONG_COUNT, kernels.FAULT)
"""Verdicts of a trial in which a count was wrong, whether or not what was asked for was completed."""
_BURST_CYCLES = 600
"""A burst lasts at least as long as the work on a reading, so that a transition met by that has followers, too."""
_BURST_EDGES = 8
_LOOP_CYCLES = 64
"""Swept where the waiting loop's period is not found."""
_BEFORE_READINGS, _AFTER = 1.0, (2.0, 8)
"""Readings of a steady stream before the PC asks; readings, and transitions at least, after."""
_OWED = 12
"""Steps asked for with Large Correction: so many follow one another while the stream lasts, the rest at rest."""
_PIECES = 8
"""Phases of a quarter period while the limit of streams is searched."""
_STEPS_PER_OCTAVE = 12
_RESOLUTION = 0.01
"""Share by which the safe value and the failing one differ at most."""
_FIRST_CYCLES = 2000
"""The first frequency tried has a period of so many cycles of the processor."""
_SLOWEST_HZ, _TOP_HZ = 20.0, 20.0e6
_STRIDE = 61
"""Clocks between the phases of a reading in the shorter sweep: prime, so that all cycles and their parts are met."""
_LEAST_PS = 1_000
"""Jitter brings two transitions no closer together than this."""


def shaken(times_ps: Longs, jitter_ps: int) -> Longs:
    """Return the times with the worst jitter within its bound: every other transition late, those between early.

    Examples
    --------
    >>> shaken(np.array([0, 100_000, 200_000]), 5_000).tolist()
    [5000, 95000, 205000]
    """
    if jitter_ps == 0:
        return times_ps
    places = np.arange(times_ps.size, dtype=np.int64)
    steps = places * _LEAST_PS
    return np.maximum.accumulate(times_ps + (1 - 2 * (places % 2)) * jitter_ps - steps) + steps


def streams(
    bench: PhaseSweepBench, frequency_hz: float, jitter_ps: int, *, owed: tuple[int, ...] = (1, -1),
    after: tuple[float, int] = _AFTER, slower: float = 0.0,
) -> list[Motion]:  # fmt: skip
    """Return steady streams over several readings, a step asked for in their midst: each total, both directions.

    ``after``: readings, and transitions at least, that the axis still moves then; ``slower``: share by which the
    stream is longer in the end than at constant speed.
    """
    per_reading = bench.reading_ps * 4.0 * frequency_hz / PS_PER_S
    before = max(8, int(_BEFORE_READINGS * per_reading))
    readings, least = after
    count = 4 * ((before + max(least, int(readings * per_reading))) // 4)  # back to state 1
    even_ps = quarter_ps(frequency_hz, count)
    behind = np.clip(np.arange(count) - before, 0, None) / (count - before)
    late_ps = np.rint(slower * behind * (even_ps - even_ps[before])).astype(np.int64)
    times_ps = shaken(even_ps + late_ps, jitter_ps)
    return [
        Motion(times_ps=times_ps, direction=direction, total=total, ask_at=before, large=abs(total) > 1)
        for total in owed
        for direction in (1, -1)
    ]


def phases_ps(bench: PhaseSweepBench, frequency_hz: float, number: int) -> Longs:
    """Return shifts of a stream that put its begin at so many phases of a quarter period."""
    quarter = PS_PER_S / (4.0 * frequency_hz) / bench.clock_ps
    return bench.shifts(bench.rested, np.unique((np.arange(number) * quarter / number).astype(np.int64)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Failure:
    """A trial that failed."""

    frequency_hz: float
    """Square waves a second of each line."""
    moment: Snapshot
    motion: Motion
    phase_clocks: int
    """``moment``, ``motion``, ``phase_clocks``: the trial, by clocks of the processor from the moment on."""
    verdict: int
    """Of the kernel."""


class Trials(ABC):
    """Trials at a frequency over phases between transitions and program, and the search for the largest safe one.

    The bound of the encoder's jitter, ``jitter_ps``, is taken at its worst.
    """

    def __init__(self, bench: PhaseSweepBench, jitter_ps: int = 0) -> None:
        self.bench, self.jitter_ps = bench, jitter_ps
        self.answers, self.loop_cycles = True, 0
        """Whether the program inserts at all; period of its waiting loop, 0 where none was looked for."""
        self._met: list[int] = []
        """Phases that have failed in a sweep of all."""

    @abstractmethod
    def _runs(self, frequency_hz: float) -> Iterator[tuple[Snapshot, Motion]]:
        """Yield what is tried at each phase: a moment, and a motion from there on."""

    @abstractmethod
    def _some(self, frequency_hz: float) -> Longs:
        """Return the phases that are tried while the limit is searched, in clocks."""

    @abstractmethod
    def _all(self, frequency_hz: float, exhaustive: bool) -> Longs:
        """Return those that are tried at the limit."""

    def _over(self, frequency_hz: float, clocks: Longs) -> Failure | None:
        for moment, motion in self._runs(frequency_hz):
            verdicts, _ = self.bench.sweep(moment, motion, self.bench.shifts(moment, clocks))
            if verdicts[-1] != kernels.SAFE:
                return Failure(
                    frequency_hz=frequency_hz, moment=moment, motion=motion,
                    phase_clocks=int(clocks[verdicts.size - 1]), verdict=int(verdicts[-1]),
                )  # fmt: skip
        return None

    def fails(self, frequency_hz: float) -> Failure | None:
        """Return the first trial that fails at some phases, and at those met before."""
        return self._over(frequency_hz, np.concatenate([np.array(self._met, np.int64), self._some(frequency_hz)]))

    def limit(self, *, exhaustive: bool) -> Limit[Failure]:
        """Search the limit, then sweep it; phases that fail there are searched, too, until a sweep finds nothing."""
        if not self.answers:
            return Limit(0.0, None)
        first_hz = PS_PER_S / self.bench.cycles_ps(_FIRST_CYCLES)
        limit = largest_safe(self.fails, first_hz, _TOP_HZ, least=_SLOWEST_HZ, lower=8.0)
        while limit.safe and (failure := self._over(limit.safe, self._all(limit.safe, exhaustive))) is not None:
            self._met.append(failure.phase_clocks)
            limit = self._below(failure)
        return limit

    def _below(self, failure: Failure) -> Limit[Failure]:
        failing_hz = failure.frequency_hz
        while failing_hz > _SLOWEST_HZ:
            safe_hz = failing_hz / 2.0 ** (1.0 / _STEPS_PER_OCTAVE)
            found = self.fails(safe_hz)
            if found is None:
                return _halved(self.fails, safe_hz, failing_hz, failure)
            failing_hz, failure = safe_hz, found
        return Limit(0.0, failure)


class Bursts(Trials):
    """The insertion window, whatever came before: the axis creeps, the firmware waits, then transitions at once.

    While the limit is searched, the phases cover a period of the waiting loop, at the limit a whole reading.
    """

    def __init__(self, bench: PhaseSweepBench, jitter_ps: int = 0) -> None:
        super().__init__(bench, jitter_ps)
        self.armed = armed_moments(bench)
        self.answers = bool(self.armed)
        if self.armed:
            self.loop_cycles = loop_cycles(bench, self.armed[0].moment) or _LOOP_CYCLES

    def _some(self, frequency_hz: float) -> Longs:
        clock_ps = self.bench.clock_ps
        looks = np.arange(round(self.bench.cycles_ps(self.loop_cycles) / clock_ps), dtype=np.int64)
        return round(waiting_ps(self.bench) / clock_ps) + looks

    def _all(self, frequency_hz: float, exhaustive: bool) -> Longs:
        reading = int(self.bench.reading_ps / self.bench.clock_ps)
        return np.arange(0, reading, 1 if exhaustive else _STRIDE, dtype=np.int64)

    def _runs(self, frequency_hz: float) -> Iterator[tuple[Snapshot, Motion]]:
        edges = max(_BURST_EDGES, int(self.bench.cycles_ps(_BURST_CYCLES) * 4.0 * frequency_hz / PS_PER_S))
        for armed in self.armed:
            # the Original comes to rest in state 1 alone
            count = edges + (-(armed.moment.state + armed.direction * edges) * armed.direction) % 4
            times_ps = shaken(quarter_ps(frequency_hz, count), self.jitter_ps)
            yield armed.moment, Motion(times_ps=times_ps, direction=armed.direction, total=armed.sign)


class Streams(Trials):
    """Steady streams with nothing owed and with steps owed; the phases cover a quarter period."""

    def __init__(self, bench: PhaseSweepBench, jitter_ps: int = 0, *, asked: bool = True) -> None:
        super().__init__(bench, jitter_ps)
        self._owed = (0, _OWED, -_OWED) if asked else (0,)

    def _some(self, frequency_hz: float) -> Longs:
        quarter = self._all(frequency_hz, True).size
        return np.unique(np.linspace(0, quarter - 1, min(_PIECES, quarter)).round().astype(np.int64))

    def _all(self, frequency_hz: float, exhaustive: bool) -> Longs:
        return np.arange(max(1, math.ceil(PS_PER_S / (4.0 * frequency_hz) / self.bench.clock_ps)), dtype=np.int64)

    def _runs(self, frequency_hz: float) -> Iterator[tuple[Snapshot, Motion]]:
        for motion in streams(self.bench, frequency_hz, self.jitter_ps, owed=self._owed):
            yield self.bench.rested, motion


@dataclass(frozen=True, slots=True)
class Limit(Generic[F]):
    """What a search has found."""

    safe: float
    """Largest value at which nothing failed; 0.0 where even the smallest one did."""
    failure: F | None
    """What failed just above, or None where nothing ever did."""


def largest_safe(
    fails: Callable[[float], F | None], first: float, last: float, *, steps: int = _STEPS_PER_OCTAVE,
    least: float = math.inf, lower: float = 1.0,
) -> Limit[F]:  # fmt: skip
    """Return the largest value below the first failure, from a grid of equal ratios, so many steps an octave.

    Where even the first value fails, the search begins lower by a factor, down to the least one. Safe values above
    the first failing one of the grid do not count: what fails at 30 kHz is no machine for 40 kHz.

    Examples
    --------
    >>> limit = largest_safe(lambda hz: "late" if hz > 25_000 else None, 1_000, 1e6)
    >>> 24_750 < limit.safe <= 25_000, limit.failure
    (True, 'late')
    """
    ratio = 2.0 ** (1.0 / steps)
    safe, value = 0.0, first
    failure = fails(value)
    while failure is None and value < last:
        safe, value = value, min(value * ratio, last)
        failure = fails(value)
    if failure is None:
        return Limit(value, None)
    if safe == 0.0 and first > least:
        return largest_safe(fails, first / lower, first, steps=steps, least=least, lower=lower)
    return _halved(fails, safe, value, failure) if safe else Limit(0.0, failure)


def _halved(fails: Callable[[float], F | None], safe: float, failing: float, failure: F) -> Limit[F]:
    while failing > safe * (1.0 + _RESOLUTION):
        middle = (safe * failing) ** 0.5
        found = fails(middle)
        if found is None:
            safe = middle
        else:
            failing, failure = middle, found
    return Limit(safe, failure)
