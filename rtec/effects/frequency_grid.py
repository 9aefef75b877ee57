"""Which periods a plan of positions can resolve: the grid of frequencies to scan, its upper limit, phases seen."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rtec.effects.conditions import Conditions, Floats

FEWEST_PLACES = 6
"""With fewer positions a sine through them proves nothing."""
SPACING = 0.3
"""Of the frequencies, in units of 1 / span: between two of them a sine keeps a cosine of 0.96."""
MOST_FREQUENCIES = 3000
FEWEST_CYCLES = 5.0
"""Over the span, of a wave of an unstated period: of real measurements every doubtful wave had four cycles or
fewer, every confirmed one six or more. What comes back less often may as well be a smooth curve."""
FEWEST_STATED = 0.9
"""Over the span, of a wave with a stated period: readings over a turn end a step before it is full."""
NEARLY_A_TURN = 0.75
"""From which on fractions of a turn are stated, too: over half a turn its low orders are a bend, as gravity is."""
NEAR_TWO = 0.95
"""Share of the sampling's limit up to which an unstated wave counts: at two readings a cycle noise is a wave."""
IRREGULAR = 0.05
"""Positions whose gaps deviate by more than this share from whole steps resolve more than half a cycle a step."""
SAME_WAVE = 0.98
"""Length of the spectral window from which on two waves count as one: a fifth of their amplitude differs."""
MOST_A_STEP = 8.0
"""Cycles of a wave between two uneven places, on average: of so many more some follow anything."""
HALF_BY_CHANCE = 0.25
"""Logarithm of the waves that are tried, at most, for each target beyond three: the best of M waves explains about
2 log(M) / (targets - 3) of anything by chance, here a half."""
CELLS_A_CYCLE, FINER = 16, 8
"""Of the grid on which a spectral window is computed, and of its frequencies in units of 1 / span."""
SAME_PHASE = 0.02
"""Phases nearer than this share of a period count as one."""
MOST_PARTS, MOST_A_TURN = 5, 400
MOST_PLACES = 500
"""Looked at for the phases of a period: so many show them as well as all."""
SAME_PERIOD = 0.01
"""Share by which a period found may differ from the stated one and still be it."""
MOSTLY = 0.4
"""Length of the mean of the unit vectors at the phases of a wave, from which on it is mainly a constant."""
SAME_LINE = 0.5
"""Of 1 / span: frequencies nearer than this cannot be told apart."""
ENOUGH_PHASES = 3
"""Sine and cosine cannot be told apart from two phases."""


@lru_cache(maxsize=8)
def alias_limit(conditions: Conditions) -> float:
    """Return the frequency from which on periods in position look like longer ones, in cycles per position unit.

    Half a cycle a step for regular places (Nyquist). Of irregular ones those of a log, or in time, resolve one cycle
    a step; targets resolve all up to the first frequency that looks like a lower one, at most eight cycles a step,
    and fewer of less than 27 targets. 0 for fewer than six places.

    Examples
    --------
    >>> c = Conditions(position=np.arange(0.0, 101.0, 5.0), position_unit="mm", run=np.ones(21, dtype=np.int64))
    >>> alias_limit(c)
    0.1
    """
    places = conditions.places
    if places.size < FEWEST_PLACES:
        return 0.0
    step = float(np.median(np.diff(places)))
    if _is_even(places):
        return 0.5 / step
    if conditions.moving or conditions.time_is_coordinate:
        return 1.0 / step
    return max(1.0 / step, _first_alias(places))


def is_uneven(conditions: Conditions) -> bool:
    """Return whether targets lie so unevenly that they show waves beyond half a cycle a step."""
    still = not (conditions.moving or conditions.time_is_coordinate)
    return still and conditions.places.size >= FEWEST_PLACES and not _is_even(conditions.places)


def _is_even(places: Floats) -> bool:
    """Return whether places are whole steps apart."""
    gaps = np.diff(places)
    steps = gaps / np.median(gaps)
    return bool(np.all(np.abs(steps - np.maximum(np.round(steps), 1.0)) < IRREGULAR))


