"""The audit of a feed: how much of each limit of velocity, acceleration and jerk a plan uses, and where."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from rtec.errors import ArgumentError
from rtec.toolpath._feed_grid import SAMPLES, Floats, Grid, Path, lay_grid, stops_of
from rtec.toolpath._feed_profile import Profile

if TYPE_CHECKING:
    from rtec.toolpath.feed import FeedPlan

Feed: TypeAlias = float | ArrayLike | Callable[[Floats], ArrayLike]
_KINDS = ("velocity", "acceleration", "jerk")
_UNITS = ("mm_s", "mm_s2", "mm_s3")
TOLERANCE = 1e-6
"""A plan that exceeds a limit by more than this share of it fails the audit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FeedLimits:
    """Limits of the axes and of the feed along the path.

    Parameters
    ----------
    velocity_mm_s, acceleration_mm_s2, jerk_mm_s3
        One number for all axes, or one per axis, shape (d,); each above zero.
    feed_mm_s
        Upper limit of the feed along the path: a number; an array of shape (n, 2) of arc length in mm, rising, and
        feed, linear between its rows; a function of arc lengths, shape (n,), that returns feeds, shape (n,); or None.

    Raises
    ------
    ArgumentError
        A limit is not a finite number above zero.

    Examples
    --------
    >>> limits = FeedLimits(velocity_mm_s=300, acceleration_mm_s2=2000, jerk_mm_s3=(50e3, 40e3), feed_mm_s=100)
    >>> limits.per_axis(2)[2].tolist(), limits.feed_at([0.0, 5.0]).tolist()
    ([50000.0, 40000.0], [100.0, 100.0])
    >>> FeedLimits(velocity_mm_s=0, acceleration_mm_s2=2000, jerk_mm_s3=50e3)
    Traceback (most recent call last):
        ...
    rtec.errors.ArgumentError: velocity_mm_s: 0 is not valid; use finite numbers above 0, one or one per axis
    """

    velocity_mm_s: ArrayLike
    acceleration_mm_s2: ArrayLike
    jerk_mm_s3: ArrayLike
    feed_mm_s: Feed | None = None

    def __post_init__(self) -> None:
        for kind, unit in zip(_KINDS, _UNITS, strict=True):
            name = f"{kind}_{unit}"
            value = getattr(self, name)
            if not _above_zero(value) or np.ndim(value) > 1 or np.size(value) == 0:
                raise ArgumentError(name, _short(value), "finite numbers above 0, one or one per axis")
        if self.feed_mm_s is None or callable(self.feed_mm_s):
            return
        if np.ndim(self.feed_mm_s) == 0 and _above_zero(self.feed_mm_s):
            return
        table = _numbers(self.feed_mm_s)
        if table is None or table.ndim != 2 or table.shape[1] != 2 or not table.size or not _above_zero(table[:, 1]):
            allowed = "a number above 0, rows of arc length and feed above 0, or a function of the arc length"
            raise ArgumentError("feed_mm_s", _short(self.feed_mm_s), allowed)
        if not np.isfinite(table).all() or not (np.diff(table[:, 0]) > 0.0).all():
            raise ArgumentError("feed_mm_s", "arc lengths that do not rise", "rows of arc length and feed that rise")

    def per_axis(self, axes: int) -> tuple[Floats, Floats, Floats]:
        """Return velocity, acceleration and jerk of each axis, shape (axes,).

        Raises
        ------
        ArgumentError
            A limit is given for another number of axes.
        """
        rows = []
        for kind, unit in zip(_KINDS, _UNITS, strict=True):
            value = np.asarray(getattr(self, f"{kind}_{unit}"), dtype=np.float64)
            if value.ndim and value.size != axes:
                found = f"an array of {value.size} numbers"
                raise ArgumentError(f"{kind}_{unit}", found, f"one, or {axes}: one per axis")
            rows.append(np.broadcast_to(value, (axes,)).copy())
        return rows[0], rows[1], rows[2]

    def feed_at(self, s_mm: ArrayLike) -> Floats:
        """Return the limit of the feed at arc lengths, shape (n,); infinite where there is none.

        Raises
        ------
        ArgumentError
            A function does not return one finite feed above zero for each arc length.
        """
        s = np.asarray(s_mm, dtype=np.float64)
        if self.feed_mm_s is None:
            return np.full(s.shape, np.inf)
        if callable(self.feed_mm_s):
            feed = _numbers(self.feed_mm_s(s))
            if feed is None or feed.shape not in {(), s.shape} or not _above_zero(feed):
                raise ArgumentError("feed_mm_s", "a function with other values", "one that returns feeds above 0")
            return np.broadcast_to(feed, s.shape).copy()
        table = np.asarray(self.feed_mm_s, dtype=np.float64)
        return np.full(s.shape, float(table)) if table.ndim == 0 else np.interp(s, table[:, 0], table[:, 1])

    def places_mm(self) -> Floats:
        """Return the arc lengths at which the limit of the feed bends, shape (n,)."""
        table = np.zeros(0) if self.feed_mm_s is None or callable(self.feed_mm_s) else np.asarray(self.feed_mm_s)
        return np.asarray(table[:, 0], dtype=np.float64) if table.ndim == 2 else np.zeros(0)


