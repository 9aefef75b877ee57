"""What the other axes of a machine do to one, from a grid of readings: squareness, straightness, angles."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from scipy.linalg import block_diag, null_space
from threadpoolctl import threadpool_limits

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.axis_tables import AxisTable, AxisTables
from rtec.predictors.binding import axis_name
from rtec.predictors.fitting.samples import Samples
from rtec.predictors.tables import SAME_TARGET_MM

MOST_OWN, MOST_OTHERS = 200, 30
"""Points of a table of the measured axis, and of one of another axis or of angles."""
_SMOOTH = 1e-3
"""Weight of the second differences beside that of the readings, as in tables of one axis."""
_TOLD_APART = 1e-6
"""Share of a slope that no other column may explain: below, two axes always moved together."""


class Geometry(Enum):
    """What of a machine's geometry is looked for; each holds those before it, and the axis' own error."""

    SQUARENESS = "squareness"
    """Axes that do not stand at right angles: an error in proportion to where another axis stands."""
    STRAIGHTNESS = "straightness"
    """Ways that are not straight: any curve of where another axis stands."""
    ANGLES = "angles"
    """Slides that roll, pitch and yaw: an angle of one axis acts by how far out another one stands."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Across:
    """What one other axis does to the measured one.

    References
    ----------
    ISO 230-1: squareness between the reference straight lines of two axes, straightness about such a line.
    """

    axis: int
    """Its number."""
    squareness: float
    """Slope of the straight line through its table by least squares, in mm a mm."""
    sd: float
    """Standard error of the slope."""
    straightness_mm: float
    """Highest less lowest departure from that line."""

    def __str__(self) -> str:
        slope, sd = 1e6 * self.squareness, 1e6 * self.sd
        text = f"axis {self.axis}: squareness {slope:.2f} ± {sd:.2f} µm/m"
        return text + (f", straightness {1e3 * self.straightness_mm:.2f} µm" if self.straightness_mm else "")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AcrossAxes:
    """Tables fitted to readings, what they say of each other axis, and how many numbers were fitted."""

    predictor: AxisTables
    across: tuple[Across, ...]
    parameters: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Part:
    """A table to be fitted."""

    table: AxisTable
    """Its points."""
    weights: Floats
    """By how much each of them counts in each reading, shape (rows, points)."""
    basis: Floats
    """Its values are this times what is fitted, shape (points, numbers)."""
    axis: int | None = None
    """The other axis whose squareness and straightness it tells; None for all else."""

    @property
    def columns(self) -> Floats:
        """Shape (rows, numbers)."""
        return self.weights @ self.basis

    @property
    def bends(self) -> Floats:
        """Rows that keep it smooth where no reading holds it, shape (points - 2, numbers)."""
        size = math.sqrt(_SMOOTH) * float(np.abs(self.weights).max())
        return size * np.diff(self.basis, 2, axis=0)


def fit_across(samples: Samples, geometry: Geometry) -> AcrossAxes:
    """Fit the axis' own error in both directions and what other axes add to it, by least squares in one go.

    Parameters
    ----------
    samples
        Readings at a grid of places: every other axis at several places, not always at the same ones for a place of
        the measured axis.
    geometry
        What is looked for.

    Raises
    ------
    ArgumentError
        No other axis, one that stood still or always moved together with others, or fewer places than numbers.

    Notes
    -----
    A table has a point at each place that was measured, up to 200 of the axis itself and 30 of others; more places
    share equidistant points. Tables of other axes and of angles have the sum zero. What two angles share (a product
    of the places of two axes) is split such that the values are smallest.

    References
    ----------
    Thesis 6.3; ISO 230-1.

    Examples
    --------
    Two axes that are 30 µm in a metre out of square:

    >>> x, y = (each.ravel() for each in np.meshgrid(np.arange(0.0, 101.0, 20.0), np.arange(0.0, 301.0, 50.0)))
    >>> grid = Samples(position_mm=x, direction=np.ones(x.size), error_mm=1e-5 * x + 30e-6 * y, others_mm={2: y})
    >>> found = fit_across(grid, Geometry.SQUARENESS)
    >>> round(1e6 * found.across[0].squareness, 6), found.predictor.inputs
    (30.0, ('position', 'direction', 'position_2'))
    """
    if not samples.others_mm:
        raise ArgumentError("readings", "one axis alone", "columns position_2_mm, ... that tell where others stood")
    means = samples.averaged()
    parts = list(_parts(means, geometry))
    _check_apart(means, parts)
    design = np.hstack([part.columns for part in parts])
    rows, numbers = design.shape
    if rows < numbers:
        raise ArgumentError("readings", f"{rows} places", f"{numbers} or more, one for each number")
    bends = block_diag(*(part.bends for part in parts))
    with threadpool_limits(1):  # so small a matrix is not worth the waiting of threads for each other
        u, s, vt = np.linalg.svd(np.concatenate([design, bends]), full_matrices=False)
    kept = s > 1e-9 * s[0]
    inverse = vt[kept].T / s[kept]
    values = inverse @ (u[:rows, kept].T @ means.error_mm)
    left = means.error_mm - design @ values
    variance = float(left @ left) / max(rows - int(np.count_nonzero(kept)), 1)
    tables, across, begin = [], [], 0
    for part in parts:
        mine = slice(begin, begin + part.basis.shape[1])
        begin = mine.stop
        tables.append(replace(part.table, values=part.basis @ values[mine]))
        if part.axis is not None:
            spread = math.sqrt(variance) * part.basis @ inverse[mine]
            across.append(_across(part.axis, tables[-1], spread))
    predictor = AxisTables(tables=tuple(tables), range_mm=means.span_mm)
    return AcrossAxes(predictor=predictor, across=tuple(across), parameters=numbers)


