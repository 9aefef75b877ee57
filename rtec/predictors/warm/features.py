"""What a model of a warm machine sees: sensors as they are, behind by a time constant, or as heat of a bearing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rtec.errors import ArgumentError, nearest
from rtec.predictors._columns import Floats
from rtec.predictors.warm._feature_kernels import follow_course

SPINDLE_SPEED = "spindle_speed"
"""Input that is the speed of a spindle in rev/min; others are ``temperature_NAME`` in degrees Celsius."""
HEAT_POWER = 5.0 / 3.0
"""Of the speed: the heat of a bearing (Palmgren), fluid friction times speed."""
HEAT_RPM = 1000.0
"""At which the heat of a bearing is counted as 1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Feature:
    """One column: a sensor, perhaps as heat, perhaps behind by a time constant.

    Parameters
    ----------
    of
        The input: ``temperature_NAME`` or ``spindle_speed``.
    lag_s
        Time constant of the first-order body that follows it; 0: none.
    heat
        Whether it counts as ``(abs(n) / 1000) ** (5 / 3)``, as the heat of a bearing does.
    """

    of: str
    lag_s: float = 0.0
    heat: bool = False

    def __str__(self) -> str:
        what = f"{self.of}^(5/3)" if self.heat else self.of
        return f"{what} behind by {self.lag_s:.4g} s" if self.lag_s > 0.0 else what


def columns_of(
    features: tuple[Feature, ...], time_s: Floats, inputs: Mapping[str, Floats], starts: tuple[int, ...] = (0,)
) -> Floats:
    """Return the columns of features, shape (rows, features).

    Parameters
    ----------
    features
        Which.
    time_s
        Ascending within each stretch, shape (rows,).
    inputs
        Values by the name of the input, shape (rows,) each.
    starts
        Row at which each stretch begins: there, what lags is in balance with its sensor.

    Raises
    ------
    ArgumentError
        A feature of an input that is not there.

    Notes
    -----
    Between two rows a temperature goes on a straight line; a speed is held from the row before (`follow`).

    Examples
    --------
    >>> heat = {"temperature_t1": np.array([20.0, 21.0, 21.0])}
    >>> features = (Feature(of="temperature_t1"), Feature(of="temperature_t1", lag_s=10.0))
    >>> columns_of(features, np.array([0.0, 10.0, 20.0]), heat).round(3).tolist()
    [[20.0, 20.0], [21.0, 20.368], [21.0, 20.767]]
    """
    found = np.empty((time_s.size, len(features)))
    for k, one in enumerate(features):
        if one.of not in inputs:
            raise ArgumentError("inputs", one.of, "an input that the data have", nearest(one.of, inputs))
        values = np.abs(inputs[one.of] / HEAT_RPM) ** HEAT_POWER if one.heat else inputs[one.of]
        if one.lag_s > 0.0:
            ends = (*starts[1:], time_s.size)
            held = one.of == SPINDLE_SPEED
            parts = [
                follow(time_s[a:b], values[a:b], one.lag_s, held=held) for a, b in zip(starts, ends, strict=True)
            ]
            values = np.concatenate(parts)
        found[:, k] = values
    return found


def follow(time_s: Floats, values: Floats, lag_s: float, *, held: bool) -> Floats:
    """Return what follows a course in first order, shape (rows,), in balance with it at its first row.

    ``lag_s * dz/dt = value - z``, solved exactly for a course that goes on straight lines from row to row, or that
    holds the value of the row before.
    """
    found = np.empty(values.size)
    follow_course(np.asarray(time_s, dtype=np.float64), np.asarray(values, dtype=np.float64), lag_s, held, found)
    return found