def _first_alias(places: Floats) -> float:
    """Return from which frequency on waves look like lower ones, at most eight cycles a step, fewer of few places.

    Notes
    -----
    Two waves look the same where the spectral window at their difference is about 1, and the first two that do lie on
    either side of half that difference: the pseudo-Nyquist frequency of uneven sampling.

    References
    ----------
    J. T. VanderPlas, Astrophys. J. Suppl. 236 (2018) 16, sections 4.1 and 4.2.
    """
    span = float(places[-1] - places[0])
    few = np.exp(min(HALF_BY_CHANCE * (places.size - 3), 20.0))
    most = float(min(MOST_A_STEP * (places.size - 1), SPACING * MOST_FREQUENCIES, few)) / span
    cell = 1.0 / (2.0 * most * CELLS_A_CYCLE)
    counts = np.bincount(np.rint((places - places[0]) / cell).astype(np.int64))
    length = 1 << int(FINER * counts.size - 1).bit_length()
    window = np.abs(np.fft.rfft(counts, length))[: int(2.0 * most * length * cell)] / places.size
    beyond = int(np.argmax(window < 0.5))  # the end of the main lobe
    alike = np.flatnonzero(window[beyond:] > SAME_WAVE)
    return min(most, 0.5 * float(beyond + alike[0]) / (length * cell)) if alike.size else most


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
    0.095
    """
    if conditions.span == 0.0:
        return 0.0
    most = (FEWEST_CYCLES + SPACING * (MOST_FREQUENCIES - 1)) / conditions.span
    return min(resolved_limit(conditions), NEAR_TWO * alias_limit(conditions), most)


def frequencies(conditions: Conditions) -> Floats:
    """Return the frequencies to scan, equally spaced, in cycles per position unit, shape (frequencies,).

    From five cycles over the span to the highest frequency; empty where the places resolve nothing, and in time where
    nothing turns evenly.
    """
    top = highest_frequency(conditions)
    if top == 0.0 or conditions.on_schedule:
        return np.empty(0)
    lowest, step = FEWEST_CYCLES / conditions.span, SPACING / conditions.span
    count = int(np.floor((top - lowest) / step + 1e-9)) + 1
    return lowest + step * np.arange(max(count, 0), dtype=np.float64)


def resolved_harmonics(conditions: Conditions, period: float) -> int:
    """Return up to which harmonic of a period the places resolve; higher ones alias.

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


def looks_constant(conditions: Conditions, frequency: float) -> bool:
    """Return whether a wave is mainly a constant at the readings at rest, and times the direction a backlash.

    It is where most runs have their targets at whole periods of it, even if those of another run show more.

    Notes
    -----
    The spectral window at the frequency, in which a place counts once for each run that visits it.

    References
    ----------
    T. J. Deeming, Astrophys. Space Sci. 36 (1975) 137: the window of unequally spaced data.

    Examples
    --------
    Two runs every 5 mm and one every 5.2 mm: waves of 5 mm are mainly a constant, those of 5.2 mm are not.

    >>> x = [5.0 * np.arange(104.0), 5.0 * np.arange(104.0), 5.2 * np.arange(100.0)]
    >>> run = np.repeat([1, 2, 3], [104, 104, 100])
    >>> c = Conditions(position=np.concatenate(x), position_unit="mm", run=run)
    >>> looks_constant(c, 1 / 5.0), looks_constant(c, 1 / 5.2)
    (True, False)
    """
    if conditions.moving:
        return False
    return bool(np.abs(np.exp(2j * np.pi * frequency * _visited(conditions)).mean()) > MOSTLY)


@lru_cache(maxsize=8)
def _visited(conditions: Conditions) -> Floats:
    """Return the places of each run, one run after the other; of the whole, where these are a drawn part of it."""
    c = conditions if conditions.whole is None else conditions.whole
    return np.unique(np.column_stack([c.run, c.position]), axis=0)[:, 1]


@lru_cache(maxsize=8)
def stated_periods(conditions: Conditions) -> NDArray[np.float64]:
    """Return the periods that the file states and whole fractions of them, as far as the positions show them.

    Parameters
    ----------
    conditions
        The screw's pitch and the turn of a rotary axis are stated periods. Fractions of a pitch count down to 1 / 5;
        of a turn as many as the positions resolve, at most 1 / 400; none for less than three quarters of a turn.

    Returns
    -------
    ndarray
        Longest first, shape (periods,). At least nine tenths of a cycle lie within the span, and the positions show
        three phases of it.
    """
    if conditions.places.size < FEWEST_PLACES:
        return np.empty(0)
    found: list[float] = []
    top = resolved_limit(conditions)
    places = conditions.places
    if places.size > MOST_PLACES:  # drawn: at equal steps a period of four readings would be seen twice
        places = np.sort(np.random.default_rng(0).choice(places, MOST_PLACES, replace=False))
    for stated, most in ((conditions.screw_pitch, MOST_PARTS), (conditions.revolution, _parts_of_a_turn(conditions))):
        if stated is None:
            continue
        for part in range(1, most + 1):
            period = stated / part
            if period > conditions.span / FEWEST_STATED:
                continue
            if part / stated > top and (stated is conditions.revolution or phases_seen(places, stated) <= 2 * part):
                break  # it looks like a slower wave of the pitch
            if phases_seen(places, period) >= ENOUGH_PHASES:
                found.append(period)
    return np.unique(np.array(found))[::-1]


def _parts_of_a_turn(conditions: Conditions) -> int:
    """Return how many fractions of a turn count as stated, itself included: of a joint that turns less, no other."""
    turn = conditions.revolution
    return 1 if turn is None or conditions.span < NEARLY_A_TURN * turn else MOST_A_TURN


def stated_base(conditions: Conditions, period: float) -> float | None:
    """Return the stated period, or whole fraction of one, that a period cannot be told from, or None."""
    for stated, most in ((conditions.revolution, _parts_of_a_turn(conditions)), (conditions.screw_pitch, MOST_PARTS)):
        if stated is None or period > stated * (1.0 + SAME_PERIOD):
            continue
        part = round(stated / period)
        away = abs(1.0 / period - part / stated)
        if 1 <= part <= most and away <= min(SAME_LINE / conditions.span, SAME_PERIOD * part / stated):
            return stated / part
    return None