def _parts(means: Samples, geometry: Geometry) -> Iterator[_Part]:
    ways = np.unique(means.direction)
    places = {"position": means.position_mm} | {axis_name(axis): x for axis, x in means.others_mm.items()}
    for way in ways:
        points = _points(means.position_mm, MOST_OWN)
        weights = _hats(points, means.position_mm) * (means.direction == way)[:, np.newaxis]
        one_way = int(way) if ways.size > 1 else 0
        table = AxisTable(of="position", positions_mm=points, values=np.zeros(points.size), direction=one_way)
        yield _Part(table=table, weights=weights, basis=np.eye(points.size))
    for axis, x in means.others_mm.items():
        points = _points(x, MOST_OTHERS)
        if geometry is Geometry.SQUARENESS:
            points = points[[0, -1]]
        table = AxisTable(of=axis_name(axis), positions_mm=points, values=np.zeros(points.size))
        yield _Part(table=table, weights=_hats(points, x), basis=_about_zero(points), axis=axis)
    if geometry is not Geometry.ANGLES:
        return
    for arm, out in places.items():
        for of, x in places.items():
            if arm not in ("position", of):  # an angle does not act along the measured axis itself
                points, reach = _points(x, MOST_OTHERS), (float(out.min()), float(out.max()))
                weights = _hats(points, x) * (out - 0.5 * sum(reach))[:, np.newaxis]
                none = np.zeros(points.size)
                table = AxisTable(of=of, positions_mm=points, values=none, arm=arm, arm_mm=reach)
                yield _Part(table=table, weights=weights, basis=_about_zero(points))


def _about_zero(points: Floats) -> Floats:
    """Return a basis of the values whose sum is zero, shape (points, points - 1).

    A constant belongs to the axis' own table, a constant angle to the squareness of its arm.
    """
    basis: Floats = null_space(np.ones((1, points.size)))
    return basis


def _points(x: Floats, most: int) -> Floats:
    """Return the points of a table: the places that were measured, or equidistant ones where these are too many."""
    found = np.sort(x)
    found = found[np.diff(found, prepend=-np.inf) > SAME_TARGET_MM]
    if found.size < 2:
        raise ArgumentError("readings", f"an axis at {x[0]:g} mm alone", "readings at several places of each axis")
    return found if found.size <= most else np.linspace(found[0], found[-1], most)


def _hats(points: Floats, x: Floats) -> Floats:
    """Return by how much each point weighs in the line between two of them, shape (rows, points)."""
    piece = np.clip(np.searchsorted(points, x, side="right") - 1, 0, points.size - 2)
    right = np.clip((x - points[piece]) / (points[piece + 1] - points[piece]), 0.0, 1.0)
    columns = np.zeros((x.size, points.size))
    row = np.arange(x.size)
    columns[row, piece] = 1.0 - right
    columns[row, piece + 1] += right
    return columns


def _check_apart(means: Samples, parts: list[_Part]) -> None:
    """Refuse axes that moved together: no readings tell what each of them did."""
    own = np.hstack([part.columns for part in parts if part.table.of == "position" and part.table.arm is None])
    slopes = {axis: x - x.mean() for axis, x in means.others_mm.items()}
    for axis, slope in slopes.items():
        others = np.column_stack([own, *(other for number, other in slopes.items() if number != axis)])
        left = slope - others @ np.linalg.lstsq(others, slope, rcond=1e-10)[0]
        if not float(left @ left) > _TOLD_APART * float(slope @ slope):
            found = "the same place for each place of the others"
            raise ArgumentError(axis_name(axis), found, "a grid, in which each axis moves on its own")


def _across(axis: int, table: AxisTable, spread: Floats) -> Across:
    """Return what a table says of another axis; ``spread`` times itself is the covariance of its values."""
    points = table.positions_mm - table.positions_mm.mean()
    weights = points / float(points @ points)
    slope = float(weights @ table.values)
    bent = table.values - table.values.mean() - slope * points
    straightness_mm = float(np.ptp(bent)) if points.size > 2 else 0.0
    return Across(
        axis=axis,
        squareness=slope,
        sd=float(np.linalg.norm(weights @ spread)),
        straightness_mm=straightness_mm,
    )
