"""Noise of the readings, in families of which most are not the diagnosis's own, and the resolution of the laser.

Each family is scaled so that a reading scatters by the plan's repeat noise about the mean of its record: the mean
square over the readings, expected over the draws, is ``sigma**2``. How, says each family's function.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from rtec.blind.plan import Floats, Ints, passes_of

CORRELATION = 0.9
"""From reading to reading, where the noise is correlated."""
LASER_STEP_MM = 1e-5
WHITE_SHARE = (0.1, 0.5)
"""Of the variance of noise that wanders: what each reading has of its own is drawn between these bounds."""
OFFSET_SHARE = (0.3, 0.8)
"""Of the variance where runs are offset: what the runs have in common is drawn between these bounds."""
PLACE_LENGTHS = (0.05, 0.15)
"""Over which noise is correlated by place, as shares of the span of the positions."""
SECONDS = (3.0, 40.0)
"""Over which noise is correlated in time, in units of the median time between two readings."""
DEGREES_OF_FREEDOM = 3
LEVEL_RATIO = 3.0
"""Of the variances before and after the level of the noise changes."""
_LEVELS = (2, 5)
"""Fewest parts of different level, and one more than the most."""
_WAVES = 64
"""Of which a smooth random curve is the sum."""


class Noise(enum.Enum):
    """Families of noise of the readings."""

    WHITE = "white"
    CORRELATED = "correlated"
    """At 0.9 from reading to reading."""
    RANDOM_WALK = "random walk"
    BY_PLACE = "correlated by place"
    BY_SECONDS = "correlated by seconds"
    OFFSETS_PER_RUN = "offsets per run"
    STUDENT_T = "Student t"
    LEVEL_CHANGES = "level that changes"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Readings:
    """When and where the readings were taken, in the order in which they were.

    Parameters
    ----------
    time_s
        Shape (n,), ascending.
    position_mm
        Shape (n,).
    direction
        Of motion or of approach, shape (n,).
    run
        Shape (n,).
    """

    time_s: Floats
    position_mm: Floats
    direction: Floats
    run: Ints


def noise_of(kind: Noise, readings: Readings, sigma: float, rng: np.random.Generator) -> Floats:
    """Return the noise of readings in the order in which they were taken, shape (n,).

    Examples
    --------
    >>> at = np.arange(5.0)
    >>> readings = Readings(time_s=at, position_mm=at, direction=np.ones(5), run=np.ones(5, dtype=np.int64))
    >>> {noise_of(kind, readings, 1.0, np.random.default_rng(0)).size for kind in Noise}
    {5}
    """
    return _FAMILIES[kind](readings, sigma, rng)


def white(count: int, sigma: float, rng: np.random.Generator) -> Floats:
    """Return independent normal noise of standard deviation ``sigma``, shape (count,)."""
    return rng.normal(0.0, sigma, count)


def correlated(count: int, sigma: float, rng: np.random.Generator) -> Floats:
    """Return normal noise of standard deviation ``sigma``, correlated at 0.9 from each reading to the next.

    Examples
    --------
    >>> noise = correlated(100_000, 2.0, np.random.default_rng(0))
    >>> round(float(np.corrcoef(noise[1:], noise[:-1])[0, 1]), 2), round(float(noise.std()), 1)
    (0.9, 2.0)
    """
    return _first_order(np.full(count - 1, CORRELATION), sigma, rng)


def _first_order(kept: Floats, sigma: float, rng: np.random.Generator) -> Floats:
    """Return stationary normal noise of which the next reading keeps the share ``kept``, shape (n - 1,)."""
    fresh = rng.normal(0.0, sigma, kept.size + 1)
    noise = np.empty(fresh.size)
    noise[0] = fresh[0]
    for i, share in enumerate(kept.tolist(), start=1):
        noise[i] = share * noise[i - 1] + math.sqrt(1.0 - share**2) * fresh[i]
    return noise


def random_walk(readings: Readings, sigma: float, rng: np.random.Generator) -> Floats:
    """Return a random walk from reading to reading with a white part, as a mounting that creeps in small slips.

    Notes
    -----
    A walk of n readings in unit steps has the expected mean square (n^2 - 1) / (6 n) about its mean; its steps are
    made so long that walk and white part together have ``sigma**2``.

    Examples
    --------
    >>> at = np.arange(200.0)
    >>> readings = Readings(time_s=at, position_mm=at, direction=np.ones(200), run=np.ones(200, dtype=np.int64))
    >>> squares = [np.var(random_walk(readings, 1.0, np.random.default_rng(seed))) for seed in range(400)]
    >>> bool(0.85 < np.mean(squares) < 1.15)
    True
    """
    n = readings.time_s.size
    share = rng.uniform(*WHITE_SHARE)
    step = sigma * math.sqrt((1.0 - share) / max((n * n - 1.0) / (6.0 * n), 1e-9))
    walked: Floats = np.cumsum(rng.normal(0.0, step, n))
    noise: Floats = walked - walked.mean() + white(n, sigma * math.sqrt(share), rng)
    return noise


def by_place(readings: Readings, sigma: float, rng: np.random.Generator) -> Floats:
    """Return a smooth random function of position, drawn anew for each pass, with a white part.

    As dust and oil on a guide, which each pass leaves lying otherwise.

    Notes
    -----
    Normal in the limit of many waves, with the covariance ``exp(-d**2 / (2 length**2))`` over the distance d: the sum
    of cosines with random phases, their wave numbers normal with standard deviation 1 / length. At each reading the
    variances of smooth and white part sum up to ``sigma**2``.

    References
    ----------
    A. Rahimi and B. Recht, Random features for large-scale kernel machines, Advances in Neural Information Processing
    Systems 20 (2007), section 3.
    """
    share = rng.uniform(*WHITE_SHARE)
    length = rng.uniform(*PLACE_LENGTHS) * max(float(np.ptp(readings.position_mm)), 1e-9)
    noise = white(readings.position_mm.size, sigma * math.sqrt(share), rng)
    height = sigma * math.sqrt((1.0 - share) * 2.0 / _WAVES)
    passes = passes_of(readings.direction, readings.run)
    for number in range(int(passes[-1]) + 1):
        turns, phase = rng.normal(0.0, 1.0 / length, _WAVES), rng.uniform(0.0, 2.0 * np.pi, _WAVES)
        own = passes == number
        noise[own] += height * np.cos(readings.position_mm[own, None] * turns + phase).sum(axis=1)
    return noise


def by_seconds(readings: Readings, sigma: float, rng: np.random.Generator) -> Floats:
    """Return noise correlated by the seconds between the readings, however unevenly they come, as air that drifts by.

    Notes
    -----
    An Ornstein-Uhlenbeck process of standard deviation ``sigma`` at each reading: over dt seconds the share
    ``exp(-dt / tau)`` is kept. The time tau is drawn from 3 to 40 median gaps.

    References
    ----------
    G. E. Uhlenbeck and L. S. Ornstein, On the theory of the Brownian motion, Phys. Rev. 36 (1930) 823.
    """
    gaps = np.diff(readings.time_s)
    tau_s = math.exp(rng.uniform(*np.log(SECONDS))) * max(float(np.median(gaps)), 1e-9)
    return _first_order(np.exp(-gaps / tau_s), sigma, rng)


def offsets_per_run(readings: Readings, sigma: float, rng: np.random.Generator) -> Floats:
    """Return an offset of its own for each run and white noise, as a reference that is set anew before each run.

    The variances of offset and white part sum up to ``sigma**2`` at each reading. With one run, it is white noise
    about an offset.
    """
    share = rng.uniform(*OFFSET_SHARE)
    numbers, which = np.unique(readings.run, return_inverse=True)
    offsets = rng.normal(0.0, sigma * math.sqrt(share), numbers.size)
    return offsets[which] + white(readings.run.size, sigma * math.sqrt(1.0 - share), rng)


def student_t(readings: Readings, sigma: float, rng: np.random.Generator) -> Floats:
    """Return independent noise of Student's t with three degrees of freedom, as a hall in which somebody walks.

    Its variance is 3: it is divided by the root of that, and so has the standard deviation ``sigma``.
    """
    drawn: Floats = rng.standard_t(DEGREES_OF_FREEDOM, readings.time_s.size)
    return drawn * sigma / math.sqrt(DEGREES_OF_FREEDOM / (DEGREES_OF_FREEDOM - 2.0))


def level_changes(readings: Readings, sigma: float, rng: np.random.Generator) -> Floats:
    """Return white noise whose variance is three times as large in every other part, as a machine nearby runs.

    Two to four parts follow each other in time. The mean of the variances over the readings is ``sigma**2``.
    """
    n = readings.time_s.size
    cuts = np.sort(rng.choice(np.arange(1, n), min(int(rng.integers(*_LEVELS)), n) - 1, replace=False))
    part = np.searchsorted(cuts, np.arange(n), side="right")
    variance = np.where(part % 2 == rng.integers(2), LEVEL_RATIO, 1.0)
    noise: Floats = rng.normal(0.0, 1.0, n) * sigma * np.sqrt(variance / variance.mean())
    return noise


_Family = Callable[[Readings, float, np.random.Generator], Floats]
_FAMILIES: Mapping[Noise, _Family] = MappingProxyType(
    {
        Noise.WHITE: lambda readings, sigma, rng: white(readings.time_s.size, sigma, rng),
        Noise.CORRELATED: lambda readings, sigma, rng: correlated(readings.time_s.size, sigma, rng),
        Noise.RANDOM_WALK: random_walk,
        Noise.BY_PLACE: by_place,
        Noise.BY_SECONDS: by_seconds,
        Noise.OFFSETS_PER_RUN: offsets_per_run,
        Noise.STUDENT_T: student_t,
        Noise.LEVEL_CHANGES: level_changes,
    }
)


def resolved(position_mm: Floats) -> Floats:
    """Return positions as the laser shows them, in steps of 0.01 um.

    Examples
    --------
    >>> resolved(np.array([1.234567])).tolist()
    [1.23457]
    """
    return np.round(np.round(position_mm / LASER_STEP_MM) * LASER_STEP_MM, 5)
