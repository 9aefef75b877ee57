"""Where the feed is planned: the stops of a path, the pieces between them, and the points at which limits hold."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rtec.errors import ArgumentError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_TANGENT_JUMP, _ACCELERATION_JUMP = 1e-9, 1e-8
"""A larger jump of the tangent, or of the acceleration as a share of its limit, is a stop."""
_CORNER = 0.02
"""A larger jump of the tangent between two pieces is a corner that is not one of the knots."""
_TURN_RAD = 0.1
"""Largest turn of the tangent within one piece."""
_GROWTH = 0.3
"""Largest length of a piece as a share of its distance from the nearest stop."""
_MOST_PIECES = 200_000
_SMALLEST = 1e-12
"""Length of the shortest piece as a share of the path."""
SAMPLES = 20
"""Intervals of a piece at whose ends the audit looks; the limits are imposed at both ends and in the middle."""


class Path(Protocol):
    """A path by arc length in ``d`` axes, such as those of `rtec.toolpath`."""

    @property
    def length_mm(self) -> float:
        """Length of the path."""

    @property
    def knots_mm(self) -> Floats:
        """Arc lengths, shape (k,), where ``x_sss`` may jump."""

    @property
    def closed(self) -> bool:
        """Whether the path ends where it begins."""

    def points(self, s_mm: Floats) -> Floats:
        """Return the points in mm, shape (n, d), at arc lengths of shape (n,)."""

    def derivatives(self, s_mm: Floats, *, side: int = 1) -> tuple[Floats, Floats, Floats]:
        """Return three derivatives by arc length, each of shape (n, d); ``side`` is -1 or +1 of a knot."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Pieces of a path and the points on them at which limits are checked.

    Each section, from one stop to the next, has a first and a last piece of constant jerk and at least four between.
    """

    breaks_mm: Floats
    """Shape (n + 1,)."""
    first: Ints
    last: Ints
    """First and last piece of each section, shape (m,)."""
    piece: Ints
    """Of each point, shape (p,); `SAMPLES` + 1 points a piece, then those at knots within pieces."""
    share: Floats
    """Place of each point in its piece, 0 to 1, shape (p,)."""
    s_mm: Floats
    """Arc length of each point, shape (p,)."""
    derivatives: tuple[Floats, Floats, Floats]
    """Of the path at each point, shape (p, d)."""

    @property
    def pieces(self) -> int:
        """Number of pieces."""
        return self.breaks_mm.size - 1

    @property
    def section(self) -> Ints:
        """Section of each piece, shape (n,)."""
        return np.repeat(np.arange(self.first.size), self.last - self.first + 1)

    @property
    def end(self) -> Ints:
        """Of each piece, shape (n,): +1 where it leaves a stop, -1 where it comes to one, else 0."""
        end = np.zeros(self.pieces, dtype=np.int64)
        end[self.first], end[self.last] = 1, -1
        return end


def stops_of(path: Path, top: tuple[Floats, Floats, Floats], *, jerk: bool) -> Floats:
    """Return the arc lengths at which the path must be at rest, with both ends.

    Parameters
    ----------
    path
        The path.
    top
        Limits of velocity, acceleration and jerk of each axis, shape (d,).
    jerk
        Whether the jerk is limited: then the feed stops where the curvature jumps, too.
    """
    length = float(path.length_mm)
    knots = _knots(path)
    with np.errstate(all="ignore"):
        (t0, k0, _), (t1, k1, _) = path.derivatives(knots, side=-1), path.derivatives(knots, side=1)
        tangent, curvature = np.maximum(abs(t0), abs(t1)), np.maximum(abs(k0), abs(k1))
        fastest = np.minimum((top[0] / tangent).min(axis=1) ** 2, (top[1] / curvature).min(axis=1))
        jump = (abs(k1 - k0) * fastest[:, None] / top[1]).max(axis=1)
        allowed = _ACCELERATION_JUMP if jerk else np.finfo(np.float64).max
        smooth = (abs(t1 - t0).max(axis=1) <= _TANGENT_JUMP) & (jump <= allowed)
    return np.concatenate(([0.0], knots[~smooth], [length]))


def lay_grid(
    path: Path, stops: Floats, top: tuple[Floats, Floats, Floats], extra_mm: Floats, breaks_mm: Floats | None = None
) -> Grid:
    """Return the pieces of a path between its stops, or between some of them.

    Parameters
    ----------
    path
        The path.
    stops
        Arc lengths at which it is at rest, shape (m + 1,).
    top
        Limits of velocity, acceleration and jerk of each axis, shape (d,).
    extra_mm
        More arc lengths at which limits are checked.
    breaks_mm
        The ends of the pieces; they are chosen if None.

    Raises
    ------
    ArgumentError
        The path has a curvature without bound at a place that is not one of its knots, or needs too many pieces.
    """
    length = float(path.length_mm)
    low, high = stops[0], stops[-1]
    knots = _knots(path)
    knots = knots[(knots > low) & (knots < high)]
    breaks = breaks_mm
    if breaks is None:
        breaks = _bisected(path, stops, _thinned(knots, stops, length * 1e-7), _largest_piece_mm(length, top))
    extra = np.union1d(knots, extra_mm[(extra_mm > low) & (extra_mm < high)])
    inside = np.setdiff1d(extra, breaks)
    place = np.searchsorted(breaks, inside) - 1
    n, width = breaks.size - 1, np.diff(breaks)
    within = (inside - breaks[place]) / width[place]
    piece = np.concatenate((np.repeat(np.arange(n), SAMPLES + 1), place, place))
    share = np.concatenate((np.tile(np.linspace(0.0, 1.0, SAMPLES + 1), n), within, within))
    s = np.where(share == 1.0, breaks[piece + 1], breaks[piece] + share * width[piece])
    s[n * (SAMPLES + 1) :] = np.concatenate((inside, inside))
    left = (share == 1.0) | (np.arange(s.size) >= s.size - inside.size)
    derivatives = _both_sides(path, s, left, 1e-9 * width[piece] + 4.0 * np.spacing(length))
    before, after = (derivatives[0][k : n * (SAMPLES + 1) : SAMPLES + 1] for k in (SAMPLES, 0))
    jump = abs(after[1:] - before[:-1]).max(axis=1) > _CORNER
    _refuse_corner(np.setdiff1d(breaks[1:-1][jump], stops))
    return Grid(
        breaks_mm=breaks,
        first=np.searchsorted(breaks, stops[:-1]),
        last=np.searchsorted(breaks, stops[1:]) - 1,
        piece=piece,
        share=share,
        s_mm=s,
        derivatives=derivatives,
    )


def _refuse_corner(s: Floats) -> None:
    if s.size:
        where = f"a corner or cusp at s = {s[0]:.6g} mm that is not one of its knots"
        raise ArgumentError("path", where, "a path with a knot there: the feed stops at it")


def _knots(path: Path) -> Floats:
    knots = np.unique(np.asarray(path.knots_mm, dtype=np.float64))
    return knots[(knots > 0.0) & (knots < path.length_mm)]


def _both_sides(path: Path, s: Floats, left: NDArray[np.bool_], beside: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the derivatives of the path just inside each piece: at a stop it need not have any."""
    seen = np.where(left, s - beside, s + beside)
    found = [path.derivatives(seen[which], side=side) for which, side in ((~left, 1), (left, -1))]
    derivatives = [np.empty((s.size, found[0][0].shape[1])) for _ in range(3)]
    for i, into in enumerate(derivatives):
        into[~left], into[left] = found[0][i], found[1][i]
    bad = ~np.isfinite(np.hstack(derivatives)).all(axis=1)
    if bad.any():
        where = f"no finite curvature at s = {s[bad][0]:.6g} mm"
        allowed = "a path with a knot where its curvature has no bound: the feed stops there"
        raise ArgumentError("path", where, allowed)
    return derivatives[0], derivatives[1], derivatives[2]


