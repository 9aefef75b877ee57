"""How far an algorithm goes: to which frequency it inserts or passes, which jitter and acceleration it stands."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice, pairwise

import numpy as np

from rtec.readable import hertz_text, time_text
from rtec.units import PS_PER_S
from rtec.verify.contract.cases import aimed_in_motion, in_motion, moments_of_insertion, shaken, starting, turning
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.frequencies import CLOSE, Does, Frequencies, acceleration_text, search
from rtec.verify.contract.trials import Case, Run, Trials

BELOW, ABOVE = 1e-3, 10.0
"""Times the highest frequency of the contract: there the search begins and ends."""
_PHASES = 3
JITTERS = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9)
"""Shares of the distance of two edges at the highest frequency."""
_SLOW_TURN = 1e-2
"""Times the acceleration of the contract: slower turns are slow for any purpose here."""
_EVERY = 5
"""Of the cases with turns one in so many is tried: a prime, so that all moments, edges and signs are met."""
_DOWN = 1.1
"""At the limit found all cases are tried; where one fails, the limit is lowered by this factor."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Speeds:
    """How far an algorithm goes."""

    frequencies: Frequencies
    """What it does at each frequency tried."""
    top_hz: float
    """The highest frequency of the contract."""
    max_jitter_ps: int | None = None
    """By so much two edges may come nearer to each other, up to the highest frequency, and do no harm; None where it
    fails at that frequency."""
    max_acceleration_hz_s: float | None = None
    """Up to here a changing frequency does no harm; None where that was not tried."""
    accelerations_to_hz_s: float = math.inf
    """No higher one was tried."""
    first_wrong: Run | None = None
    """At the lowest frequency at which it fails, where the run is kept."""

    @property
    def at_top(self) -> Does:
        """Return what it does at the highest frequency of the contract."""
        return self.frequencies.at(self.top_hz)

    @property
    def summary(self) -> str:
        """Return the frequencies in one line."""
        return self.frequencies.summary(self.top_hz)

    @property
    def quarter_ps(self) -> int:
        """Return the time between two edges there."""
        return round(PS_PER_S / (4.0 * self.top_hz))

    @property
    def max_jitter(self) -> float | None:
        """Return the jitter as a share of that time."""
        return None if self.max_jitter_ps is None else self.max_jitter_ps / self.quarter_ps

    def data_sheet(self) -> list[tuple[str, str]]:
        """Return rows of a data sheet: name and value.

        Examples
        --------
        >>> tried = Frequencies(rows=((20e3, Does.INSERTS), (500e3, Does.PASSES)))
        >>> for row in Speeds(frequencies=tried, top_hz=500e3, max_jitter_ps=440_000).data_sheet():
        ...     print(*row)
        frequency 500 kHz: passes; inserts to 20 kHz; passes beyond 500 kHz
        jitter 88% of the distance of two edges at 500 kHz (440 ns)
        """
        rows = [("frequency", self.summary)]
        if self.max_jitter is not None:
            distance = f"the distance of two edges at {hertz_text(self.top_hz)}"
            rows.append(("jitter", f"{self.max_jitter:.0%} of {distance} ({time_text(self.max_jitter_ps)})"))
        if self.max_acceleration_hz_s is not None:
            rows.append(("acceleration", acceleration_text(self.max_acceleration_hz_s, self.accelerations_to_hz_s)))
        return rows


def measure_speeds(trials: Trials, progress: Callable[[float], None] = lambda share: None) -> Speeds:
    """Find the limits of an algorithm whose time to settle is known.

    Examples
    --------
    >>> from rtec.verify.contract.built_in import BuiltIn
    >>> from rtec.verify.contract.contract import Contract
    >>> from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
    >>> mcs51 = Timing.of(Design.ORIGINAL, Processor.MCS51)
    >>> box = BuiltIn(InjectorSettings(design=Design.ORIGINAL, timing=mcs51, real_edges=RealEdges.HOLD))
    >>> trials = Trials(box, Contract.of(Design.ORIGINAL))
    >>> trials.measure_settling()
    >>> measure_speeds(trials).at_top
    <Does.PASSES: 'passes'>
    """
    top_hz = trials.contract.frequency_hz
    wrong: dict[float, Run] = {}
    moments_ps = moments_of_insertion(trials)

    def does(hertz: float) -> Does:
        said, run = _at(trials, hertz, moments_ps)
        if run is not None:
            wrong[hertz] = run
        return said

    found = search(
        does, top_hz, from_hz=top_hz * BELOW, to_hz=top_hz * ABOVE, progress=lambda share: progress(0.5 * share)
    )
    jitter_ps, acceleration = None, None
    if found.at(top_hz) is not Does.FAILS:
        jitter_ps = _jitter_ps(trials, found)
        progress(0.7)
        acceleration = _acceleration(trials)
    return Speeds(
        frequencies=found,
        top_hz=top_hz,
        max_jitter_ps=jitter_ps,
        max_acceleration_hz_s=acceleration,
        accelerations_to_hz_s=accelerations_of(trials.contract)[0],
        first_wrong=wrong[min(wrong)] if wrong else None,
    )


