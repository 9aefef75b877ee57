"""The play between the forward and the reverse curve of an axis's error: which errors a play can have."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec.errors import ArgumentError
from rtec.predictors.binding import bound_curve
from rtec.predictors.protocol import Predictor
from rtec.predictors.tables import ErrorTable

GRID_POINTS = 4001
NEAREST_MM = 1e-6
"""Points closer than this are one point: rounding would decide about their slope."""


def check_play(error: Predictor) -> None:
    """Refuse an axis error that no play between two flanks can have.

    Parameters
    ----------
    error
        True error of the axis, looked at on a grid and, for a table, at its own points.

    Raises
    ------
    ArgumentError
        A reverse curve below the forward curve, or a curve that falls by more than the axis moves.

    Examples
    --------
    >>> from rtec.predictors import LatheNetwork
    >>> check_play(LatheNetwork())
    """
    bound_curve(error, "axis_error")
    grid = _points(error)
    if grid.size < 2:
        return
    forward, reverse = error.error_mm(grid, 1), error.error_mm(grid, -1)
    gap = reverse - forward
    if gap.min() < -1e-9:
        worst = int(np.argmin(gap))
        raise ArgumentError(
            "axis_error",
            f"{gap[worst] * 1000:.3f} µm of play at {grid[worst]:.3f} mm",
            "a reverse error not below the forward error",
            "swap the directions: lost motion leaves the axis behind",
        )
    way = np.diff(grid)
    fall = -np.minimum(np.diff(forward), np.diff(reverse))
    worst = int(np.argmax(fall - way))
    if fall[worst] >= way[worst]:
        raise ArgumentError(
            "axis_error",
            f"a fall by {fall[worst]:g} mm from {grid[worst]:g} to {grid[worst + 1]:g} mm",
            "an error that falls by less than the axis moves",
            "else the axis would go back while its encoder goes on",
        )


def _points(error: Predictor) -> NDArray[np.float64]:
    low, high = error.range_mm
    if not (np.isfinite(low) and np.isfinite(high)):
        return np.empty(0)
    points = [np.linspace(low, high, GRID_POINTS)]
    if isinstance(error, ErrorTable):
        points = [positions for positions, _ in error.ways]
    grid: NDArray[np.float64] = np.unique(np.concatenate(points))
    kept: NDArray[np.float64] = grid[np.append(True, np.diff(grid) > NEAREST_MM)]
    return kept