def _largest_piece_mm(length: float, top: tuple[Floats, Floats, Floats]) -> float:
    """Return an eighth of the way of a jerk ramp at full speed, or a sixteenth of that of full acceleration."""
    v, a, j = top
    ramp = max(float((v * a / j).min()) / 8.0, float((v * v / a).min()) / 32.0)
    return max(min(ramp, length / 400.0), length / 10_000.0)


def _thinned(knots: Floats, stops: Floats, gap: float) -> Floats:
    """Return stops and knots without the knots that are nearer than a gap to their neighbour."""
    inner = np.setdiff1d(knots, stops)
    cell = np.floor(inner / gap).astype(np.int64)
    inner = inner[np.concatenate(([True], np.diff(cell) > 1))] if inner.size else inner
    after = np.searchsorted(stops, inner)
    near = np.minimum(stops[after] - inner, inner - stops[after - 1])
    return np.union1d(inner[near > gap], stops)


def _bisected(path: Path, stops: Floats, breaks: Floats, largest: float) -> Floats:
    """Return the breaks with every piece halved until it is short, turns little and grows slowly from the stops."""
    section = np.diff(stops)
    shortest = np.minimum(largest, section / 16.0) / 16.0
    floor = _SMALLEST * float(path.length_mm)
    while True:
        width = np.diff(breaks)
        middle = (breaks[1:] + breaks[:-1]) / 2.0
        k = np.clip(np.searchsorted(stops, middle) - 1, 0, section.size - 1)
        away = np.minimum(breaks[:-1] - stops[k], stops[k + 1] - breaks[1:])
        halve = (width > largest) | (width > section[k] / 10.0) | (width > np.maximum(shortest[k], _GROWTH * away))
        before, after = np.roll(width, 1), np.roll(width, -1)
        before[0], after[-1] = width[0], width[-1]
        halve |= (width > 2.1 * before) & (breaks[:-1] != stops[k])
        halve |= (width > 2.1 * after) & (breaks[1:] != stops[k + 1])
        look = ~halve
        if look.any():
            ends = [(breaks[:-1] + width * f)[look] for f in (1e-6, 0.5, 1.0 - 1e-6)]
            tangents = [path.derivatives(each, side=1)[0] for each in ends]
            turns = [np.linalg.norm(b - a, axis=1) for a, b in pairwise(tangents)]
            halve[look] = turns[0] + turns[1] > _TURN_RAD
            sharp = look & halve & (width <= floor)
            _refuse_corner(breaks[:-1][sharp])
        halve &= width > floor
        if not halve.any():
            return breaks
        if breaks.size > _MOST_PIECES:
            raise ArgumentError("path", f"more than {_MOST_PIECES} pieces", "a shorter path, or fewer corners")
        breaks = np.union1d(breaks, middle[halve])
