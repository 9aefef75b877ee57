"""The feed along a path: the shortest time within velocity, acceleration and jerk of every axis."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rtec.errors import ArgumentError
from rtec.toolpath._feed_grid import Floats, Grid, Path, lay_grid, stops_of
from rtec.toolpath._feed_optimum import JERK_POWER, Bounds, Problem, ordinates, start_shape
from rtec.toolpath._feed_profile import Profile, profile_of
from rtec.toolpath.feed_audit import (
    Audit,
    FeedLimits,
    LimitUse,
    audit,
    audit_positions,
    limit_names,
    peaks,
    shares,
    shares_of,
)

__all__ = ["Audit", "FeedLimits", "FeedPlan", "LimitUse", "Path", "audit", "audit_positions", "plan_feed"]

_SECTIONS_AT_ONCE = 64
_EXCEEDS, _ROUNDS = 1.002, 4
"""Where a limit is exceeded by more between the points at which it was imposed, it is lowered and planned again."""
_MARGIN = 1e-7
"""By which the last scaling stays below the limits."""


@dataclass(frozen=True, eq=False, repr=False)
class FeedPlan:
    """The feed along a path, from rest at its beginning to rest at its end.

    The path is at rest at each of `stops_mm` and moves everywhere else.
    """

    path: Path
    limits: FeedLimits
    parts: tuple[tuple[Floats, Profile], ...]
    """Stops and profile of each part of the path."""
    time_without_jerk_limit_s: float
    """Time of the same path without a limit of jerk: its feed does not stop where only the curvature jumps."""

    def __str__(self) -> str:
        price = f"{100.0 * self.price:.1f} % longer than without a limit of jerk"
        return f"{self.time_s:.4g} s, {price}, at rest at {self.stops_mm.size} places; {self.audit}"

    @cached_property
    def audit(self) -> Audit:
        """How much of each limit is used, and where."""
        return audit(self.path, self, self.limits)

    @cached_property
    def axes(self) -> int:
        """Number of axes."""
        return int(np.asarray(self.path.points(np.zeros(1))).shape[1])

    @cached_property
    def stops_mm(self) -> Floats:
        """Arc lengths at which the path is at rest, with both ends, shape (m + 1,)."""
        return np.unique(np.concatenate([stops for stops, _ in self.parts]))

    @cached_property
    def _starts_s(self) -> Floats:
        return np.cumsum([0.0] + [float(profile.start_s[-1]) for _, profile in self.parts])

    @property
    def time_s(self) -> float:
        """Time of the whole path."""
        return float(self._starts_s[-1])

    @property
    def price(self) -> float:
        """The additional time that the limit of jerk costs, as a share of the time without it."""
        return self.time_s / self.time_without_jerk_limit_s - 1.0

    def at(self, t_s: ArrayLike) -> tuple[Floats, Floats, Floats, Floats]:
        """Return arc length, feed, and acceleration and jerk along the path at times, each of shape (n,).

        Before the beginning and after the end the path is at rest. Where the jerk jumps it is the one afterwards.
        """
        t = np.atleast_1d(np.asarray(t_s, dtype=np.float64))
        inside = np.clip(t, 0.0, self.time_s)
        part = np.clip(np.searchsorted(self._starts_s, inside, side="right") - 1, 0, len(self.parts) - 1)
        found = np.empty((4, t.size))
        for k in np.unique(part):
            here = part == k
            found[:, here] = self.parts[k][1].at_time(inside[here] - self._starts_s[k])
        found[1:, (t < 0.0) | (t > self.time_s)] = 0.0
        return found[0], found[1], found[2], found[3]

    def positions(self, t_s: ArrayLike) -> Floats:
        """Return the positions of the axes at times, mm, shape (n, d)."""
        return self.path.points(self.at(t_s)[0])

    def axis_motion(self, t_s: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Return velocity, acceleration and jerk of the axes at times, each of shape (n, d)."""
        s, v, a, j = self.at(t_s)
        x1, x2, x3 = self._derivatives(s)
        v, a, j = v[:, None], a[:, None], j[:, None]
        return x1 * v, x2 * v**2 + x1 * a, x3 * v**3 + 3.0 * x2 * v * a + x1 * j

    def limit_at(self, s_mm: ArrayLike) -> tuple[NDArray[np.str_], Floats]:
        """Return which limit binds at arc lengths, such as ``jerk of axis 1``, and the share of it that is used.

        Both have shape (n,).
        """
        s = np.atleast_1d(np.asarray(s_mm, dtype=np.float64))
        part = np.clip(np.searchsorted([stops[0] for stops, _ in self.parts], s, side="right") - 1, 0, None)
        motion = np.empty((3, s.size))
        for k in np.unique(part):
            here, profile = np.flatnonzero(part == k), self.parts[k][1]
            breaks = profile.breaks_mm
            piece = np.clip(np.searchsorted(breaks, s[here], side="right") - 1, 0, breaks.size - 2)
            motion[:, here] = profile.at_place(piece, (s[here] - breaks[piece]) / profile.length_mm[piece])
        used = shares_of(
            self._derivatives(s),
            (motion[0], motion[1], motion[2]),
            self.limits.per_axis(self.axes),
            self.limits.feed_at(s),
        )
        which = used.argmax(axis=1)
        return np.array(limit_names(self.axes))[which], used[np.arange(s.size), which]

    def _derivatives(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the derivatives of the path, at a stop those just beside it."""
        length = self.path.length_mm
        beside = np.where(np.isin(s, self.stops_mm), 1e-12 * length * np.where(s < length, 1.0, -1.0), 0.0)
        return self.path.derivatives(s + beside, side=1)


def plan_feed(path: Path, limits: FeedLimits) -> FeedPlan:
    """Return the feed along a path that keeps every limit and takes little time.

    Parameters
    ----------
    path
        The path. Where its direction or its curvature jumps, or where the curvature has no bound, the feed stops;
        such places must be knots of the path.
    limits
        Of the axes and of the feed.

    Raises
    ------
    ArgumentError
        The path has no length, a limit is given for another number of axes, the limit of the feed is not valid
        somewhere on the path, or the curvature has no bound at a place that is not a knot.

    Notes
    -----
    The square ``q`` of the feed is a quadratic spline in the arc length, found by an interior point method in a time
    proportional to its number of pieces. Where the limits are exceeded between the points at which they were
    imposed they are lowered and the plan is made again; in the end the time of each section between two stops is
    stretched until the audit finds no limit exceeded. With a limit of jerk the problem is not convex: the
    plan keeps the limits, but nothing proves that no other plan takes less time. On a butterfly of 4.3 m with the
    limits 2500 mm/s, 25 m/s2 and 500 m/s3 it takes 4.2 % longer than without a limit of jerk, and on a random spline
    17 %; the linear programme that limits the jerk by the feed without a limit of jerk takes 6.6 and 29 % longer.

    Examples
    --------
    >>> class Line:
    ...     length_mm, knots_mm, closed = 1000.0, np.array([0.0, 1000.0]), False
    ...     def points(self, s_mm):
    ...         return np.outer(s_mm, [1.0, 0.0])
    ...     def derivatives(self, s_mm, side=1):
    ...         x_s = np.tile([1.0, 0.0], (s_mm.size, 1))
    ...         return x_s, 0.0 * x_s, 0.0 * x_s
    >>> plan = plan_feed(Line(), FeedLimits(velocity_mm_s=2500, acceleration_mm_s2=25e3, jerk_mm_s3=5e5))
    >>> f"{plan.time_s:.3f} s, {plan.price:+.1%}", plan.audit.passed
    ('0.552 s, +10.5%', True)
    >>> plan.limit_at([5.0, 500.0])[0].tolist()
    ['jerk of axis 0', 'velocity of axis 0']

    References
    ----------
    D. Verscheure et al., Time-optimal path tracking for robots: a convex optimization approach, IEEE Transactions
    on Automatic Control 54 (2009) 2318.
    """
    length = float(path.length_mm)
    if not (np.isfinite(length) and length > 0.0):
        raise ArgumentError("path", f"a length of {length:g} mm", "a path with a length above 0 mm")
    top = limits.per_axis(np.asarray(path.points(np.zeros(1))).shape[1])
    stops, fewer = stops_of(path, top, jerk=True), stops_of(path, top, jerk=False)
    same = stops.size == fewer.size
    parts, free = [], 0.0
    for some in _groups(stops):
        grid = lay_grid(path, some, top, limits.places_mm())
        bounds = _bounds(grid, top, limits)
        free += _without_jerk(grid, bounds) if same else 0.0
        parts.append((some, _planned(grid, bounds, top)))
    if not same:
        for some in _groups(fewer):
            grid = lay_grid(path, some, top, limits.places_mm())
            free += _without_jerk(grid, _bounds(grid, top, limits))
    return FeedPlan(path, limits, tuple(parts), free)


def _groups(stops: Floats) -> Iterator[Floats]:
    for k in range(0, stops.size - 1, _SECTIONS_AT_ONCE):
        yield stops[k : k + _SECTIONS_AT_ONCE + 1]


def _bounds(grid: Grid, top: tuple[Floats, Floats, Floats], limits: FeedLimits) -> Bounds:
    feed = limits.feed_at(grid.s_mm)
    with np.errstate(divide="ignore"):
        fastest = np.minimum((top[0] / abs(grid.derivatives[0])).min(axis=1), feed)
    shape = grid.derivatives[0].shape
    return Bounds(fastest**2, feed, np.broadcast_to(top[1], shape), np.broadcast_to(top[2], shape))


def _without_jerk(grid: Grid, bounds: Bounds) -> float:
    problem = Problem(grid, bounds, jerk=False)
    return problem.time_s(problem.solve(start_shape(grid, bounds, jerk=False)))


def _planned(grid: Grid, bounds: Bounds, top: tuple[Floats, Floats, Floats]) -> Profile:
    """Return the profile within all limits."""
    section, powers, z = grid.section, _powers(top[0].size), start_shape(grid, bounds, jerk=True)
    lowered = np.ones((grid.pieces, powers.size))
    for _ in range(_ROUNDS):
        z = Problem(grid, bounds.lowered(lowered[grid.piece]), jerk=True).solve(z)
        values = ordinates(grid, z, JERK_POWER)
        used = peaks(grid, shares(grid, profile_of(grid, values), top, bounds.along))
        most = np.zeros((grid.pieces, powers.size))
        np.maximum.at(most, grid.piece, used)
        if most.max() <= _EXCEEDS:
            break
        lowered *= np.maximum(most, 1.0)
    worst = np.zeros(grid.first.size)
    np.maximum.at(worst, section, (most**powers).max(axis=1))
    stretch = 1.0 / (worst[section] * (1.0 + _MARGIN))
    return profile_of(grid, (values[0] * stretch, values[1] * stretch, values[2] * stretch))


def _powers(axes: int) -> Floats:
    """Return with which power of the share of each limit the square of the feed falls."""
    return np.concatenate((np.full(1 + axes, 2.0), np.full(axes, 1.0), np.full(axes, 2.0 / 3.0)))
