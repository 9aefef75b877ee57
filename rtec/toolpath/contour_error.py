"""Contour error: how far points that were reached lie from the path; exact, and by the estimates of the literature.

All take commanded arc lengths (n,) and actual points (n, dimensions), in mm and in the order of time. R is the
commanded and P the actual point; a, b and c are the parts of P - R along the tangent, the normal and the binormal at
R. In the plane the normal points to the left of the motion, the curvature k is positive where the path turns left,
and errors are positive to the left. In space the normal points to the centre of curvature; errors are distances.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.toolpath.path import Path

Floats = npt.NDArray[np.float64]

TRUSTED = 0.3
"""|k (P - R)| up to which the second-order formula is to be used; beyond, project."""


class Estimate(Enum):
    """A formula for the contour error that needs the commanded point only."""

    LINE = "line"
    """The distance from the tangent: b (Yeh and Hsu 2002)."""
    CIRCLE = "circle"
    """The distance from the circle of curvature (Koren and Lo 1991)."""
    SECOND_ORDER = "second-order"
    """b - k a^2 / (2 (1 - k b)) (Zhu, Zhao and Ding 2013)."""
    AS_PRINTED = "as printed"
    """Equations 3 and 4 of Erwinski et al. 2016 (1 and 2 of 2019) to the letter."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ContourError:
    """Contour errors from feet on the path; arrays of (n,), in mm."""

    foot_mm: Floats
    """Arc length of the nearest point of the branch."""
    error_mm: Floats
    """In the plane positive to the left of the motion, in space the distance."""
    normal_mm: Floats
    """Its part along the normal; where a path in space is straight, all of it."""
    binormal_mm: Floats
    """Its part along the binormal; 0 in the plane."""


def contour_error(path: Path, s_mm: npt.ArrayLike, actual_mm: npt.ArrayLike) -> ContourError:
    """Project actual points onto the path, and keep to the branch of the motion where it crosses itself.

    Raises
    ------
    ArgumentError
        Arc lengths off the path, or not one actual point for each.

    Notes
    -----
    Feet are converged to 1e-10 mm of arc length (`Path.feet`). At a corner, and at the end of an open path, the error
    is the distance from the foot, with the sign of the side.

    Examples
    --------
    >>> from rtec.toolpath import circle
    >>> found = contour_error(circle(radius_mm=100.0), [0.0], [[99.0, 1.0]])
    >>> float(found.error_mm[0].round(6)), float(found.foot_mm[0].round(6))
    (0.99495, 1.010067)
    """
    foot = path.feet(s_mm, actual_mm)
    off = np.asarray(actual_mm, dtype=np.float64) - path.points(foot)
    tangent, bend, _ = path.derivatives(foot)
    distance = np.linalg.norm(off, axis=1)
    if path.dimensions == 2:
        error = np.copysign(distance, tangent[:, 0] * off[:, 1] - tangent[:, 1] * off[:, 0])
        return ContourError(foot_mm=foot, error_mm=error, normal_mm=error, binormal_mm=np.zeros_like(error))
    normal, curvature = _normals(bend)
    binormal = np.einsum("ij,ij->i", off, np.cross(tangent, normal))
    along = np.where(curvature > 0.0, np.einsum("ij,ij->i", off, normal), distance)
    return ContourError(foot_mm=foot, error_mm=distance, normal_mm=along, binormal_mm=binormal)