def _numbers(value: object) -> Floats | None:
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        return None


def _above_zero(value: object) -> bool:
    numbers = _numbers(value)
    return numbers is not None and bool((np.isfinite(numbers) & (numbers > 0.0)).all())


def _short(value: object) -> str:
    return repr(value)[:60]


@dataclass(frozen=True, slots=True)
class LimitUse:
    """The largest share of one limit that a plan uses, and where."""

    kind: str
    """``velocity``, ``acceleration``, ``jerk``, or ``feed``."""
    axis: int
    """Number of the axis from 0; -1 of the feed."""
    share: float
    """1 where the limit is just reached."""
    place: float
    """Arc length in mm; of positions over time the time in s."""

    @property
    def name(self) -> str:
        """Words for the limit, such as ``jerk of axis 1``."""
        return self.kind if self.axis < 0 else f"{self.kind} of axis {self.axis}"


@dataclass(frozen=True, slots=True)
class Audit:
    """Result of an audit."""

    uses: tuple[LimitUse, ...]
    """One of each limit."""
    points: int
    """Number of places at which the limits were checked."""
    unit: str
    """Of the places: ``mm`` of arc length or ``s``."""

    @property
    def worst(self) -> LimitUse:
        """The limit of which the largest share is used."""
        return max(self.uses, key=lambda use: use.share)

    @property
    def passed(self) -> bool:
        """Whether no limit is exceeded by more than `TOLERANCE` of itself."""
        return self.worst.share <= 1.0 + TOLERANCE

    def __str__(self) -> str:
        worst = self.worst
        said = "limits kept" if self.passed else "limits exceeded"
        return (
            f"{said}: at most {100.0 * worst.share:.5f} % of a limit "
            f"({worst.name} at {worst.place:.6g} {self.unit}; {self.points} places checked)"
        )


def audit(path: Path, plan: FeedPlan, limits: FeedLimits) -> Audit:
    """Return how much of each limit a plan uses along a path.

    Parameters
    ----------
    path, plan
        The path, and a plan of it.
    limits
        Those to check, which may be others than those of the plan.

    Notes
    -----
    Limits are checked at twenty intervals of each piece of the plan, ten times as many as it was made with, and on
    both sides of each piece and of each knot of the path. Between three neighbours a parabola gives the peak.
    """
    top = limits.per_axis(plan.axes)
    missed = np.setdiff1d(stops_of(path, top, jerk=True), plan.stops_mm)
    jumps = tuple(LimitUse("jerk", axis, np.inf, float(missed[0])) for axis in range(plan.axes) if missed.size)
    parts = [Audit(jumps, missed.size, "mm")] if jumps else []
    for stops, profile in plan.parts:
        grid = lay_grid(path, stops, top, limits.places_mm(), profile.breaks_mm)
        parts.append(_uses(grid, shares(grid, profile, top, limits.feed_at(grid.s_mm))))
    return merged(parts)


def shares(grid: Grid, profile: Profile, top: tuple[Floats, Floats, Floats], feed: Floats) -> Floats:
    """Return the share of each limit at the points of a grid, shape (p, 1 + 3 d): feed, velocities, ... jerks."""
    return shares_of(grid.derivatives, profile.at_place(grid.piece, grid.share), top, feed)


def shares_of(
    derivatives: tuple[Floats, Floats, Floats],
    motion: tuple[Floats, Floats, Floats],
    top: tuple[Floats, Floats, Floats],
    feed: Floats,
) -> Floats:
    """Return the share of each limit where the path has some derivatives and ``q`` and its two have some values."""
    (x1, x2, x3), (q, q1, q2) = derivatives, (each[:, None] for each in motion)
    speed = np.sqrt(q)
    velocity, acceleration = x1 * speed, x2 * q + 0.5 * x1 * q1
    jerk = speed * (x3 * q + 1.5 * x2 * q1 + 0.5 * x1 * q2)
    return abs(np.hstack([speed / feed[:, None], velocity / top[0], acceleration / top[1], jerk / top[2]]))


