"""A course of heat in closed form: an approach in first order."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rtec.checks import number_within
from rtec.errors import ArgumentError
from rtec.heat.course import HeatCourse

_TIMES = 4096


def approach(
    *,
    time_constant_s: float,
    shift_mm: float = 0.0,
    rise_k: Mapping[str, float] | None = None,
    start_degc: float = 20.0,
) -> HeatCourse:
    """Return a course in which shift and thermometers approach their ends like ``1 - exp(-t / tau)``.

    Parameters
    ----------
    time_constant_s
        After which 63 % of the way is behind.
    shift_mm
        By how much the axis is displaced in the end, everywhere.
    rise_k
        By how much each thermometer rises in the end, by its name.
    start_degc
        What all of them say at first.

    Raises
    ------
    ArgumentError
        A value outside its range.

    Notes
    -----
    4096 times lie so that straight lines between them are off by the same share everywhere: at most 1e-7 of the end.

    Examples
    --------
    >>> course = approach(time_constant_s=60.0, shift_mm=0.010, rise_k={"screw": 8.0})
    >>> round(course.growth_mm(60.0, 0.0), 6), round(course.at("screw", 60.0), 4)
    (0.006321, 25.057)
    """
    tau_s = number_within("time_constant_s", time_constant_s, 1e-3, 1e6, unit="s")
    number_within("shift_mm", shift_mm, -10.0, 10.0, unit="mm")
    number_within("start_degc", start_degc, -273.15, 1000.0, unit="degC")
    rises = dict(rise_k or {})
    for name, rise in rises.items():
        if not abs(rise) <= 1000.0:
            raise ArgumentError(f"rise_k of {name}", rise, "-1000 to 1000 K")
    left = 1.0 - np.arange(_TIMES) / _TIMES
    share = 1.0 - left**2
    return HeatCourse(
        time_s=-2.0 * tau_s * np.log(left),
        thermometers={name: start_degc + rise * share for name, rise in rises.items()},
        shift_mm=shift_mm * share,
    )
