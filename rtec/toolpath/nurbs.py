"""Rational B-splines (NURBS) of any degree in the plane and in space, and their JSON files."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import numpy.typing as npt

from rtec.checks import whole_within
from rtec.errors import ArgumentError, FileFormatError, unknown
from rtec.io import brief, parse_json, read_text
from rtec.toolpath import _nurbs_kernels as kernels

Floats = npt.NDArray[np.float64]

MOST_DEGREE = 15
"""Up to here polynomials of a span keep 12 digits."""
MOST_POINTS = 1_000_000
MOST_BYTES = 1 << 24
"""Largest JSON file, 16 MiB: some 300 000 control points."""
LARGEST_MM = 1e5
"""Largest coordinate: up to here a float64 resolves better than 1e-10 mm."""
WEIGHTS = (1e-6, 1e6)
MOST_UNEVEN = 1e4
"""Largest ratio of two weights: beyond it, the speed by the parameter varies by more than 1e8 within a span."""
SHORTEST_SPAN = 1e-9
"""Smallest distance of different knots, as a part of their range."""
_KEYS = ("degree", "knots", "weights", "control_points")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Nurbs:
    """A rational B-spline over its own parameter u; clamped to its end points or not.

    Parameters
    ----------
    degree
        1 to 15.
    knots
        (points + degree + 1,) Not descending; inside, each at most ``degree`` times, at the ends once more. The curve
        runs from ``knots[degree]`` to ``knots[points]``.
    control_points_mm
        (points, 2) or (points, 3).
    weights
        (points,) 1e-6 to 1e6, the largest at most 10 000 times the smallest; None: all 1.

    Raises
    ------
    ArgumentError
        A value outside its range, counts that do not fit together, a knot repeated too often.

    References
    ----------
    L. Piegl, W. Tiller, The NURBS Book, 2nd edition, Springer 1997, chapters 3 and 4.

    Examples
    --------
    A quarter of a circle of radius 10 mm:

    >>> arc = Nurbs(degree=2, knots=[0, 0, 0, 1, 1, 1], control_points_mm=[[10, 0], [10, 10], [0, 10]],
    ...             weights=[1, 0.5**0.5, 1])
    >>> arc.curvature([0.0, 0.3])[1].round(12).tolist()
    [0.1, 0.1]
    """

    degree: int
    knots: npt.ArrayLike
    control_points_mm: npt.ArrayLike
    weights: npt.ArrayLike | None = None
    breaks: Floats = field(init=False, repr=False)
    """(spans + 1,) Parameters at which the polynomials meet: the knots, each once."""
    coefficients: Floats = field(init=False, repr=False)
    """(spans, dimensions + 1, degree + 1) As `rtec.toolpath._nurbs_kernels` has them."""
    rational: bool = field(init=False, repr=False)

    def __post_init__(self) -> None:
        degree = whole_within("degree", self.degree, 1, MOST_DEGREE)
        points = _points(self.control_points_mm, degree)
        weights = _weights(self.weights, points.shape[0])
        knots = _knots(self.knots, degree, points.shape[0])
        first, last = knots[degree], knots[-degree - 1]
        breaks = np.unique(knots[(knots >= first) & (knots <= last)])
        homogeneous = np.column_stack([points * weights[:, None], weights])
        set_field = object.__setattr__
        set_field(self, "breaks", breaks)
        set_field(self, "rational", bool(np.ptp(weights) > 0.0))
        if not self.rational:
            homogeneous = np.column_stack([points, np.ones(len(points))])
        set_field(self, "coefficients", _span_polynomials(knots, homogeneous, degree, breaks))
        for name, value in (("knots", knots), ("control_points_mm", points), ("weights", weights)):
            value.setflags(write=False)
            set_field(self, name, value)

    @property
    def dimensions(self) -> int:
        """2 or 3."""
        return int(self.coefficients.shape[1]) - 1

    def evaluate(self, u: npt.ArrayLike, derivatives: int = 0, *, side: int = 1) -> Floats:
        """Return points and derivatives by the parameter.

        Parameters
        ----------
        u
            (n,) Between the first and the last of ``breaks``; beyond, the polynomials of the ends go on.
        derivatives
            The highest order, 0 to 3.
        side
            At a knot -1 gives the limit from before, +1 the limit from behind.

        Returns
        -------
        numpy.ndarray
            (derivatives + 1, n, dimensions)
        """
        where = np.atleast_1d(np.asarray(u, dtype=np.float64))
        out = np.empty((whole_within("derivatives", derivatives, 0, 3) + 1, where.size, self.dimensions))
        kernels.evaluate(self.breaks, self.coefficients, self.rational, where, side, out)
        return out

    def curvature(self, u: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Return points (n, dimensions) and curvature (n,) in 1/mm: in the plane positive to the left."""
        where = np.atleast_1d(np.asarray(u, dtype=np.float64))
        points, curvature = np.empty((where.size, self.dimensions)), np.empty(where.size)
        kernels.evaluate_curvature(self.breaks, self.coefficients, self.rational, where, points, curvature)
        return points, curvature


def _numbers(name: str, values: npt.ArrayLike, low: float, high: float, unit: str) -> Floats:
    try:
        array = np.array(values)
    except ValueError:  # rows of different lengths
        array = np.array("")
    if array.dtype.kind not in "iuf":
        raise ArgumentError(name, brief(repr(values), 60), "numbers, in rows of equal length")
    array = array.astype(np.float64)
    bad = np.argwhere(~((array >= low) & (array <= high)))
    if bad.size:
        place = ", ".join(str(index + 1) for index in bad[0])
        raise ArgumentError(f"{name}, number {place}", f"{array[tuple(bad[0])]:g}", f"{low:g} to {high:g}{unit}")
    return array


