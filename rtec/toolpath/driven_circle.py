"""A circle test of emulated feed drives: both senses at a constant feed, with overshoot arcs."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from rtec.axis.plants import run_drive
from rtec.checks import number_within
from rtec.errors import ArgumentError
from rtec.metrology.ballbar import CircleTest
from rtec.metrology.ballbar.positions import circles_of_positions
from rtec.toolpath.contour_run import DRIVES

Floats = npt.NDArray[np.float64]

_OVERSHOOT_RAD = math.radians(45.0)
_LONGEST_START_S = 1.0
_MOST_SAMPLES = 2_000_000


def driven_circle(
    drive: str,
    *,
    radius_mm: float = 150.0,
    feed_mm_s: float = 1000.0 / 60.0,
    progress: Callable[[float], None] = lambda share: None,
) -> CircleTest:
    """Drive circles in both senses with a drive in each axis, and return the circle test of the carriages.

    Parameters
    ----------
    drive
        One of `rtec.toolpath.contour_run.DRIVES`.
    radius_mm
        1 mm to 10 m.
    feed_mm_s
        Along the circle.
    progress
        Called with the share done.

    Raises
    ------
    ArgumentError
        No such drive, a radius outside its range, a feed beyond velocity or acceleration of the drive, or one that
        takes too long.

    Examples
    --------
    >>> driven_circle("belt")
    Traceback (most recent call last):
        ...
    rtec.errors.ArgumentError: drive: 'belt' is not valid; use one of ball-screw, linear-motor
    """
    if drive not in DRIVES:
        raise ArgumentError("drive", repr(drive)[:60], f"one of {', '.join(DRIVES)}")
    kind = DRIVES[drive]
    radius = number_within("radius_mm", radius_mm, 1.0, 10_000.0)
    highest, strongest = (
        float(np.min(limit)) for limit in (kind.limits.velocity_mm_s, kind.limits.acceleration_mm_s2)
    )
    feed = number_within("feed_mm_s", feed_mm_s, 0.01, highest)
    if feed**2 / radius > strongest:
        fastest = math.sqrt(strongest * radius)
        problem = f"asks for {feed**2 / radius:.4g} mm/s² on a radius of {radius:g} mm"
        raise ArgumentError("feed_mm_s", "", f"up to {fastest:.4g} mm/s", problem=problem)
    clock, turn, speed, gain = _turn(feed / radius, kind.period_s)
    targets, actuals = [], []
    for number, sense in enumerate((1.0, -1.0)):
        angle = sense * (turn - _OVERSHOOT_RAD)
        place: Floats = radius * np.column_stack([np.cos(angle), np.sin(angle)])
        along: Floats = sense * np.column_stack([-place[:, 1], place[:, 0]])
        velocity: Floats = along * speed[:, None]
        acceleration: Floats = along * gain[:, None] - place * speed[:, None] ** 2
        runs = [
            run_drive(kind.make(), clock, place[:, k], velocity[:, k], acceleration[:, k]).load_mm for k in (0, 1)
        ]
        targets.append(place)
        actuals.append(np.column_stack(runs))
        progress((number + 1) / 2.0)
    time_s = np.concatenate([clock, clock + clock[-1] + 1.0])
    return circles_of_positions(np.vstack(targets), np.vstack(actuals), time_s=time_s)


def _turn(omega_rad_s: float, period_s: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Return time, angle, angular velocity and acceleration: a smooth start, and then constant velocity."""
    start_s = min(_LONGEST_START_S, _OVERSHOOT_RAD / omega_rad_s)
    total_s = start_s / 2.0 + (2.0 * math.pi + 2.0 * _OVERSHOOT_RAD) / omega_rad_s
    if total_s > _MOST_SAMPLES * period_s:
        problem = f"takes {total_s:.4g} s a sense"
        raise ArgumentError(
            "feed_mm_s", "", f"one that takes at most {_MOST_SAMPLES * period_s:g} s", problem=problem
        )
    clock: Floats = np.arange(math.ceil(total_s / period_s) + 1, dtype=np.float64) * period_s
    share: Floats = np.minimum(clock / start_s, 1.0)
    angle: Floats = omega_rad_s * (
        clock - start_s / 2.0 * share - start_s / (2.0 * math.pi) * np.sin(math.pi * share)
    )
    angle = np.where(clock < start_s, angle, omega_rad_s * (clock - start_s / 2.0))
    speed: Floats = omega_rad_s * (1.0 - np.cos(math.pi * share)) / 2.0
    gain: Floats = np.where(clock < start_s, omega_rad_s * math.pi / (2.0 * start_s) * np.sin(math.pi * share), 0.0)
    return clock, angle, speed, gain
