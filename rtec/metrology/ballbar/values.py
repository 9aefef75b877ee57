"""What the numbers of a shape mean to a maker of machines: a value with a unit, and details."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtec.metrology.ballbar.circle_test import CircleTest, Floats
from rtec.metrology.ballbar.shapes import Shape

_SPIKE_SHARE = 0.2
"""Of its height, above which a point belongs to a spike."""
_NO_NOISE = 5.0


@dataclass(frozen=True, slots=True)
class Value:
    """A value with its unit, and more numbers by name and unit."""

    value: float
    unit: str
    details: dict[str, float]


def value_of(shape: Shape, numbers: Floats, test: CircleTest, residual_um: Floats | None = None) -> Value:
    """Return what the numbers of a shape in um mean.

    Parameters
    ----------
    shape
        With the name of its error.
    numbers
        Of its columns, in um.
    test
        For the radius, and the feed, by which a servo mismatch becomes a time and waves become a frequency.
    residual_um
        What the fit leaves, shape (points,): a spike that is higher than its shape has its own height.

    Examples
    --------
    >>> from rtec.metrology.ballbar import circle_test
    >>> way = np.arange(0.0, 360.0, 1.0)
    >>> test = circle_test([*way, *way], np.arange(720.0), [1] * 360 + [-1] * 360, radius_mm=100.0, feed_mm_s=50.0)
    >>> value_of(Shape(name="servo mismatch", columns=np.ones((720, 1))), np.array([5.0]), test)
    Value(value=0.2, unit='ms', details={'radial_um': 5.0})
    """
    first = float(numbers[0])
    what = shape.name.removesuffix(" x").removesuffix(" y")
    match what:
        case "squareness":
            found = Value(2e3 * first / test.radius_mm, "um/m", {"radial_um": first})
        case "servo mismatch" if test.feed_mm_s is not None:
            found = Value(2.0 * first / test.feed_mm_s, "ms", {"radial_um": first})
        case "scaling mismatch":
            found = Value(4.0 * first, "um", {"scale_difference_ppm": 2e3 * first / test.radius_mm})
        case "backlash":
            ends = float(numbers[1])
            found = Value(first, "um", {"at_positive_end_um": first + ends, "at_negative_end_um": first - ends})
        case "reversal spike":
            plus, minus = (_height(shape.columns[:, k] * numbers[k], residual_um) for k in (0, 1))
            width = float(np.degrees(shape.parameter))
            details = {"at_positive_end_um": plus, "at_negative_end_um": minus, "width_deg": width}
            found = Value(max(plus, minus, key=abs), "um", details)
        case "cyclic error":
            period_mm = float(2.0 * np.pi * test.radius_mm / shape.parameter)
            still, moving = float(np.hypot(*numbers[:2])), float(np.hypot(*numbers[2:]))
            found = Value(max(still, moving), "um", {"period_mm": period_mm, "proportional_to_velocity_um": moving})
        case "vibration":
            found = _vibration(shape, numbers, test)
        case "master-slave change-over":
            found = Value(2.0 * first, "um", {})
        case _:
            found = Value(first, "um", {})
    return found


def _vibration(shape: Shape, numbers: Floats, test: CircleTest) -> Value:
    """Return the amplitude, the mean of both senses, and the frequency where the feed is known."""
    details = {"waves_a_revolution": float(shape.parameter)}
    if test.feed_mm_s is not None:
        details["frequency_hz"] = shape.parameter * test.feed_mm_s / (2.0 * np.pi * test.radius_mm)
    return Value(float(np.sqrt(np.sum(numbers**2) / 2.0)), "um", details)


def _height(values: Floats, residual_um: Floats | None) -> float:
    """Return the value of a spike that is farthest from zero, with what the fit leaves there if that is no noise."""
    top = int(np.abs(values).argmax())
    if residual_um is None:
        return float(values[top])
    near = np.abs(values) > _SPIKE_SHARE * abs(values[top])
    seen = values + residual_um
    peak = float(seen[near][np.abs(seen[near]).argmax()])
    scatter = 1.4826 * float(np.median(np.abs(residual_um)))
    return peak if abs(peak) > abs(values[top]) + _NO_NOISE * scatter else float(values[top])
