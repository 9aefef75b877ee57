"""Toolpaths by arc length: points, derivatives and curvature, for feed planning and for contour errors."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt
from numpy.polynomial.chebyshev import chebint

from rtec.errors import ArgumentError
from rtec.toolpath import _nurbs_kernels as kernels
from rtec.toolpath.nurbs import LARGEST_MM, Nurbs

Floats = npt.NDArray[np.float64]

TOLERANCE = 1e-9
"""Of arc lengths, relative to the length of the path; panels are halved until they are far better."""
TERMS = 16
"""Chebyshev coefficients of each panel."""
MOST_HALVINGS = 30
_SERIES = 1e-12
"""Largest last coefficients of a panel's series, relative to the panel."""
_ROUNDING = 1e-15
"""Rounding of points, relative to the largest coordinate."""
_REST = 1e-9
"""A curve rests where it is slower than this part of the mean speed of its span."""
_JUMP = 1e-6
"""Jumps of direction (radians) and of curvature (relative) that are more than rounding."""
_FLAT_PER_MM = 1e-8
"""Jumps of curvature that no drive feels: 0.06 mm/s² at 2.5 m/s."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Path:
    """A NURBS as a function of its arc length.

    Parameters
    ----------
    name
        For messages and titles.
    curve
        The geometry.
    feed_limits
        (spans of the curve,) Largest feed allowed, in mm/s; None: no limit.

    Raises
    ------
    ArgumentError
        A cusp or coincident control points: the derivative by the parameter is zero somewhere. (A reversal at a knot
        with derivatives on both sides is a corner.) Not one limit of the feed for each span.

    Notes
    -----
    Spans are divided into panels. In each panel the speed is a Chebyshev series, whose integral is the arc length;
    a second series gives the parameter as a function of the arc length. A panel is halved until both series have
    converged. Evaluating a point then needs two polynomials and no iteration, and errors do not grow with the length.

    Examples
    --------
    >>> from rtec.toolpath import circle
    >>> path = circle(radius_mm=100.0)
    >>> round(path.length_mm, 9), path.points([0.0, path.length_mm / 8]).round(6).tolist()
    (628.318530718, [[100.0, 0.0], [70.710678, 70.710678]])
    """

    name: str
    curve: Nurbs
    feed_limits: Floats | None = None
    length_mm: float = field(init=False)
    knots_mm: Floats = field(init=False, repr=False)
    """Arc lengths, from 0 to the length, at which the third derivative may jump."""
    _table: kernels.Table = field(init=False, repr=False)

    def __post_init__(self) -> None:
        count = self.curve.coefficients.shape[0]
        if self.feed_limits is not None and np.shape(self.feed_limits) != (count,):
            raise ArgumentError("feed_limits", f"an array of shape {np.shape(self.feed_limits)}", f"{count} numbers")
        spans, ends, inverse = _panels(self.name, self.curve)
        set_field = object.__setattr__
        set_field(self, "length_mm", float(ends[-1]))
        set_field(self, "knots_mm", ends[np.r_[True, np.diff(spans) > 0, True]])
        set_field(self, "_table", (ends, spans, inverse, self.curve.coefficients, self.curve.rational))

    @property
    def dimensions(self) -> int:
        """2 or 3."""
        return self.curve.dimensions

    @cached_property
    def closed(self) -> bool:
        """Whether the path ends where it begins."""
        first, last = self.points([0.0, self.length_mm])
        return bool(np.abs(first - last).max() <= TOLERANCE * self.length_mm)

    @cached_property
    def corners_mm(self) -> Floats:
        """Arc lengths at which direction or curvature jumps. With limited jerk the feed must be zero there."""
        knots = self.knots_mm[1:-1]
        before, after = self.derivatives(knots, side=-1), self.derivatives(knots, side=1)
        turns = np.linalg.norm(after[0] - before[0], axis=1) > _JUMP
        bends = np.maximum(np.linalg.norm(before[1], axis=1), np.linalg.norm(after[1], axis=1))
        gaps = np.diff(self.knots_mm)
        rounding = _ROUNDING * np.abs(self.curve.coefficients).max() / np.minimum(gaps[1:], gaps[:-1]) ** 2
        least = _JUMP * bends + _FLAT_PER_MM + 100.0 * rounding
        return np.asarray(knots[turns | (np.linalg.norm(after[1] - before[1], axis=1) > least)])

    def points(self, s_mm: npt.ArrayLike) -> Floats:
        """Return points, in mm.

        Parameters
        ----------
        s_mm
            (n,) Arc lengths, 0 to ``length_mm``.

        Returns
        -------
        numpy.ndarray
            (n, dimensions)

        Raises
        ------
        ArgumentError
            An arc length beyond an end of the path.
        """
        return np.asarray(self._along(s_mm, 0, 1)[0])

    def derivatives(self, s_mm: npt.ArrayLike, *, side: int = 1) -> tuple[Floats, Floats, Floats]:
        """Return the first three derivatives by arc length, each (n, dimensions): no unit, 1/mm, 1/mm².

        At a knot ``side`` = -1 gives the limit from before, +1 the limit from behind.

        Raises
        ------
        ArgumentError
            An arc length beyond an end of the path.
        """
        _, first, second, third = self._along(s_mm, 3, side)
        return first, second, third

    def curvature(self, s_mm: npt.ArrayLike, *, side: int = 1) -> Floats:
        """Return the curvature (n,) in 1/mm: in the plane positive where the path turns left, in space its size."""
        _, first, second = self._along(s_mm, 2, side)
        if self.dimensions == 2:
            return np.asarray(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
        return np.asarray(np.linalg.norm(second, axis=1))

    def feed_limit_mm_s(self, s_mm: npt.ArrayLike, *, side: int = 1) -> Floats:
        """Return the largest feed allowed (n,) by the F words of a program; infinite where none applies."""
        where = self._within(s_mm)
        if self.feed_limits is None:
            return np.full(where.size, np.inf)
        span = np.searchsorted(self.knots_mm, where, side="right" if side > 0 else "left") - 1
        return np.asarray(self.feed_limits[np.clip(span, 0, self.feed_limits.size - 1)])

    def feet(self, s_mm: npt.ArrayLike, actual_mm: npt.ArrayLike, *, near_mm: float = 1e-10) -> Floats:
        """Return the arc length (n,) of the point of the path that is nearest to each actual point, on its branch.

        Parameters
        ----------
        s_mm
            (n,) Commanded arc lengths, in the order of time.
        actual_mm
            (n, dimensions) Points reached at the same times.
        near_mm
            How far the search converges.

        Notes
        -----
        The search is local. It starts as far from the commanded arc length as the last foot was, and there: where
        the path crosses itself the foot stays on the branch of the motion, and behind an inner corner it leaves the
        leg before.
        """
        commanded = self._within(s_mm)
        actual = np.ascontiguousarray(actual_mm, dtype=np.float64)
        if actual.shape != (commanded.size, self.dimensions):
            allowed = f"({commanded.size}, {self.dimensions}): one point for each arc length"
            raise ArgumentError("actual_mm", f"an array of shape {actual.shape}", allowed)
        if not (np.abs(actual) <= 10.0 * LARGEST_MM).all():
            raise ArgumentError("actual_mm", "a point far off", f"finite numbers within {10.0 * LARGEST_MM:g} mm")
        out = np.empty(commanded.size)
        kernels.project(self._table, self.closed, commanded, actual, near_mm, out)
        return np.mod(out, self.length_mm) if self.closed else out

    def _along(self, s_mm: npt.ArrayLike, orders: int, side: int) -> Floats:
        where = self._within(s_mm)
        out = np.empty((orders + 1, where.size, self.dimensions))
        kernels.along(self._table, where, side, out)
        return out

    def _within(self, s_mm: npt.ArrayLike) -> Floats:
        where = np.atleast_1d(np.asarray(s_mm, dtype=np.float64))
        slack = TOLERANCE * self.length_mm
        if where.ndim != 1 or not ((where >= -slack) & (where <= self.length_mm + slack)).all():
            raise ArgumentError("s_mm", "an arc length off the path", f"0 to {self.length_mm:.10g} mm, in one row")
        return np.clip(where, 0.0, self.length_mm)


def _nodes(terms: int) -> tuple[Floats, Floats]:
    """Return Chebyshev's nodes from -1 to 1, and the matrix from values there to coefficients."""
    angles = np.pi * (np.arange(terms)[::-1] + 0.5) / terms
    matrix = np.cos(np.outer(np.arange(terms), angles)) * 2.0 / terms
    matrix[0] /= 2.0
    return np.cos(angles), matrix