def _points(values: npt.ArrayLike, degree: int) -> Floats:
    points = _numbers("control_points", values, -LARGEST_MM, LARGEST_MM, " mm")
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise ArgumentError("control_points", f"an array of shape {points.shape}", "rows [x, y] or rows [x, y, z]")
    if not degree < points.shape[0] <= MOST_POINTS:
        allowed = f"{degree + 1} to {MOST_POINTS} for degree {degree}"
        raise ArgumentError("control_points", f"{points.shape[0]} points", allowed)
    if not np.ptp(points, axis=0).any():
        raise ArgumentError("control_points", "all points coincide", "a path of some length", problem="are not valid")
    return points


def _weights(values: npt.ArrayLike | None, count: int) -> Floats:
    weights = np.ones(count) if values is None else _numbers("weights", values, *WEIGHTS, "")
    if weights.shape != (count,):
        raise ArgumentError("weights", f"an array of shape {weights.shape}", f"{count}, one for each control point")
    if weights.max() > MOST_UNEVEN * weights.min():
        found = f"{weights.min():g} to {weights.max():g}"
        raise ArgumentError("weights", found, f"a ratio of at most {MOST_UNEVEN:g}", problem="differ too much")
    return weights


def _knots(values: npt.ArrayLike, degree: int, count: int) -> Floats:
    knots = _numbers("knots", values, -1e12, 1e12, "")
    if knots.shape != (count + degree + 1,):
        allowed = f"{count + degree + 1} (control points + degree + 1)"
        raise ArgumentError("knots", f"an array of shape {knots.shape}", allowed)
    steps = np.diff(knots)
    if (steps < 0.0).any():
        at = int(np.argmax(steps < 0.0))
        raise ArgumentError(
            f"knots, number {at + 2}", f"{knots[at + 1]:g} after {knots[at]:g}", "no descending knots"
        )
    first, last = knots[degree], knots[count]
    each, times = np.unique(knots, return_counts=True)
    too_often = times > np.where((each > first) & (each < last), degree, degree + 1)
    if too_often.any():
        at = int(np.argmax(too_often))
        allowed = f"each knot at most {degree} times, the first and the last {degree + 1} times"
        raise ArgumentError("knots", f"{each[at]:g} stands {times[at]} times", allowed)
    inside = np.diff(each[(each >= first) & (each <= last)])
    if not inside.size or inside.min() < SHORTEST_SPAN * (last - first):
        allowed = f"knots that are equal or at least {SHORTEST_SPAN:g} of their range apart"
        raise ArgumentError("knots", f"from {first:g} to {last:g} some nearly coincide", allowed)
    return knots


def _span_polynomials(knots: Floats, homogeneous: Floats, degree: int, breaks: Floats) -> Floats:
    """Return each span's Taylor polynomial about its middle, in units of half its width, highest power first."""
    from scipy.interpolate import BSpline  # noqa: PLC0415 - half a second that other verbs do not need

    spline = BSpline(knots, homogeneous, degree)
    middles, halves = (breaks[1:] + breaks[:-1]) / 2.0, np.diff(breaks) / 2.0
    out = np.empty((middles.size, homogeneous.shape[1], degree + 1))
    scale = np.ones_like(halves)
    for power in range(degree + 1):
        out[:, :, degree - power] = spline(middles, nu=power) * scale[:, None]
        scale = scale * halves / (power + 1)
    return out


def read_nurbs(path: str | FilePath) -> Nurbs:
    """Read a file ``{"degree": 3, "knots": [...], "weights": [...], "control_points": [[x, y], ...]}``, in mm.

    Without weights all are 1.

    Raises
    ------
    FileFormatError
        No such file, too large, no JSON, other keys, or what `Nurbs` refuses.

    Examples
    --------
    >>> read_nurbs("wing.json")
    Traceback (most recent call last):
        ...
    rtec.errors.FileFormatError: wing.json: there is no such file; use the path of a NURBS as JSON
    """
    text = read_text(path, "a NURBS as JSON", most_bytes=MOST_BYTES)
    shape = '{"degree": 3, "knots": [...], "weights": [...], "control_points": [[x, y], ...]}'
    try:
        found = parse_json(text)
    except ValueError as error:
        raise FileFormatError(path, None, f"this is no JSON ({error})", shape) from None
    if not isinstance(found, dict):
        raise FileFormatError(path, None, "no object", shape)
    try:
        return _from_keys(found)
    except ArgumentError as error:
        said = error.allowed + f"; {error.hint}" * bool(error.hint)
        raise FileFormatError(path, None, str(error).partition("; use ")[0], said) from None


def _from_keys(found: dict[str, Any]) -> Nurbs:
    for key in found:
        if key not in _KEYS:
            raise unknown("key", key, _KEYS, noun="key")
    for key in ("degree", "knots", "control_points"):
        if key not in found:
            raise ArgumentError(key, "no such key", "all of degree, knots, control_points; weights if not all are 1")
    return Nurbs(
        degree=found["degree"],
        knots=found["knots"],
        weights=found.get("weights"),
        control_points_mm=found["control_points"],
    )
