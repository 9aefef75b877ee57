"""Measuring plans drawn at random: 11 to 161 targets, one to five runs, one direction or both, and logs in motion."""

from __future__ import annotations

import math

import numpy as np

from rtec.blind.plan import Plan
from rtec.metrology import Heating, Passes, Reading, Spacing

FEWEST_TARGETS, MOST_TARGETS = 11, 161
FEWEST_RUNS, MOST_RUNS = 1, 5
DENSE_TARGETS = 41
"""Fewest, where they lie dense after the reversals: the rest of the travel has few of them."""
_BOTH_SHARE, _DENSE_SHARE, _HEATED_SHARE = 0.65, 0.2, 0.3
_LONGEST_WAVE = 0.19
"""Of the span: five cycles and a quarter, because the readings do not reach quite to its ends."""
_SHORTEST_WAVE = 0.03
_TARGETS_A_CYCLE = 2.5


def drawn_plan(
    rng: np.random.Generator,
    *,
    targets: tuple[int, int] = (FEWEST_TARGETS, MOST_TARGETS),
    runs: tuple[int, int] = (FEWEST_RUNS, MOST_RUNS),
    both: bool = False,
) -> Plan:
    """Draw a plan at rest.

    Parameters
    ----------
    rng
        Where the draws come from.
    targets
        Fewest and most; few are drawn as often as many (evenly in their logarithm).
    runs
        Fewest and most.
    both
        Whether it goes in both directions in any case; else in two plans of three.

    Notes
    -----
    Waves that are not the screw's have five cycles or more in the span, and two and a half targets or more in each.

    Examples
    --------
    >>> plan = drawn_plan(np.random.default_rng(0), runs=(2, 5), both=True)
    >>> 11 <= plan.targets <= 161, 2 <= plan.runs <= 5, plan.passes.value
    (True, True, 'both directions')
    """
    count = _between(rng, *targets)
    number = int(rng.integers(runs[0], runs[1] + 1))
    there_and_back = both or rng.uniform() < _BOTH_SHARE
    dense = there_and_back and count >= DENSE_TARGETS and rng.uniform() < _DENSE_SHARE
    heated = number > 1 and rng.uniform() < _HEATED_SHARE
    wave = _TARGETS_A_CYCLE / count * (2.0 if dense else 1.0)
    ways = "forth and back" if there_and_back else "forward"
    return Plan(
        name=f"{count} targets, {number} {'run' if number == 1 else 'runs'}, {ways}"
        + (", dense" if dense else "")
        + (", heated" if heated else ""),
        runs=number,
        targets=count,
        span_mm=float(np.round(rng.uniform(150.0, 600.0))),
        passes=Passes.BOTH if there_and_back else Passes.FORWARD,
        spacing=Spacing.DENSE_AT_ENDS if dense else Spacing.EVEN,
        heating=Heating.COLD_AND_HOT if heated else Heating.NONE,
        feeds_mm_s=(float(np.round(rng.uniform(20.0, 80.0))),),
        dwell_s=float(np.round(rng.uniform(3.0, 6.0), 1)),
        turn_dwells_s=(2.0, float(np.round(rng.uniform(30.0, 300.0)))),
        columns=("direction", "time", "temperature") if heated else ("direction", "time"),
        sigma_um=_sigma(rng),
        wave_shares=(min(max(wave, _SHORTEST_WAVE), _LONGEST_WAVE), _LONGEST_WAVE),
    )


def drawn_log(rng: np.random.Generator, reading: Reading) -> Plan:
    """Draw the plan of a log in motion: moves at three to five feeds, once to three times over.

    Examples
    --------
    >>> plan = drawn_log(np.random.default_rng(0), Reading.DRIVE)
    >>> plan.in_motion, 3 <= len(plan.feeds_mm_s) <= 5
    (True, True)
    """
    drive = reading is Reading.DRIVE
    runs, moves, speeds = int(rng.integers(1, 4)), int(rng.integers(40, 81)), int(rng.integers(3, 6))
    slowest, fastest = (2.0, rng.uniform(50.0, 85.0)) if drive else (rng.uniform(3.0, 8.0), rng.uniform(40.0, 80.0))
    feeds = np.round(np.geomspace(slowest, fastest, max(speeds, 4) if drive else speeds), 1)
    what = "drive" if drive else "moving log"
    return Plan(
        name=f"{what}, {moves} moves, {runs} {'run' if runs == 1 else 'runs'}",
        reading=reading,
        runs=runs,
        targets=moves,
        span_mm=float(np.round(rng.uniform(80.0, 200.0))),
        feeds_mm_s=tuple(float(feed) for feed in feeds),
        columns=("time", "velocity", "force") if drive else ("time", "velocity"),
        sigma_um=_sigma(rng),
        sigma_n=float(np.round(math.exp(rng.uniform(*np.log((0.5, 5.0)))), 2)),
        wave_shares=(0.08, _LONGEST_WAVE),
    )


def _between(rng: np.random.Generator, low: int, high: int) -> int:
    """Draw a whole number evenly in its logarithm."""
    return int(np.clip(round(math.exp(rng.uniform(math.log(low), math.log(high)))), low, high))


def _sigma(rng: np.random.Generator) -> float:
    return float(np.round(math.exp(rng.uniform(*np.log((1.0, 4.0)))), 2))
