"""Compiled course of heat: how far an axis has grown, and what the PC's sensors of heat say.

A course is ``(time_s, shift_mm, per_mm, fixed_mm, values)``: ascending times, shape (times,); two columns of the same
shape; the position that is held, in mm; what each sensor says, shape (sensors, times), the spindle speed first.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec._jit import helper, step
from rtec.signal._kernels import NEVER
from rtec.units._time_kernels import PS_PER_S


@helper
def piece_of(time_s: NDArray[np.float64], t_s: float) -> int:
    """Return the last time that is not after ``t_s``, of those before the last; 0 before all."""
    below = 0
    above = time_s.size - 1
    while above - below > 1:
        middle = (below + above) // 2
        if time_s[middle] <= t_s:
            below = middle
        else:
            above = middle
    return below


@helper
def share_of(time_s: NDArray[np.float64], k: int, t_s: float) -> float:
    """Return which share of a piece has passed, held within it."""
    return float(min(max((t_s - time_s[k]) / (time_s[k + 1] - time_s[k]), 0.0), 1.0))


@helper
def growing_mm(course: Any, t_ps: int, x_mm: float) -> float:
    """Return the growth of a course of several times."""
    time_s, shift_mm, per_mm, fixed_mm, _ = course
    t_s = t_ps / PS_PER_S
    k = piece_of(time_s, t_s)
    share = share_of(time_s, k, t_s)
    shift = shift_mm[k] + share * (shift_mm[k + 1] - shift_mm[k])
    per = per_mm[k] + share * (per_mm[k + 1] - per_mm[k])
    return float(shift + per * (x_mm - fixed_mm))


@step
def grown_mm(course: Any, t_ps: int, x_mm: float) -> float:
    """Return by how much the axis is displaced by heat at ``t_ps`` where it stands at ``x_mm``."""
    time_s, shift_mm, per_mm, fixed_mm, _ = course
    if time_s.size == 1:
        return float(shift_mm[0] + per_mm[0] * (x_mm - fixed_mm))
    return growing_mm(course, t_ps, x_mm)


@helper
def bends_ps(course: Any, t_ps: int) -> int:
    """Return until when the course goes on in a straight line as it does at ``t_ps``."""
    time_s = course[0]
    t_s = t_ps / PS_PER_S
    if time_s.size == 1 or t_s >= time_s[time_s.size - 1]:
        return NEVER
    return int((time_s[0] if t_s < time_s[0] else time_s[piece_of(time_s, t_s) + 1]) * PS_PER_S)


@helper
def read_heat(course: Any, t_ps: int, said: NDArray[np.float64]) -> None:
    """Let the PC read every sensor of heat at ``t_ps``: temperatures, and the speed that the spindle has since."""
    time_s, _, _, _, values = course
    if time_s.size == 1:
        for i in range(values.shape[0]):
            said[i] = values[i, 0]
        return
    t_s = t_ps / PS_PER_S
    k = piece_of(time_s, t_s)
    share = share_of(time_s, k, t_s)
    said[0] = values[0, k] if share < 1.0 else values[0, k + 1]
    for i in range(1, values.shape[0]):
        said[i] = values[i, k] + share * (values[i, k + 1] - values[i, k])
