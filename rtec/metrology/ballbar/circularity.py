"""Figures of ISO 230-4: circular deviations, mean radial deviation, radial deviations.

G
    Circular deviation: smallest distance of two concentric circles around the actual path of one sense.
G(b)
    Bi-directional circular deviation: the same around the paths of both senses.
D
    Mean bi-directional radial deviation: radius of the least-squares circle of both senses, less the nominal one.
F
    Radial deviation: distance of the actual path from the nominal one about the least-squares centre; largest and
    least.

References
----------
ISO 230-4:2005, 3.4 to 3.8.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtec.metrology.ballbar.circle_test import CircleTest, Floats

_BINS = 720
_NEAR_DEG = (3.0, 7.0)
_DIAGONAL_DEG = 2.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Circularity:
    """Figures of a circle test, in um."""

    counter_clockwise: float
    """G of the two senses..."""
    clockwise: float
    both: float
    """G(b)."""
    mean_radial: float
    """D."""
    largest_radial: float
    """F, largest..."""
    least_radial: float
    """...and least."""
    centre: tuple[float, float]
    """Offset of the least-squares centre in x and y, which is taken out."""
    diameters: tuple[float, float]
    """Of x and y less the nominal one, from 3 to 7 deg beside their reversals: play and spikes stay out."""
    diagonals: float
    """(D45 + D225 - D135 - D315) / (2 R) in um/m: the squareness by four places."""

    @property
    def largest_g(self) -> float:
        """G of the sense that has the larger one."""
        return max(self.counter_clockwise, self.clockwise)


def circularity(test: CircleTest) -> Circularity:
    """Return the figures of a test.

    Examples
    --------
    >>> from rtec.metrology.ballbar import circle_test
    >>> way = np.arange(0.0, 360.0, 0.5)
    >>> oval = 3.0 * np.cos(np.radians(2.0 * way)) + 5.0 * np.sin(np.radians(way))
    >>> test = circle_test([*way, *way[::-1]], [*oval, *oval[::-1]], [1] * 720 + [-1] * 720, radius_mm=100.0)
    >>> found = circularity(test)
    >>> [round(x, 3) + 0.0 for x in (found.both, found.mean_radial, found.largest_radial, *found.centre)]
    [6.0, 0.0, 3.0, 0.0, 5.0]
    """
    angle, deviation = test.angle_rad, test.deviation_um
    one, other = test.sense > 0.0, test.sense < 0.0
    basis = np.column_stack([np.cos(angle), np.sin(angle), np.ones(angle.size)])
    x, y, mean = np.linalg.lstsq(basis, deviation, rcond=None)[0].tolist()
    about = deviation - basis[:, :2] @ [x, y]
    diameters = tuple(
        _mean_near(angle, about, place) + _mean_near(angle, about, place + np.pi) for place in (0.0, np.pi / 2)
    )
    corners = [_mean_at(angle, about, np.radians(place)) for place in (45.0, 225.0, 135.0, 315.0)]
    return Circularity(
        counter_clockwise=circular_deviation(angle[one], deviation[one]),
        clockwise=circular_deviation(angle[other], deviation[other]),
        both=circular_deviation(angle, deviation),
        mean_radial=mean,
        largest_radial=float(about.max()),
        least_radial=float(about.min()),
        centre=(x, y),
        diameters=(diameters[0], diameters[1]),
        diagonals=(corners[0] + corners[1] - corners[2] - corners[3]) / (2e-3 * test.radius_mm),
    )


def circular_deviation(angle_rad: Floats, deviation_um: Floats) -> float:
    """Return the smallest distance of two concentric circles around a path, in um.

    Notes
    -----
    Deviations are small against the radius, so that an offset (a, b) of the centre is a cos + b sin: a linear
    program. Only the largest and the least of each half degree take part.

    Examples
    --------
    >>> way = np.linspace(0.0, 2.0 * np.pi, 400)
    >>> round(circular_deviation(way, 2.0 * np.sin(3.0 * way) + 30.0 * np.cos(way)), 2)
    4.0
    """
    from scipy.optimize import linprog  # noqa: PLC0415 - half a second that other verbs do not need

    rows = _extremes(angle_rad, deviation_um)
    angle, deviation = angle_rad[rows], deviation_um[rows]
    ones, none = np.ones(angle.size), np.zeros(angle.size)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    above = np.column_stack([-circle, -ones, none])
    below = np.column_stack([circle, none, ones])
    limits = np.concatenate([-deviation, deviation])
    found = linprog([0.0, 0.0, 1.0, -1.0], A_ub=np.vstack([above, below]), b_ub=limits, bounds=(None, None))
    return float(found.fun)


def _extremes(angle_rad: Floats, deviation_um: Floats) -> np.ndarray:
    """Return the rows of the largest and the least deviation in each half degree."""
    cell = np.floor(angle_rad / (2.0 * np.pi) * _BINS).astype(np.int64) % _BINS
    order = np.lexsort((deviation_um, cell))
    first = np.flatnonzero(np.diff(cell[order], prepend=-1))
    last = np.append(first[1:], cell.size) - 1
    return np.unique(order[np.concatenate([first, last])])


def _mean_near(angle_rad: Floats, about_um: Floats, place_rad: float) -> float:
    """Return the mean beside a reversal, on both sides of it."""
    away = np.degrees(np.abs(_from(angle_rad, place_rad)))
    near = (away >= _NEAR_DEG[0]) & (away <= _NEAR_DEG[1])
    return float(about_um[near].mean()) if near.any() else float("nan")


def _mean_at(angle_rad: Floats, about_um: Floats, place_rad: float) -> float:
    near = np.degrees(np.abs(_from(angle_rad, place_rad))) <= _DIAGONAL_DEG
    return float(about_um[near].mean()) if near.any() else float("nan")


def _from(angle_rad: Floats, place_rad: float) -> Floats:
    return (angle_rad - place_rad + np.pi) % (2.0 * np.pi) - np.pi
