"""Stick-slip: near the reversals of an axis, where it is slow, readings scatter more than elsewhere."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from rtec.metrology.ballbar.circle_test import CircleTest, Floats
from rtec.metrology.ballbar.shapes import AXES, along, behind

CHANCE = 0.0027 / 2.0
"""That anything is named by noise alone, half of that of 3 sigma: the other half is for the shapes."""
_CLASSES = 2.0
_NEAR_DEG = (10.0, 20.0)
_CATCHING_UP_DEG = 4.0
"""Behind a reversal, where a spike may be left."""
_LEAST_RATIO = 1.25
"""Of the variances."""
_FEWEST = 20
_MOST_ALIKE = 0.4
"""Correlation of neighbours: what is smooth is no scatter."""
_LEVER = math.sqrt(12.0)
"""A saw tooth of height 1, read at any moment, scatters by 1 / sqrt(12)."""


def stick_slip(
    test: CircleTest, residual_um: Floats, weights: Floats, correlated: float
) -> list[tuple[str, float, float]]:
    """Return name, height of the jumps in um and its standard error for each axis that sticks and slips.

    Parameters
    ----------
    test
        The circle test.
    residual_um
        What the shapes leave, shape (points,).
    weights
        0 for points that count as outliers, shape (points,).
    correlated
        By how much the correlation of neighbours widens variances.
    """
    from scipy.stats import f as f_distribution  # noqa: PLC0415 - half a second that other verbs do not need

    good = weights > 0.0
    away = {axis: np.degrees(np.arccos(np.clip(np.abs(along(axis, test.angle_rad)[0]), 0.0, 1.0))) for axis in AXES}
    elsewhere = residual_um[good & np.all([far > max(_NEAR_DEG) for far in away.values()], axis=0)]
    found = []
    for axis in AXES:
        after = np.min([behind(axis, end, test.angle_rad, test.sense) for end in (1, -1)], axis=0)
        usable = good & (np.degrees(after) > _CATCHING_UP_DEG)
        best = (CHANCE / _CLASSES, 0.0, 0.0)
        for width in _NEAR_DEG:
            rows = usable & (away[axis] < width)
            near = residual_um[rows]
            if _neighbours(residual_um, rows) > _MOST_ALIKE or near.size < _FEWEST or elsewhere.size < _FEWEST:
                continue
            inside, outside = float(np.mean(near**2)), float(np.mean(elsewhere**2))
            ratio = inside / max(outside, 1e-300)
            chance = float(f_distribution.sf(ratio, near.size / correlated, elsewhere.size / correlated))
            if chance * len(_NEAR_DEG) < best[0] and ratio > _LEAST_RATIO:
                jump = _LEVER * math.sqrt(inside - outside)
                spread = _LEVER**2 * inside * math.sqrt(2.0 * correlated / near.size) / (2.0 * jump)
                best = chance * len(_NEAR_DEG), jump, spread
        if best[1] > 0.0:
            found.append((f"stick-slip {axis}", best[1], best[2]))
    return found


def _neighbours(residual_um: Floats, rows: npt.NDArray[np.bool_]) -> float:
    """Return the correlation of a residual at rows with the row that follows."""
    pairs = np.flatnonzero(rows[:-1] & rows[1:])
    one, other = residual_um[pairs], residual_um[pairs + 1]
    return float(np.sum(one * other) / max(float(np.sum(one**2)), 1e-300))
