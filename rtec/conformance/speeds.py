"""How far an algorithm goes: to which frequency it inserts or passes, which jitter and acceleration it stands."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from rtec.conformance.cases import in_motion, turning
from rtec.conformance.contract import Contract
from rtec.conformance.trials import Case, Run, Trials
from rtec.readable import hertz_text

_LADDER_HZ = tuple(digit * 10.0**decade for decade in range(1, 8) for digit in (1, 2, 5))
_BELOW = 1e-4
"""Of the highest frequency: slower motion is rest for any purpose here."""
_ABOVE = 10.0
"""Times the highest frequency: nothing is looked for beyond."""
_CLOSE = 1.03
_PHASES = 3
_MOST_JITTER = 0.9


class Does(enum.Enum):
    """What an algorithm does at a frequency."""

    INSERTS = "inserts"
    """A step that is asked for is completed during the motion."""
    PASSES = "passes"
    """Every count is right; a step that is asked for waits until the axis is slower."""
    FAILS = "fails"


@dataclass(frozen=True, slots=True, kw_only=True)
class Speeds:
    """How far an algorithm goes.

    Parameters
    ----------
    rows
        What it does at each frequency tried, in Hz, rising.
    max_inserting_hz, max_passing_hz
        Up to here it inserts, and passes; to 3 %. 0 where it does not at any.
    at_top
        What it does at the highest frequency of the contract.
    searched_to_hz
        No higher frequency was tried.
    max_jitter
        Share of the distance between two edges at that frequency; up to here jitter does no harm.
    max_acceleration_hz_s
        Up to here turns do no harm.
    instant_hz_s
        From here on the highest frequency is reached within a quarter of a cycle, and no higher one was tried.
    first_wrong
        At the lowest frequency at which it fails.
    """

    rows: tuple[tuple[float, Does], ...]
    max_inserting_hz: float
    max_passing_hz: float
    at_top: Does
    searched_to_hz: float
    max_jitter: float | None
    max_acceleration_hz_s: float | None
    instant_hz_s: float
    first_wrong: Run | None

    def summary(self, top_hz: float) -> str:
        """Return one line for a data sheet.

        Parameters
        ----------
        top_hz
            The highest frequency of the contract.
        """
        said = f"{hertz_text(top_hz)}: {self.at_top.value}"
        for what, limit in (("inserts", self.max_inserting_hz), ("passes", self.max_passing_hz)):
            if limit == 0.0:
                said += f"; {what} at no frequency" + (" in motion" if what == "inserts" else "")
            elif limit >= self.searched_to_hz:
                said += f"; {what} beyond {hertz_text(_rounded(limit))}"
            else:
                said += f"; {what} to {hertz_text(_rounded(limit))}"
        return said


def measure_speeds(trials: Trials, progress: Callable[[float], None] = lambda share: None) -> Speeds:
    """Find the limits of an algorithm.

    Parameters
    ----------
    trials
        The algorithm, with its time to settle measured.
    progress
        Called with the share done.

    Examples
    --------
    >>> from rtec.conformance.built_in import BuiltIn
    >>> from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
    >>> mcs51 = Timing.of(Design.ORIGINAL, Processor.MCS51)
    >>> box = BuiltIn(InjectorSettings(design=Design.ORIGINAL, timing=mcs51, real_edges=RealEdges.HOLD))
    >>> trials = Trials(box, Contract.of(Design.ORIGINAL))
    >>> trials.measure_settling()
    >>> measure_speeds(trials).at_top
    <Does.PASSES: 'passes'>
    """
    top_hz = trials.contract.frequency_hz
    seen: dict[float, tuple[Does, Run | None]] = {}
    low_hz, high_hz = top_hz * _BELOW, top_hz * _ABOVE

    def does(hertz: float) -> Does:
        if hertz not in seen:
            seen[hertz] = _at(trials, hertz)
            progress(min(len(seen) / 40.0, 0.9))
        return seen[hertz][0]

    steps = [top_hz, *(hertz for hertz in _LADDER_HZ if low_hz <= hertz <= high_hz and hertz != top_hz)]
    ladder = sorted({*steps, low_hz, high_hz})
    passing_hz = _highest(ladder, top_hz, lambda hertz: does(hertz) is not Does.FAILS)
    inserting_hz = _highest(
        sorted({hertz for hertz in ladder if hertz <= passing_hz} | {passing_hz}) if passing_hz else ladder[:1],
        min(top_hz, passing_hz) if passing_hz else low_hz,
        lambda hertz: does(hertz) is Does.INSERTS,
    )
    at_top = does(top_hz)
    right_at_top = at_top is not Does.FAILS
    instant_hz_s = top_hz * 4.0 * top_hz
    wrong = min((hertz for hertz, (what, _) in seen.items() if what is Does.FAILS), default=None)
    return Speeds(
        rows=tuple(sorted((hertz, what) for hertz, (what, _) in seen.items())),
        max_inserting_hz=inserting_hz,
        max_passing_hz=passing_hz,
        at_top=at_top,
        searched_to_hz=high_hz,
        max_jitter=_jitter(trials) if right_at_top else None,
        max_acceleration_hz_s=_acceleration(trials, instant_hz_s) if right_at_top else None,
        instant_hz_s=instant_hz_s,
        first_wrong=None if wrong is None else seen[wrong][1],
    )


def _at(trials: Trials, hertz: float) -> tuple[Does, Run | None]:
    """Say what the algorithm does at a frequency."""
    inserts = True
    for case in in_motion(trials, [hertz], _PHASES):
        run = trials.one(case)
        if not run.right:
            return Does.FAILS, run
        done = run.response.completed.times_ps
        inserts = inserts and done.size > 0 and int(done[-1]) < int(case.stream.edges_ps[-1])
    return (Does.INSERTS if inserts else Does.PASSES), None


def _highest(ladder: list[float], begin: float, holds: Callable[[float], bool]) -> float:
    """Return up to where something holds, seen from a rung of a ladder; 0 where it holds on none below."""
    at = min(range(len(ladder)), key=lambda k: abs(ladder[k] - begin))
    if holds(ladder[at]):
        while at + 1 < len(ladder) and holds(ladder[at + 1]):
            at += 1
        if at + 1 == len(ladder):
            return ladder[at]
        good, bad = ladder[at], ladder[at + 1]
    else:
        while at and not holds(ladder[at]):
            at -= 1
        if not holds(ladder[at]):
            return 0.0
        good, bad = ladder[at], ladder[at + 1]
    return _between(good, bad, holds)


def _between(good: float, bad: float, holds: Callable[[float], bool]) -> float:
    while bad / good > _CLOSE:
        middle = math.sqrt(good * bad)
        good, bad = (middle, bad) if holds(middle) else (good, middle)
    return good


def _jitter(trials: Trials) -> float:
    """Return the largest jitter at the highest frequency that does no harm, to a hundredth."""
    contract = trials.contract

    def shaken(jitter: float) -> Iterator[Case]:
        rng = np.random.default_rng(4)
        for plain in in_motion(trials, [contract.frequency_hz], 2 * _PHASES):
            stream = plain.stream
            shifts = rng.uniform(0.0, jitter * contract.quarter_ps, stream.edges_ps.size).astype(np.int64)
            shifts[::7], shifts[1::7] = round(jitter * contract.quarter_ps), 0  # the worst pair comes often
            moved = replace(stream, edges_ps=stream.edges_ps + shifts)
            yield replace(plain, stream=trials.settled(moved))

    good, bad = 0.0, _MOST_JITTER
    if trials.first_wrong(shaken(bad))[0] is None:
        return bad
    while bad - good > 0.01:
        middle = (good + bad) / 2.0
        good, bad = (good, middle) if trials.first_wrong(shaken(middle))[0] else (middle, bad)
    return good


def _acceleration(trials: Trials, instant_hz_s: float) -> float:
    """Return the largest acceleration at which turns do no harm, to a tenth."""

    def holds(acceleration: float) -> bool:
        contract: Contract = replace(trials.contract, acceleration_hz_s=acceleration)
        return trials.first_wrong(turning(trials, contract, depths=(0.02, 1.0)))[0] is None

    decades = sorted({instant_hz_s, *(10.0**k for k in range(3, 15) if 10.0**k < instant_hz_s)})
    at = len(decades) - 1
    while at and not holds(decades[at]):
        at -= 1
    if at == len(decades) - 1:
        return instant_hz_s
    if at == 0 and not holds(decades[0]):
        return 0.0
    good, bad = decades[at], decades[at + 1]
    for _ in range(4):
        middle = math.sqrt(good * bad)
        good, bad = (middle, bad) if holds(middle) else (good, middle)
    return good


def _rounded(hertz: float) -> float:
    """Return a frequency with three digits, rounded down."""
    scale = 10.0 ** (math.floor(math.log10(hertz)) - 2)
    return math.floor(hertz / scale * (1.0 + 1e-9)) * scale
