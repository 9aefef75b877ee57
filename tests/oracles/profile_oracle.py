"""Slow, readable counterparts of the motion profiles: numerical integration and search instead of closed forms."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np

STEPS = 2000
GRID = (1 - np.cos(np.linspace(0, np.pi, STEPS + 1))) / 2
"""Times between 0 and 1, closer together at both ends, where the acceleration has its corners."""


def integrate_ramp(ramp_s: float, acceleration: float, jerk: float | None) -> tuple[float, float]:
    """Return speed and distance after the quickest ramp (up, held, down) of a given length, by the midpoint rule."""
    step, middle = ramp_s * np.diff(GRID), ramp_s * (GRID[1:] + GRID[:-1]) / 2
    value = np.full(STEPS, acceleration)
    if jerk is not None:
        value = np.minimum(value, jerk * np.minimum(middle, ramp_s - middle))
    speed = np.concatenate([[0.0], np.cumsum(step * value)])
    return float(speed[-1]), float(np.sum(step * (speed[1:] + speed[:-1]) / 2))


def longest(allowed: Callable[[float], bool]) -> float:
    """Return the longest time that is allowed, by doubling and halving; every shorter time must be allowed too."""
    high = 1e-9
    while allowed(high):
        high *= 2
    low = 0.0
    for _ in range(45):
        middle = (low + high) / 2
        low, high = (middle, high) if allowed(middle) else (low, middle)
    return low


def move_time_s(distance: float, speed: float, acceleration: float, jerk: float | None) -> float:
    """Return the time of a move from rest to rest: ramp up as long as speed and half the distance allow, cruise."""

    def within(ramp_s: float) -> bool:
        reached, covered = integrate_ramp(ramp_s, acceleration, jerk)
        return reached <= speed and covered <= distance / 2

    ramp_s = longest(within)
    reached, covered = integrate_ramp(ramp_s, acceleration, jerk)
    return 2 * ramp_s + max(distance - 2 * covered, 0.0) / reached


State = tuple[Fraction, Fraction, Fraction]


def state_after(lapse_ps: int, x: float, v: float, a: float, j: float) -> State:
    """Return position, velocity and acceleration after a time of constant jerk, in exact fractions."""
    t, x_, v_, a_, j_ = Fraction(lapse_ps, 10**12), Fraction(x), Fraction(v), Fraction(a), Fraction(j)
    return x_ + v_ * t + a_ * t**2 / 2 + j_ * t**3 / 6, v_ + a_ * t + j_ * t**2 / 2, a_ + j_ * t


def extremes(motion: Any) -> SimpleNamespace:
    """Return the range of positions and the largest speed, acceleration and jerk of segments."""
    columns = {
        "speed_mm_s": motion.v0_mm_s, "acceleration_mm_s2": motion.a0_mm_s2, "jerk_mm_s3": motion.j0_mm_s3
    }  # fmt: skip
    places = [*motion.x0_mm.tolist(), motion.end_mm]
    largest = {name: float(np.abs(column).max(initial=0.0)) for name, column in columns.items()}
    return SimpleNamespace(min_mm=min(places), max_mm=max(places), **largest)
