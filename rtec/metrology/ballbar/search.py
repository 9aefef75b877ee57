"""The shapes with a parameter that a residual shows: reversal spikes, cyclic errors, vibration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtec.metrology.ballbar.circle_test import CircleTest, Floats
from rtec.metrology.ballbar.shapes import (
    AXES,
    SPIKE_WIDTHS_DEG,
    Shape,
    along,
    cyclic_shape,
    spike_shape,
    vibration_shape,
)

_LEAST_WAVES = 8.0
"""Of a vibration around the circle: fewer are shapes of other errors."""
_LEAST_WAVE_NUMBER, _LOW_WAVE_NUMBER = 2.0 * np.pi * 1.9, 30.0
"""Of a cyclic error: periods up to R / 1.9; and up to which it overlaps with shapes of other errors."""
_POINTS_A_WAVE = 2.5
_STEP = 0.25
"""Between the numbers of waves that are tried."""
_MOST_WAVES = 300.0
_PRECISE = 1e-4
_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """An orthonormal basis of the columns of a fit, shape (points, numbers)."""

    basis: Floats

    @classmethod
    def of(cls, columns: Floats) -> Design:
        """Return that of columns, without those that depend on others."""
        q, r = np.linalg.qr(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300))
        return cls(q[:, np.abs(np.diag(r)) > 1e-9])

    def without(self, values: Floats) -> Floats:
        """Return what the columns leave of values, or of each column of values."""
        return values - self.basis @ (self.basis.T @ values)

    def gain(self, shape: Shape, residual: Floats) -> float:
        """Return by how much a shape lowers the sum of squares of a residual of this design."""
        return float(np.sum((Design.of(self.without(shape.columns)).basis.T @ residual) ** 2))


def best_shape(test: CircleTest, design: Design, residual: Floats) -> Shape:
    """Return the shape with a parameter that lowers the sum of squares most, by the chi-squared of its numbers.

    Parameters
    ----------
    test
        Of which the residual is left.
    design
        Columns that are in the fit.
    residual
        Orthogonal to them, in units of its noise, shape (points,).
    """
    found = [*_spikes(test, design, residual), *_cyclic(test, design, residual), _vibration(test, design, residual)]
    return max(found, key=lambda shape: design.gain(shape, residual) - 2.0 * shape.columns.shape[1])


def _spikes(test: CircleTest, design: Design, residual: Floats) -> list[Shape]:
    tried = [
        [spike_shape(test, axis, np.radians(width), rising) for width in SPIKE_WIDTHS_DEG for rising in (False, True)]
        for axis in AXES
    ]
    return [max(shapes, key=lambda shape: design.gain(shape, residual)) for shapes in tried]


def _cyclic(test: CircleTest, design: Design, residual: Floats) -> list[Shape]:
    most = min(test.points_a_revolution / _POINTS_A_WAVE, _MOST_WAVES)
    numbers = np.arange(_LEAST_WAVE_NUMBER, most, _STEP)
    low = numbers[numbers < _LOW_WAVE_NUMBER]
    found = []
    for axis in AXES if numbers.size else ():
        main, _ = along(axis, test.angle_rad)
        tried = [cyclic_shape(test, axis, number, float(numbers.size)) for number in low.tolist()]
        if numbers.size > low.size:
            high = numbers[low.size :]
            power = _power(main * residual, main, high)
            tried.append(cyclic_shape(test, axis, float(high[power.argmax()]), float(numbers.size)))
        found.append(refined(max(tried, key=lambda shape: design.gain(shape, residual)), design, residual))
    return found


def _vibration(test: CircleTest, design: Design, residual: Floats) -> Shape:
    most = min(test.points_a_revolution / _POINTS_A_WAVE, _MOST_WAVES)
    numbers = np.arange(_LEAST_WAVES, max(most, _LEAST_WAVES + 1.0), _STEP)
    best, size = ("radial", float(numbers[0])), -1.0
    for what in ("radial", *AXES):
        weight = np.ones(residual.size) if what == "radial" else along(what, test.angle_rad)[0]
        power = np.zeros(numbers.size)
        for rows in (test.sense > 0.0, test.sense < 0.0):
            values = _power(weight[rows] * residual[rows], test.turn_rad[rows], numbers)
            power += values / np.sum(weight[rows] ** 2)
        if power.max() > size:
            best, size = (what, float(numbers[power.argmax()])), float(power.max())
    return refined(vibration_shape(test, *best, 3.0 * numbers.size), design, residual)


def _power(values: Floats, phase: Floats, numbers: Floats) -> Floats:
    """Return the power of values at wave numbers over a phase, shape (numbers,); the step between them is even."""
    turn = np.exp(1j * phase * (numbers[1] - numbers[0])) if numbers.size > 1 else np.ones(phase.size)
    wave = values * np.exp(1j * phase * numbers[0])
    found = np.empty(numbers.size)
    for index in range(numbers.size):
        found[index] = abs(wave.sum()) ** 2
        wave *= turn
    return found


def refined(shape: Shape, design: Design, residual: Floats) -> Shape:
    """Return a wave at the best parameter within a step of its own, by golden sections; other shapes as they are."""
    if shape.at is None:
        return shape
    low, high = shape.parameter - _STEP, shape.parameter + _STEP
    inner = [high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)]
    gains = [design.gain(shape.at(x), residual) for x in inner]
    while high - low > _PRECISE:
        if gains[0] > gains[1]:
            high, inner[1], gains[1] = inner[1], inner[0], gains[0]
            inner[0] = high - _GOLDEN * (high - low)
            gains[0] = design.gain(shape.at(inner[0]), residual)
        else:
            low, inner[0], gains[0] = inner[0], inner[1], gains[1]
            inner[1] = low + _GOLDEN * (high - low)
            gains[1] = design.gain(shape.at(inner[1]), residual)
    return shape.at(inner[0] if gains[0] > gains[1] else inner[1])
