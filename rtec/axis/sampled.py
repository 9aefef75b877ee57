"""What an axis is told, over time, as pieces of constant jerk: moves planned, and positions sampled, on one clock."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import numpy.typing as npt

from rtec.axis.profile import MotionSegments
from rtec.errors import ArgumentError
from rtec.units import PS_PER_S

FloatArray = npt.NDArray[np.float64]


def cubics(values: FloatArray, period_s: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return slope, second and third derivative at the start of each cubic through values, shape (samples - 1,).

    Two cubics have the central difference as the slope of the place where they meet.
    """
    slopes = np.gradient(values, period_s)
    rise = np.diff(values) / period_s
    second = (6.0 * rise - 4.0 * slopes[:-1] - 2.0 * slopes[1:]) / period_s
    third = 6.0 * (slopes[:-1] + slopes[1:] - 2.0 * rise) / period_s**2
    return slopes[:-1], second, third


def sampled_command(position_mm: npt.ArrayLike, period_s: float) -> MotionSegments:
    """Return the motion through positions that an interpolator hands out, by cubics.

    Parameters
    ----------
    position_mm
        Shape (samples,), two or more; the axis rests after the last.
    period_s
        Between two of them, a whole number of picoseconds.

    Raises
    ------
    ArgumentError
        Fewer positions, or no such period.

    Examples
    --------
    >>> motion = sampled_command([0.0, 0.1, 0.3, 0.5], 1e-3)
    >>> motion.position_at([1_000_000_000, 3_000_000_000]).round(9).tolist()
    [0.1, 0.5]
    """
    values = np.asarray(position_mm, dtype=np.float64)
    if values.ndim != 1 or values.size < 2:
        raise ArgumentError("position_mm", f"shape {values.shape}", "two positions or more")
    period_ps = round(period_s * PS_PER_S)
    if period_ps < 1 or abs(period_s * PS_PER_S - period_ps) > 1e-3:
        raise ArgumentError("period_s", f"{period_s:g} s", "a whole number of picoseconds")
    slope, second, third = cubics(values, period_s)
    pieces = values.size - 1
    return MotionSegments(
        start_ps=np.arange(pieces, dtype=np.int64) * period_ps,
        duration_ps=np.full(pieces, period_ps, dtype=np.int64),
        x0_mm=values[:-1].copy(),
        v0_mm_s=slope,
        a0_mm_s2=second,
        j0_mm_s3=third,
        block=np.zeros(pieces, dtype=np.int64),
        block_end_ps=np.array([pieces * period_ps], dtype=np.int64),
        end_mm=float(values[-1]),
    )


def one_after_another(first: MotionSegments, then: MotionSegments) -> MotionSegments:
    """Return a motion that goes on with another where it ends.

    Raises
    ------
    ArgumentError
        The other begins elsewhere.
    """
    if then.x0_mm.size and abs(first.end_mm - then.x0_mm[0]) > 1e-9:
        raise ArgumentError("then", f"begins at {then.x0_mm[0]:.9g} mm", f"a motion from {first.end_mm:.9g} mm on")
    begin_ps, blocks = first.total_ps, first.block_end_ps.size
    moved = {"start_ps": begin_ps, "block": blocks, "block_end_ps": begin_ps}
    arrays = {
        item.name: np.concatenate([getattr(first, item.name), getattr(then, item.name) + moved.get(item.name, 0)])
        for item in fields(MotionSegments)
        if item.name != "end_mm"
    }
    return MotionSegments(**arrays, end_mm=then.end_mm)