def peaks(grid: Grid, share: Floats) -> Floats:
    """Return the shares with those between the points, shape (p, k): the peak of the parabola of three neighbours."""
    found = share.copy()
    y = found[: grid.pieces * (SAMPLES + 1)].reshape(grid.pieces, SAMPLES + 1, -1)
    left, middle, right = y[:, :-2].copy(), y[:, 1:-1].copy(), y[:, 2:].copy()
    bend = left - 2.0 * middle + right
    top = (middle >= left) & (middle >= right) & (bend < 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        y[:, 1:-1] += np.where(top, (right - left) ** 2 / (-8.0 * bend), 0.0)
    return found


def _uses(grid: Grid, share: Floats) -> Audit:
    share = peaks(grid, share)
    axes = (share.shape[1] - 1) // 3
    names = _columns(axes)
    where = share.argmax(axis=0)
    uses = tuple(
        LimitUse(kind, axis, float(share[at, column]), float(grid.s_mm[at]))
        for column, ((kind, axis), at) in enumerate(zip(names, where, strict=True))
    )
    return Audit(uses, share.shape[0], "mm")


def _columns(axes: int) -> list[tuple[str, int]]:
    return [("feed", -1)] + [(kind, axis) for kind in _KINDS for axis in range(axes)]


def limit_names(axes: int) -> list[str]:
    """Return the words for each limit, in the order of the shares."""
    return [LimitUse(kind, axis, 0.0, 0.0).name for kind, axis in _columns(axes)]


def merged(parts: list[Audit]) -> Audit:
    """Return the audit of several parts of one path."""
    worst: dict[str, LimitUse] = {}
    for use in (each for part in parts for each in part.uses):
        if use.name not in worst or use.share > worst[use.name].share:
            worst[use.name] = use
    return Audit(tuple(worst.values()), sum(part.points for part in parts), parts[0].unit)


def audit_positions(
    t_s: ArrayLike, positions_mm: ArrayLike, limits: FeedLimits, *, resolution_mm: float | None = None
) -> Audit:
    """Return how much of each limit a motion uses that is given by positions over time.

    Parameters
    ----------
    t_s
        Times, rising, shape (n,) with n at least 4; steps may differ.
    positions_mm
        Shape (n, d), or (n,) of one axis.
    limits
        Limits of the axes. That of the feed is checked where it is a number.
    resolution_mm
        To what the positions are rounded; that of floating-point numbers if None.

    Returns
    -------
    Audit
        Places are times in s. What rounding alone can cause is not counted.

    Raises
    ------
    ArgumentError
        Fewer than four samples, other shapes, numbers that are not finite, or times that do not rise.

    Notes
    -----
    Derivatives are divided differences: weighted averages of the true derivative over two to four neighbours. They
    never exceed its largest value, and come near to it where the sampling is fine against the ramps of the motion.

    Examples
    --------
    >>> t = np.linspace(0.0, 1.0, 1001)
    >>> limits = FeedLimits(velocity_mm_s=10, acceleration_mm_s2=10, jerk_mm_s3=5)
    >>> found = audit_positions(t, t**3, limits)
    >>> found.worst.name, round(found.worst.share, 3), found.passed
    ('jerk of axis 0', 1.2, False)
    """
    t, x = _numbers(t_s), _numbers(positions_mm)
    if t is None or x is None or t.ndim != 1 or t.size < 4 or x.ndim not in {1, 2} or x.shape[0] != t.size:
        raise ArgumentError("positions_mm", "other shapes", "at least 4 times and as many rows of positions")
    if not (np.isfinite(t).all() and np.isfinite(x).all() and (np.diff(t) > 0.0).all()):
        raise ArgumentError("t_s", "times or positions that are not valid", "finite numbers, and times that rise")
    x = x.reshape(t.size, -1)
    axes = x.shape[1]
    rounding = 4.0 * float(np.spacing(abs(x).max())) if resolution_mm is None else resolution_mm / 2.0
    number = limits.feed_mm_s is not None and not callable(limits.feed_mm_s) and np.ndim(limits.feed_mm_s) == 0
    feed = limits.feed_at(np.zeros(1))[0] if number else np.inf
    uses = []
    differences, noise, factor = x, np.full((t.size, 1), rounding), 1.0
    for order, (kind, top) in enumerate(zip(_KINDS, limits.per_axis(axes), strict=True), start=1):
        span = (t[order:] - t[:-order])[:, None]
        differences, noise = np.diff(differences, axis=0) / span, (noise[1:] + noise[:-1]) / span
        factor *= order
        value, middle = factor * np.maximum(abs(differences) - noise, 0.0), (t[order:] + t[:-order]) / 2.0
        if order == 1:
            along = np.linalg.norm(value, axis=1) / feed
            uses.append(LimitUse("feed", -1, float(along.max()), float(middle[along.argmax()])))
        at = (value / top).argmax(axis=0)
        uses += [
            LimitUse(kind, axis, float(value[at[axis], axis] / top[axis]), float(middle[at[axis]]))
            for axis in range(axes)
        ]
    return Audit(tuple(uses), t.size, "s")
