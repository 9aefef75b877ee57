"""Ramps between rest and the speed of a move, in closed form, for all moves of a program at once.

Numbers only: arrays of float64 in, arrays of float64 out. :mod:`rtec.axis.profile` checks and gives them meaning.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Ramp:
    """The ramp of every move, float64 (moves,): seven pieces a move, the last three the mirror of the first three.

    Without a limit of jerk the pieces 0, 2, 4 and 6 have no length; a dwell is a move of no length, all in piece 3.
    """

    peak: FloatArray
    """Speed at the end of the ramp, in mm/s."""
    acceleration: FloatArray
    """Largest acceleration in it, in mm/s²."""
    jerk: float
    """Jerk, in mm/s³; 0 where it is not limited."""
    jerk_s: FloatArray
    """Length of each of its two pieces with jerk."""
    constant_s: FloatArray
    """Length of the piece of constant acceleration between them."""
    length: FloatArray
    """Distance that the ramp covers, in mm."""
    cruise_s: FloatArray
    """Time at constant speed between the ramp and its mirror image."""

    @classmethod
    def of(cls, distance: FloatArray, speed: FloatArray, acceleration: float, jerk: float | None) -> Ramp:
        reachable = _reachable_speed(distance, acceleration, jerk)
        reached = reachable >= speed
        peak = np.where(reached, speed, reachable)
        full_s = 0.0 if jerk is None else acceleration / jerk
        gained = acceleration * full_s
        jerk_s = np.where(peak >= gained, full_s, np.sqrt(peak / (jerk or 1.0)))
        constant_s = np.maximum(peak / acceleration - full_s, 0.0)
        ramp_s = 2 * jerk_s + constant_s
        return cls(
            peak=peak,
            acceleration=np.where(peak >= gained, acceleration, (jerk or 0.0) * jerk_s),
            jerk=jerk or 0.0,
            jerk_s=jerk_s,
            constant_s=constant_s,
            length=np.where(reached, peak * ramp_s / 2, distance / 2),
            cruise_s=np.where(reached, np.maximum(distance / speed - ramp_s, 0.0), 0.0),
        )

    def lengths_s(self) -> FloatArray:
        jerk_s, constant_s = self.jerk_s, self.constant_s
        return np.column_stack([jerk_s, constant_s, jerk_s, self.cruise_s, jerk_s, constant_s, jerk_s])

    def distances_mm(self) -> FloatArray:
        """Return the distance from the start (pieces 0 to 3) or yet to go (pieces 4 to 6) where each piece begins."""
        foot = self.jerk * self.jerk_s**3 / 6
        shoulder = self.length - (self.peak * self.jerk_s - foot)
        none = np.zeros_like(foot)
        return np.column_stack([none, foot, shoulder, self.length, self.length, shoulder, foot])

    def speeds_mm_s(self) -> FloatArray:
        foot = self.jerk * self.jerk_s**2 / 2
        peak, none = self.peak, np.zeros_like(foot)
        return np.column_stack([none, foot, peak - foot, peak, peak, peak - foot, foot])

    def accelerations_mm_s2(self) -> FloatArray:
        top, none = self.acceleration, np.zeros_like(self.acceleration)
        return np.column_stack([none, top, top, none, none, -top, -top])

    def jerks_mm_s3(self) -> FloatArray:
        return np.tile(self.jerk * np.array([1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0]), (self.peak.size, 1))


def _reachable_speed(distance: FloatArray, acceleration: float, jerk: float | None) -> FloatArray:
    """Return the speed, in mm/s, at which a move of this length peaks when no feed limits it."""
    if jerk is None:
        return np.sqrt(acceleration * distance)
    full_s = acceleration / jerk
    with_constant = 2 * distance / (full_s + np.sqrt(full_s**2 + 4 * distance / acceleration))
    without = jerk * np.cbrt(distance / (2 * jerk)) ** 2
    return np.where(distance >= 2 * acceleration * full_s**2, with_constant, without)