def _panels(name: str, curve: Nurbs) -> tuple[npt.NDArray[np.int64], Floats, Floats]:
    """Return the panels of a path in order: the spans, the arc lengths of all ends, the inverse series."""
    nodes, matrix = _nodes(TERMS)
    spans = np.arange(curve.coefficients.shape[0])
    low, high = np.full(spans.size, -1.0), np.full(spans.size, 1.0)
    kept: list[tuple[npt.NDArray[np.int64], Floats, Floats, Floats]] = []
    rounding = _ROUNDING * float(np.abs(curve.coefficients).max())
    rest = np.empty(0)
    for _ in range(MOST_HALVINGS):
        half = (high - low) / 2.0
        speed = np.empty((spans.size, TERMS))
        kernels.speeds(
            curve.coefficients, curve.rational, spans, (low + half)[:, None] + half[:, None] * nodes, speed
        )
        rest = rest if rest.size else np.maximum(_REST * speed.mean(axis=1), 10.0 * rounding)
        if (speed <= rest[spans, None]).any():
            spans, low, high = (each[(speed <= rest[spans, None]).any(axis=1)] for each in (spans, low, high))
            break
        series = half[:, None] * (speed @ matrix.T)
        arc = chebint(series, lbnd=-1, axis=1)
        length, x = arc.sum(axis=1), np.empty_like(speed)
        kernels.invert(arc, series, nodes, x)
        inverse = x @ matrix.T
        noise = rounding * half / series[:, 0]
        good = (np.abs(series[:, -2:]).max(axis=1) <= (_SERIES + noise) * series[:, 0]) & (
            np.abs(inverse[:, -2:]).max(axis=1) <= _SERIES + noise
        )
        inverse = half[:, None] * inverse
        inverse[:, 0] += low + half
        kept.append((spans[good], low[good], length[good], inverse[good]))
        middle = (low + half)[~good]
        spans = np.repeat(spans[~good], 2)
        low, high = (
            np.column_stack([low[~good], middle]).ravel(),
            np.column_stack([middle, high[~good]]).ravel(),
        )
        if not spans.size:
            break
    if spans.size:
        first, last = curve.breaks[spans[0]], curve.breaks[spans[0] + 1]
        where = first + (last - first) * (low[0] + 1.0) / 2.0
        problem = f"has a cusp or coincident control points near parameter {where:.6g}"
        raise ArgumentError(name, "", "a curve whose first derivative is nowhere zero", problem=problem)
    of, begins, lengths, series = (np.concatenate(parts) for parts in zip(*kept, strict=True))
    order = np.lexsort((begins, of))
    return of[order], np.concatenate([[0.0], np.cumsum(lengths[order])]), series[order]
