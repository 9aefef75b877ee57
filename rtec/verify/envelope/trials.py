"""What is tried at a frequency: a burst behind a slow transition, or a steady stream."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from rtec.units import PS_PER_S
from rtec.verify.envelope import _kernels as kernels
from rtec.verify.envelope.bench import Moment, Motion, PhaseSweepBench, shaken
from rtec.verify.envelope.moments import armed_moments, loop_cycles

F = TypeVar("F")
Clocks = NDArray[np.int64]

_BURST_CYCLES = 600
"""A burst lasts at least as long as the work on a reading, so that a transition met by that has followers, too."""
_BURST_EDGES = 8
_LOOP_CYCLES = 64
"""Swept where the waiting loop's period is not found."""
_BEFORE_READINGS, _AFTER_READINGS = 1.0, 2.0
"""Readings of a steady stream before the PC asks, and after."""
_OWED = 12
"""Steps asked for with Large Correction: so many follow one another while the stream lasts, the rest at rest."""
STEPS_PER_OCTAVE = 12
RESOLUTION = 0.01
"""Share by which the safe value and the failing one differ at most."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Failure:
    """A trial that failed."""

    frequency_hz: float
    """Square waves a second of each line."""
    moment: Moment
    motion: Motion
    shift_ps: int
    """``moment``, ``motion``, ``shift_ps``: the trial."""
    phase_clocks: int
    """Clocks of the processor from the beginning of the sweep."""
    sign: int
    """Of the steps owed; 0 for none."""
    into: int | None
    """Angle state into which the transition led behind which the insertion was set off; None in a steady stream."""
    verdict: int
    """Of the kernel."""


def quarter_ps(frequency_hz: float, count: int) -> NDArray[np.int64]:
    """Return ``count`` times of transitions, from 0 on.

    Examples
    --------
    >>> quarter_ps(25_000.0, 3).tolist()
    [0, 10000000, 20000000]
    """
    return np.round(np.arange(count) * (PS_PER_S / (4.0 * frequency_hz))).astype(np.int64)


def _failure(
    frequency_hz: float, moment: Moment, motion: Motion, clocks: Clocks, shifts_ps: Clocks,
    verdicts: NDArray[np.uint8], into: int | None = None,
) -> Failure:  # fmt: skip
    """Return the last of the trials of a sweep, which failed."""
    i = verdicts.size - 1
    return Failure(
        frequency_hz=frequency_hz, moment=moment, motion=motion, shift_ps=int(shifts_ps[i]),
        phase_clocks=int(clocks[i]), sign=int(np.sign(motion.total)), into=into, verdict=int(verdicts[i]),
    )  # fmt: skip


class Bursts:
    """The insertion window, whatever came before: the axis creeps, the firmware waits, then transitions at once.

    Parameters
    ----------
    bench
        The board.
    jitter_ps
        Bound of the encoder's jitter, taken at its worst.
    """

    def __init__(self, bench: PhaseSweepBench, jitter_ps: int = 0) -> None:
        self.bench, self.jitter_ps = bench, jitter_ps
        self.armed = armed_moments(bench)
        clocks = bench.microcontroller.clock_hz * bench.cycle_ps / PS_PER_S
        self.clocks_a_cycle = round(clocks)
        found = loop_cycles(bench, self.armed[0]) if self.armed else None
        self.loop_cycles = found or _LOOP_CYCLES
        waiting = round(self.armed[0].waiting_ps / bench.clock_ps) if self.armed else 0
        self._loop = waiting + np.arange(self.loop_cycles * self.clocks_a_cycle, dtype=np.int64)
        self.met: list[int] = []
        """Phases that have failed in a sweep of a whole reading."""

    def fails(self, frequency_hz: float) -> Failure | None:
        """Return the first trial that fails over a period of the waiting loop, and at the phases met before."""
        return self._over(frequency_hz, np.concatenate([np.array(self.met, np.int64), self._loop]))

    def sweep(self, frequency_hz: float, stride: int) -> Failure | None:
        """Return the first trial that fails over a whole reading, in steps of ``stride`` clocks."""
        reading = int(self.bench.reading_ps / self.bench.clock_ps)
        return self._over(frequency_hz, np.arange(0, reading, stride, dtype=np.int64))

    def _over(self, frequency_hz: float, clocks: Clocks) -> Failure | None:
        edges = max(_BURST_EDGES, int(_BURST_CYCLES * self.bench.cycle_ps * 4.0 * frequency_hz / PS_PER_S))
        for armed in self.armed:
            shifts_ps = self.bench.shifts(armed.moment, clocks)
            # the Original comes to rest in state 1 alone
            count = edges + (-(armed.moment.state + armed.direction * edges) * armed.direction) % 4
            times_ps = shaken(quarter_ps(frequency_hz, count), self.jitter_ps)
            motion = Motion(times_ps=times_ps, direction=armed.direction, total=armed.sign)
            verdicts, _ = self.bench.sweep(armed.moment, motion, shifts_ps)
            if verdicts[-1] != kernels.SAFE:
                return _failure(frequency_hz, armed.moment, motion, clocks, shifts_ps, verdicts, armed.into)
        return None


class Streams:
    """A steady stream over several readings, with nothing owed and with steps owed.

    Parameters
    ----------
    bench
        The board.
    jitter_ps
        Bound of the encoder's jitter, taken at its worst.
    owed
        Totals that are asked for.
    after
        Readings and transitions at least that the axis still moves once it was asked for.

    Attributes
    ----------
    slower
        Share by which the stream is longer in the end than at constant speed.
    """

    def __init__(
        self,
        bench: PhaseSweepBench,
        jitter_ps: int = 0,
        owed: tuple[int, ...] = (0, _OWED, -_OWED),
        after: tuple[float, int] = (_AFTER_READINGS, 8),
    ) -> None:
        self.bench, self.jitter_ps, self.owed, self.after = bench, jitter_ps, owed, after
        self.slower = 0.0
        self.met: list[int] = []
        self._pieces = 8
        """Phases of a quarter period while the limit is searched."""

    def fails(self, frequency_hz: float) -> Failure | None:
        """Return the first trial that fails at some phases of a quarter period, and at those met before."""
        quarter = self._quarter_clocks(frequency_hz)
        some = np.unique(np.linspace(0, quarter - 1, min(self._pieces, quarter)).round().astype(np.int64))
        return self.over(frequency_hz, np.concatenate([np.array(self.met, np.int64), some]))

    def sweep(self, frequency_hz: float, stride: int) -> Failure | None:
        """Return the first trial that fails over a quarter period, in steps of ``stride`` clocks."""
        return self.over(frequency_hz, np.arange(0, self._quarter_clocks(frequency_hz), stride, dtype=np.int64))

    def _quarter_clocks(self, frequency_hz: float) -> int:
        return max(1, int(np.ceil(PS_PER_S / (4.0 * frequency_hz) / self.bench.clock_ps)))

    def over(self, frequency_hz: float, clocks: Clocks) -> Failure | None:
        """Return the first trial that fails at these phases."""
        shifts_ps = self.bench.shifts(self.bench.rested, clocks)
        for motion in self.motions(frequency_hz):
            verdicts, _ = self.bench.sweep(self.bench.rested, motion, shifts_ps)
            if verdicts[-1] != kernels.SAFE:
                return _failure(frequency_hz, self.bench.rested, motion, clocks, shifts_ps, verdicts)
        return None

    def phases_ps(self, frequency_hz: float, number: int) -> NDArray[np.int64]:
        """Return shifts of a stream that put its begin at so many phases of a quarter period."""
        quarter = PS_PER_S / (4.0 * frequency_hz) / self.bench.clock_ps
        clocks = np.unique((np.arange(number) * quarter / number).astype(np.int64))
        return self.bench.shifts(self.bench.rested, clocks)

    def motions(self, frequency_hz: float) -> list[Motion]:
        """Return the streams of a frequency: both directions, each total."""
        per_reading = self.bench.reading_ps * 4.0 * frequency_hz / PS_PER_S
        before = max(8, int(_BEFORE_READINGS * per_reading))
        readings, least = self.after
        count = 4 * ((before + max(least, int(readings * per_reading))) // 4)  # back to state 1
        even_ps = quarter_ps(frequency_hz, count)
        behind = np.clip(np.arange(count) - before, 0, None) / (count - before)
        times_ps = shaken(
            even_ps + np.rint(self.slower * behind * (even_ps - even_ps[before])).astype(np.int64), self.jitter_ps
        )
        return [
            Motion(times_ps=times_ps, direction=direction, total=total, ask_at=before, large=abs(total) > 1)
            for total in self.owed
            for direction in (1, -1)
        ]


class Limit(Generic[F]):
    """What a search has found.

    Parameters
    ----------
    safe
        Largest value at which nothing failed; 0.0 where even the smallest one did.
    failure
        What failed just above, or None where nothing ever did.
    """

    def __init__(self, safe: float, failure: F | None) -> None:
        self.safe, self.failure = safe, failure


def largest_safe(
    fails: Callable[[float], F | None], first: float, last: float, *, steps: int = STEPS_PER_OCTAVE
) -> Limit[F]:
    """Return the largest value below the first failure.

    Parameters
    ----------
    fails
        Returns what fails at a value, or None.
    first, last
        Ends of the grid, ascending by equal ratios.
    steps
        Of the grid, an octave.

    Notes
    -----
    Safe values above the first failing one of the grid do not count: what fails at 30 kHz is no machine for 40 kHz.

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
    if safe == 0.0:
        return Limit(0.0, failure)
    return halved(fails, safe, value, failure)


def halved(fails: Callable[[float], F | None], safe: float, failing: float, failure: F) -> Limit[F]:
    """Return the limit between a safe value and a failing one."""
    while failing > safe * (1.0 + RESOLUTION):
        middle = (safe * failing) ** 0.5
        found = fails(middle)
        if found is None:
            safe = middle
        else:
            failing, failure = middle, found
    return Limit(safe, failure)
