"""Which periods a plan of positions can resolve: the grid of frequencies to scan, its upper limit, phases seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec.effects.conditions import Conditions, Floats

FEWEST_PLACES = 6
"""With fewer positions a sine through them proves nothing."""
SPACING = 0.2
"""Of the frequencies, in units of 1 / span: between two of them a sine keeps a cosine of 0.98."""
MOST_FREQUENCIES = 7500
FEWEST_CYCLES = 2.5
"""Over the span: what comes back no more than once may as well be a smooth curve."""
NEARLY = 0.95
"""Share of these cycles that is enough for a fundamental: readings over a turn end a step before it is full."""
IRREGULAR = 0.05
"""Positions whose gaps deviate by more than this share from whole steps resolve more than half a cycle a step."""
SAME_PHASE = 0.02
"""Phases nearer than this share of a period count as one."""
ENOUGH_PHASES = 3
"""Sine and cosine cannot be told apart from two phases."""


def alias_limit(conditions: Conditions) -> float:
    """Return the frequency from which on periods in position look like longer ones, in cycles per position unit.

    Half a cycle a step for regular places (Nyquist), one cycle a step for irregular ones, which tell the two sides
    of the Nyquist limit apart; 0 for fewer than six places.

    Parameters
    ----------
    conditions
        Of the readings.

    Examples
    --------
    >>> c = Conditions(position=np.arange(0.0, 101.0, 5.0), position_unit="mm", run=np.ones(21, dtype=np.int64))
    >>> alias_limit(c)
    0.1
    """
    places = conditions.places
    if places.size < FEWEST_PLACES:
        return 0.0
    gaps = np.diff(places)
    step = float(np.median(gaps))
    steps = gaps / step
    regular = bool(np.all(np.abs(steps - np.maximum(np.round(steps), 1.0)) < IRREGULAR))
    return 0.5 / step if regular else 1.0 / step


def resolved_limit(conditions: Conditions) -> float:
    """Return the highest frequency whose sine and cosine can both be seen, in cycles per position unit.

    It stays below the alias limit by a quarter of the resolution: right at the limit one of the two vanishes.
    """
    limit = alias_limit(conditions)
    return limit * (1.0 - 0.5 / conditions.places.size)


def highest_frequency(conditions: Conditions) -> float:
    """Return the top of the scan, in cycles per position unit: the resolved limit, or less where that were too many.

    Examples
    --------
    >>> c = Conditions(position=np.arange(0.0, 101.0, 5.0), position_unit="mm", run=np.ones(21, dtype=np.int64))
    >>> round(highest_frequency(c), 4)
    0.0976
    """
    if conditions.span == 0.0:
        return 0.0
    return min(resolved_limit(conditions), (FEWEST_CYCLES + SPACING * (MOST_FREQUENCIES - 1)) / conditions.span)


def frequencies(conditions: Conditions) -> Floats:
    """Return the frequencies to scan, equally spaced, in cycles per position unit, shape (frequencies,).

    From two and a half cycles over the span to the highest frequency; empty where the places resolve nothing.
    """
    top = highest_frequency(conditions)
    if top == 0.0:
        return np.empty(0)
    lowest, step = FEWEST_CYCLES / conditions.span, SPACING / conditions.span
    count = int(np.floor((top - lowest) / step + 1e-9)) + 1
    grid: Floats = lowest + step * np.arange(max(count, 0), dtype=np.float64)
    return grid


def resolved_harmonics(conditions: Conditions, period: float) -> int:
    """Return up to which harmonic of a period the places resolve; higher ones alias.

    Parameters
    ----------
    conditions
        Of the readings.
    period
        In position units.

    Examples
    --------
    Ten readings a turn resolve four harmonics: the fifth is seen at two phases only, and higher ones alias.

    >>> x = 25.4 + 0.635 * np.arange(1561.0)
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(x.size, dtype=np.int64))
    >>> resolved_harmonics(c, 6.35)
    4
    """
    return int(np.floor(resolved_limit(conditions) * period + 1e-9))


def phases_seen(places: Floats, period: float) -> int:
    """Return at how many distinct phases of a period the places lie, at least 2 % of the period apart (at most 50).

    Parameters
    ----------
    places
        Distinct positions, shape (places,).
    period
        In the same unit.

    Examples
    --------
    >>> phases_seen(np.array([0.0, 12.7, 25.4]), 6.35), phases_seen(np.arange(4.0), 6.35)
    (1, 4)
    """
    phases = np.sort(np.mod(places / period, 1.0))
    gaps = np.diff(phases, append=phases[0] + 1.0)
    start = (int(np.argmax(gaps)) + 1) % phases.size  # behind the largest gap, so that no cluster is cut in two
    ordered = np.sort(np.mod(phases - phases[start], 1.0))
    seen, index = 0, 0
    while index < ordered.size:
        seen += 1
        index = int(np.searchsorted(ordered, ordered[index] + SAME_PHASE, side="right"))
    return seen


def stated_periods(conditions: Conditions, stated: float | None, parts: int = 5) -> NDArray[np.float64]:
    """Return a stated period and its fractions 1/2, 1/3, ... of which the places show enough phases."""
    if stated is None or conditions.places.size < FEWEST_PLACES:
        return np.empty(0)
    fractions = stated / np.arange(1, parts + 1)
    return fractions[[phases_seen(conditions.places, period) >= ENOUGH_PHASES for period in fractions]]