def estimate(path: Path, s_mm: npt.ArrayLike, actual_mm: npt.ArrayLike, formula: Estimate) -> Floats:
    """Return contour errors (n,) in mm by a formula.

    ``CIRCLE`` and ``SECOND_ORDER`` are no number where the actual point lies at the centre of curvature or beyond,
    ``AS_PRINTED`` where the printed root is of a negative number.

    Raises
    ------
    ArgumentError
        Arc lengths off the path, or not one actual point for each.

    Notes
    -----
    The printed formula adds k, in 1/mm, to numbers without a unit where k b belongs, and subtracts a length from a
    squared length below the root: what it gives depends on the unit of length.

    Examples
    --------
    >>> from rtec.toolpath import circle
    >>> path = circle(radius_mm=100.0)
    >>> {each.value: round(float(estimate(path, [0.0], [[99.0, 1.0]], each)[0]), 6) for each in Estimate}
    {'line': 1.0, 'circle': 0.99495, 'second-order': 0.994949, 'as printed': 1.005051}
    """
    off, tangent, a, b, c, k, _ = _parts(path, s_mm, actual_mm)
    inside = np.where(k * b < 1.0, 1.0 - k * b, np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        if formula is Estimate.AS_PRINTED:
            unit = np.sqrt(np.sum(off**2, axis=1) - a)
            direction = (off - a[:, None] * tangent) / unit[:, None]
            turned = k * b / unit
            vector = -direction - (0.5 * turned * a / (1.0 - turned))[:, None] * tangent
            size = np.abs(np.einsum("ij,ij->i", vector, off))
            return np.asarray(np.copysign(size, b) if path.dimensions == 2 else size)
        if formula is Estimate.LINE:
            error = b
        elif formula is Estimate.CIRCLE:
            error = (2.0 * b - k * (a**2 + b**2)) / (1.0 + np.hypot(k * a, inside))
        else:
            error = b - k * a**2 / (2.0 * inside)
    return np.asarray(error if path.dimensions == 2 else np.hypot(error, c))


def second_order_bound(path: Path, s_mm: npt.ArrayLike, actual_mm: npt.ArrayLike) -> Floats:
    """Return how far the second-order formula may be off (n,), in mm; infinite where it is not to be used.

    That is where |k (P - R)| is 0.3 or more, at the commanded point or at the foot, and where the foot would lie
    beyond an end of the path.

    Notes
    -----
    Twice the next terms of the series, k' f^3 / 6 (in space with k t f^3 / 6, t the torsion) and k^3 f^4 / 8, where
    f = a / (1 - k b) is the distance of the foot. Of k and k' the larger counts, at the commanded point and at the
    foot: a knot may lie between them.
    """
    off, _, a, b, _, k, change = _parts(path, s_mm, actual_mm)
    size = np.linalg.norm(off, axis=1)
    usable = np.abs(k) * size < TRUSTED
    foot = a / np.where(usable, 1.0 - k * b, 1.0)
    there = np.asarray(s_mm, dtype=np.float64) + foot
    if path.closed:
        there = np.mod(there, path.length_mm)
    usable &= (there >= 0.0) & (there <= path.length_mm)
    tangent, bend, third = path.derivatives(np.where(usable, there, 0.0))
    change = np.maximum(change, _change(tangent, bend, third))
    k = np.maximum(np.abs(k), np.linalg.norm(bend, axis=1))
    bound = 2.0 * (change * np.abs(foot) ** 3 / 6.0 + k**3 * foot**4 / 8.0)
    return np.asarray(np.where(usable & (k * size < TRUSTED), bound, np.inf))


def _change(tangent: Floats, bend: Floats, third: Floats) -> Floats:
    """Return how fast the curvature vector turns and grows, |k' n + k t binormal|, in 1/mm²."""
    return np.asarray(np.linalg.norm(third + np.sum(bend**2, axis=1)[:, None] * tangent, axis=1))


def _normals(bend: Floats) -> tuple[Floats, Floats]:
    """Return unit normals (zero where there is no curvature) and curvatures of a path in space."""
    curvature = np.linalg.norm(bend, axis=1)
    return bend / np.where(curvature > 0.0, curvature, 1.0)[:, None], curvature


def _parts(
    path: Path, s_mm: npt.ArrayLike, actual_mm: npt.ArrayLike
) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats]:
    """Return P - R, the tangent, a, b, c, the curvature, and how fast its vector changes."""
    reference = path.points(s_mm)
    actual = np.asarray(actual_mm, dtype=np.float64)
    if actual.shape != reference.shape:
        raise ArgumentError("actual_mm", f"an array of shape {actual.shape}", f"one of shape {reference.shape}")
    off = actual - reference
    tangent, bend, third = path.derivatives(s_mm)
    a = np.einsum("ij,ij->i", off, tangent)
    change = _change(tangent, bend, third)
    if path.dimensions == 2:
        left = np.column_stack([-tangent[:, 1], tangent[:, 0]])
        b, k = np.einsum("ij,ij->i", off, left), np.einsum("ij,ij->i", bend, left)
        return off, tangent, a, b, np.zeros_like(b), k, change
    normal, k = _normals(bend)
    b = np.einsum("ij,ij->i", off, normal)
    rest = np.linalg.norm(off - a[:, None] * tangent - b[:, None] * normal, axis=1)
    return off, tangent, a, b, rest, k, change
