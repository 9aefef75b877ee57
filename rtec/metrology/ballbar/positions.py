"""Circles in the log of two axes: from commanded and measured positions to a circle test."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.metrology.ballbar.circle_test import CircleTest, Floats, circle_test

_ROUNDS = 12
_OFF_CIRCLE = 1e-3
"""Of the radius, by which a command on the circle may be off it."""
_LEAST_ARC_RAD = np.radians(60.0)
"""What turns less is no circle: settling, or the way to the start."""
_STEADY = 0.98
"""Of the feed, from which on an arc counts, where a whole revolution is left."""


def circles_of_positions(
    target_mm: npt.ArrayLike,
    actual_mm: npt.ArrayLike,
    *,
    time_s: npt.ArrayLike | None = None,
    notes: Sequence[str] = (),
) -> CircleTest:
    """Return the circle test in a log; the ways to the circle and standstills are left out.

    Parameters
    ----------
    target_mm, actual_mm
        Of both axes, shape (samples, 2).
    time_s
        Of each sample, shape (samples,); it tells the feed.
    notes
        What was found out before.

    Raises
    ------
    ArgumentError
        No circle in the targets, or as of `circle_test`.

    Examples
    --------
    >>> way = np.radians(np.arange(-30.0, 390.0, 0.5))
    >>> circle = np.column_stack([50.0 * np.cos(way) + 7.0, 50.0 * np.sin(way)])
    >>> both = np.vstack([circle, circle[::-1]])
    >>> test = circles_of_positions(both, both + np.random.default_rng(1).normal(0.0, 1e-3, both.shape))
    >>> round(test.radius_mm, 6), test.sense[[0, -1]].tolist(), test.points_a_revolution
    (50.0, [1.0, -1.0], 720)
    """
    target, actual = (np.asarray(x, dtype=np.float64) for x in (target_mm, actual_mm))
    clock = None if time_s is None else np.asarray(time_s, dtype=np.float64)
    if target.ndim != 2 or target.shape[1:] != (2,) or target.shape != actual.shape or len(target) < 2:
        raise ArgumentError(
            "target, actual", f"shapes {target.shape} and {actual.shape}", "shape (samples, 2) of both"
        )
    moving = np.append(np.any(np.diff(target, axis=0) != 0.0, axis=1), False)
    target, actual = target[moving], actual[moving]
    clock = None if clock is None else clock[moving]
    x, y, radius = _circle(target)
    about = target - [x, y]
    off = np.abs(np.hypot(*about.T) - radius) > _OFF_CIRCLE * radius
    turn = np.unwrap(np.arctan2(about[:, 1], about[:, 0]))
    way = np.sign(np.diff(turn, append=2.0 * turn[-1] - turn[-2]))
    parts = [
        part
        for part in np.split(np.arange(way.size), np.flatnonzero((np.diff(way) != 0.0) | (np.diff(off) != 0)) + 1)
        if not off[part[0]] and way[part[0]] != 0.0 and np.ptp(turn[part]) > _LEAST_ARC_RAD
    ]
    if not parts:
        raise ArgumentError("targets", "", "a log of circles in both senses", problem="hold no arc of a circle")
    feed = None if clock is None else float(np.median([_feed(turn[part], clock[part]) for part in parts]) * radius)
    parts = [_steady(part, turn, clock) for part in parts]
    rows = np.concatenate(parts)
    run = np.repeat(np.arange(float(len(parts))), [part.size for part in parts])
    place = actual[rows] - [x, y]
    return circle_test(
        np.degrees(np.arctan2(place[:, 1], place[:, 0])),
        1e3 * (np.hypot(*place.T) - radius),
        way[rows],
        radius_mm=radius,
        feed_mm_s=feed,
        run=run,
        notes=[*notes, f"circle of the targets: radius {radius:.6g} mm about {_um(x):g}, {_um(y):g} mm"],
    )


def _um(value_mm: float) -> float:
    """Return a length rounded to a micrometre, never minus zero."""
    return round(value_mm, 3) + 0.0


def _circle(target_mm: Floats) -> tuple[float, float, float]:
    """Return centre and radius of the circle that most of the targets lie on, by least squares without the others."""
    rows = np.ones(len(target_mm), dtype=np.bool_)
    x = y = radius = 0.0
    for _ in range(_ROUNDS):
        part = target_mm[rows]
        basis = np.column_stack([part, np.ones(len(part))])
        a, b, c = np.linalg.lstsq(basis, np.sum(part**2, axis=1), rcond=None)[0].tolist()
        x, y = a / 2.0, b / 2.0
        radius = float(np.sqrt(max(c + x * x + y * y, 0.0)))
        off = np.abs(np.hypot(target_mm[:, 0] - x, target_mm[:, 1] - y) - radius)
        rows = off <= max(3.0 * float(np.median(off)), 1e-9)
    return x, y, radius


def _feed(turn_rad: Floats, time_s: Floats) -> float:
    """Return the usual angular speed of an arc in rad/s."""
    steps = np.diff(time_s)
    speeds = np.abs(np.diff(turn_rad))[steps > 0.0] / steps[steps > 0.0]
    return float(np.median(speeds)) if speeds.size else 0.0


def _steady(part: npt.NDArray[np.int64], turn_rad: Floats, time_s: Floats | None) -> npt.NDArray[np.int64]:
    """Return the part of an arc that is driven at its feed, where that is a revolution; else all of it."""
    if time_s is None:
        return part
    speed = np.abs(np.gradient(turn_rad[part], time_s[part]))
    fast = np.flatnonzero(speed >= _STEADY * _feed(turn_rad[part], time_s[part]))
    inner = part[fast[0] : fast[-1] + 1] if fast.size else part
    return inner if np.ptp(turn_rad[inner]) >= 2.0 * np.pi else part
