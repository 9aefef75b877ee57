"""Toolpaths to try drives on: the butterfly, the ballbar's circle, seeded random curves."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from rtec.checks import number_within, whole_within
from rtec.errors import ArgumentError
from rtec.toolpath.nurbs import LARGEST_MM, Nurbs
from rtec.toolpath.path import Path

Floats = npt.NDArray[np.float64]

TRAVEL_MM = 1200.0
"""Travel of both axes in Erwinski et al. 2019, section 5: random control points lie in this square."""
SHARPEST_TURN = math.radians(135.0)
"""Largest turn of the control polygon: beyond it the curve almost reverses."""
SHORTEST_LEG = 0.15
"""Smallest distance of neighbouring control points, as a part of the box."""


def butterfly(width_mm: float = TRAVEL_MM, *, tolerance_mm: float = 1e-3) -> Path:
    """Return one round of Fay's butterfly, r = exp(sin a) - 2 cos 4a, as a periodic cubic.

    Parameters
    ----------
    width_mm
        Across its wings, 1 to 100 000 mm.
    tolerance_mm
        Largest distance of the cubic from the curve; the number of knots is doubled until it is kept.

    Raises
    ------
    ArgumentError
        A value outside its range.

    Notes
    -----
    Fay's term sin(a/12)^5 closes his curve after twelve rounds only. It moves the first round by 0.1 % of its size,
    and is left out so that one round is closed. The curve passes its origin six times.

    References
    ----------
    T. H. Fay, The butterfly curve, American Mathematical Monthly 96 (1989) 442.

    Examples
    --------
    >>> path = butterfly()
    >>> path.closed, round(path.length_mm / 1000, 1)
    (True, 7.4)
    """
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415 - half a second that other verbs do not need

    width = number_within("width_mm", width_mm, 1.0, LARGEST_MM)
    tolerance = number_within("tolerance_mm", tolerance_mm, 1e-9 * width, 1e-2 * width)
    scale = width / np.ptp(_fay(np.linspace(0.0, 2.0 * math.pi, 100_001))[:, 0])
    knots = 128
    while True:
        angles = np.linspace(0.0, 2.0 * math.pi, knots + 1)
        points = scale * _fay(angles)
        points[-1] = points[0]
        spline = make_interp_spline(angles, points, k=3, bc_type="periodic")
        between = np.linspace(0.0, 2.0 * math.pi, 8 * knots + 1)
        if np.linalg.norm(spline(between) - scale * _fay(between), axis=1).max() <= tolerance:
            return Path(name="butterfly", curve=Nurbs(degree=3, knots=spline.t, control_points_mm=spline.c))
        knots *= 2


def _fay(angles: Floats) -> Floats:
    radius = np.exp(np.sin(angles)) - 2.0 * np.cos(4.0 * angles)
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles)])


def circle(radius_mm: float = 150.0, *, clockwise: bool = False) -> Path:
    """Return a ballbar's circle about the origin, exact, from its point on +x.

    Raises
    ------
    ArgumentError
        A radius outside 1 um to 100 m.
    """
    radius = number_within("radius_mm", radius_mm, 1e-3, LARGEST_MM)
    corners = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]], dtype=float)
    weights = [1.0, *[math.sqrt(0.5), 1.0] * 4]
    knots = np.repeat(np.arange(5.0), [3, 2, 2, 2, 3])
    points = radius * corners * [1.0, -1.0 if clockwise else 1.0]
    return Path(name="circle", curve=Nurbs(degree=2, knots=knots, control_points_mm=points, weights=weights))


def random_path(seed: int, *, points: int = 40, box_mm: tuple[float, ...] = (TRAVEL_MM, TRAVEL_MM)) -> Path:
    """Return a cubic B-spline through a box, with random control points, clamped to the first and the last.

    Parameters
    ----------
    seed
        The same seed gives the same path.
    points
        Control points, 4 to 10 000.
    box_mm
        Sides of the box, from 0; two or three.

    Raises
    ------
    ArgumentError
        A value outside its range.

    References
    ----------
    Erwinski, Paprocki and Karasek 2019, section 5, figure 9.
    """
    count = whole_within("points", points, 4, 10_000)
    if len(box_mm) not in (2, 3):
        raise ArgumentError("box_mm", f"{len(box_mm)} sides", "2 or 3")
    box = np.array([number_within("box_mm", side, 1.0, LARGEST_MM) for side in box_mm])
    stream = np.random.default_rng(whole_within("seed", seed, 0, 2**63 - 1))
    chosen = [stream.uniform(0.0, 1.0, box.size)]
    leg = np.zeros(box.size)
    while len(chosen) < count:
        point = stream.uniform(0.0, 1.0, box.size)
        step = point - chosen[-1]
        length = float(np.linalg.norm(step))
        before = float(np.linalg.norm(leg))
        if length >= SHORTEST_LEG and step @ leg >= math.cos(SHARPEST_TURN) * length * before:
            chosen.append(point)
            leg = step
    knots = np.concatenate([[0.0] * 3, np.arange(count - 2.0), [count - 3.0] * 3])
    return Path(name=f"random {seed}", curve=Nurbs(degree=3, knots=knots, control_points_mm=np.array(chosen) * box))