def _at(trials: Trials, hertz: float, moments_ps: Sequence[int]) -> tuple[Does, Run | None]:
    """Say what the algorithm does at a frequency: inserts at phases spread out, fails where edges are aimed, too."""
    inserts = True
    for case in in_motion(trials, [hertz], _PHASES):
        run = trials.one(case)
        if not run.right:
            return Does.FAILS, run
        done = run.response.completed.times_ps
        inserts = inserts and done.size > 0 and int(done[-1]) < int(case.stream.edges_ps[-1])
    wrong, _ = trials.first_wrong(aimed_in_motion(trials, hertz, moments_ps))
    if wrong is not None:
        return Does.FAILS, wrong
    return (Does.INSERTS if inserts else Does.PASSES), None


def _jitter_ps(trials: Trials, found: Frequencies) -> int:
    """Return the largest jitter that does no harm at the highest frequency, nor where it stops inserting.

    To a hundredth of the distance of two edges at the highest frequency.
    """
    contract, last_hz = trials.contract, found.max_inserting_hz
    tried = [contract.frequency_hz, *([last_hz] if 0.0 < last_hz < contract.frequency_hz else [])]

    def jittering(jitter: float) -> Iterator[Case]:
        rng = np.random.default_rng(4)
        for plain in in_motion(trials, tried, 2 * _PHASES):
            shifts = rng.uniform(0.0, jitter * contract.quarter_ps, plain.stream.edges_ps.size)
            shifts[::7], shifts[1::7] = round(jitter * contract.quarter_ps), 0  # the worst pair comes often
            yield shaken(trials, plain, shifts)

    def holds(jitter: float) -> bool:
        return trials.first_wrong(jittering(jitter))[0] is None

    return round(up_to(JITTERS, holds, to_a_hundredth) * contract.quarter_ps)


def _acceleration(trials: Trials) -> float:
    contract = trials.contract
    _, levels = accelerations_of(contract)

    def holds(acceleration: float, every: int = _EVERY) -> bool:
        sharper = replace(contract, acceleration_hz_s=acceleration)
        cases = chain(starting(trials, sharper), turning(trials, sharper, depths=(0.0, 0.02, 1.0)))
        return trials.first_wrong(islice(cases, 0, None, every))[0] is None

    limit = up_to(levels, holds, within)
    while limit >= levels[0] and not holds(limit, every=1):
        limit /= _DOWN
    return limit if limit >= levels[0] else 0.0


def accelerations_of(contract: Contract) -> tuple[float, list[float]]:
    """Return the acceleration that reaches the highest frequency within a quarter of a cycle, and a ladder up to it.

    Examples
    --------
    >>> accelerations_of(Contract(step_counts=2, frequency_hz=5e3))
    (100000000.0, [1000000.0, 10000000.0, 100000000.0])
    """
    instant_hz_s = 4.0 * contract.frequency_hz**2
    slow_hz_s = min(_SLOW_TURN * contract.acceleration_hz_s, instant_hz_s / 10.0)
    decades = max(round(math.log10(instant_hz_s / slow_hz_s)), 1)
    return instant_hz_s, np.geomspace(slow_hz_s, instant_hz_s, decades + 1).tolist()


def up_to(
    levels: Sequence[float], holds: Callable[[float], bool], between: Callable[[float, float], float | None]
) -> float:
    """Return up to where something holds, from the first level to the one below the first where it does not; else 0.

    Parameters
    ----------
    levels
        Rising.
    holds
        Tries one.
    between
        The next to be tried between one that holds and one that does not; None where they are near enough.

    Examples
    --------
    >>> up_to([1e3, 1e4, 1e5], lambda hertz: hertz < 50e3, within) // 1e3, up_to([1.0, 2.0], lambda _: False, within)
    (49.0, 0.0)
    """
    if not holds(levels[0]):
        return 0.0
    for below, above in pairwise(levels):
        if not holds(above):
            good, bad = below, above
            while (middle := between(good, bad)) is not None:
                good, bad = (middle, bad) if holds(middle) else (good, middle)
            return good
    return levels[-1]


def within(low: float, high: float) -> float | None:
    """Return what lies between two values by ratio; None where 3 % do."""
    return math.sqrt(low * high) if high / low > CLOSE else None


def to_a_hundredth(low: float, high: float) -> float | None:
    """Return what lies between two shares; None where a hundredth does."""
    return (low + high) / 2.0 if high - low > 0.01 else None
