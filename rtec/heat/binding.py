"""A course of heat as the compiled loops take it."""

from __future__ import annotations

from typing import Any

import numpy as np

from rtec.heat.course import Floats, HeatCourse


def bound_heat(course: HeatCourse) -> tuple[Any, ...]:
    """Return a course for the kernels (`rtec.heat._heat_kernels`).

    Examples
    --------
    >>> time_s, *_, values = bound_heat(HeatCourse(thermometers={"screw": [20.0]}))
    >>> time_s.tolist(), values.tolist()
    ([0.0], [[0.0], [20.0]])
    """
    columns = (course.time_s, course.shift_mm, course.per_mm)
    time_s, shift_mm, per_mm = (np.array(column, dtype=np.float64) for column in columns)
    values: Floats = np.array([course.spindle_rpm, *course.thermometers.values()], dtype=np.float64)
    return time_s, shift_mm, per_mm, float(course.fixed_mm), values
