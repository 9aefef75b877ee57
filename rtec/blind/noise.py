"""Noise of the readings and the resolution of the laser."""

from __future__ import annotations

import enum
import math

import numpy as np

from rtec.blind.plan import Floats

CORRELATION = 0.9
"""From reading to reading, where the noise is correlated."""
LASER_STEP_MM = 1e-5


class Noise(enum.Enum):
    """Noise of the readings."""

    WHITE = "white"
    CORRELATED = "correlated"
    """At 0.9 from reading to reading."""


def noise_of(kind: Noise, count: int, sigma: float, rng: np.random.Generator) -> Floats:
    """Return the noise of readings in the order in which they were taken, shape (count,)."""
    return white(count, sigma, rng) if kind is Noise.WHITE else correlated(count, sigma, rng)


def white(count: int, sigma: float, rng: np.random.Generator) -> Floats:
    """Return independent normal noise, shape (count,)."""
    return rng.normal(0.0, sigma, count)


def correlated(count: int, sigma: float, rng: np.random.Generator) -> Floats:
    """Return normal noise of standard deviation ``sigma``, correlated at 0.9 from each reading to the next.

    Examples
    --------
    >>> noise = correlated(100_000, 2.0, np.random.default_rng(0))
    >>> round(float(np.corrcoef(noise[1:], noise[:-1])[0, 1]), 2), round(float(noise.std()), 1)
    (0.9, 2.0)
    """
    fresh = rng.normal(0.0, sigma, count)
    noise = np.empty(count)
    share = math.sqrt(1.0 - CORRELATION**2)
    noise[0] = fresh[0]
    for i in range(1, count):
        noise[i] = CORRELATION * noise[i - 1] + share * fresh[i]
    return noise


def resolved(position_mm: Floats) -> Floats:
    """Return positions as the laser shows them, in steps of 0.01 um.

    Examples
    --------
    >>> resolved(np.array([1.234567])).tolist()
    [1.23457]
    """
    shown: Floats = np.round(np.round(position_mm / LASER_STEP_MM) * LASER_STEP_MM, 5)
    return shown
