"""The shapes with a parameter that a residual shows: reversal spikes, cyclic errors, vibration."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from rtec.metrology.ballbar.circle_test import CircleTest, Floats
from rtec.metrology.ballbar.shapes import (
    AXES,
    SPIKE_WIDTHS_DEG,
    Shape,
    along,
    behind,
    cyclic_shape,
    speed,
    spike_shape,
    vibration_shape,
)

_LEAST_WAVES = 8.0
"""Of a vibration around the circle: fewer are shapes of other errors."""
_LEAST_WAVE_NUMBER, _LOW_WAVE_NUMBER = 2.0 * np.pi * 1.9, 30.0
"""Of a cyclic error: periods up to R / 1.9; and up to which it overlaps with shapes of other errors."""
_POINTS_A_WAVE, _POINTS_A_SPIKE = 2.5, 1.5
_STEP = 0.25
"""Between the numbers of waves that are tried."""
_MOST_WAVES = 300.0
_PRECISE = 1e-4
_CATCHING_UP_DEG = 12.0
"""Behind a reversal, where waves are not looked for."""
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


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A shape with the fall of chi-squared that speaks for it."""

    shape: Shape
    gain: float


def best_shape(test: CircleTest, columns: Floats, deviation_um: Floats, sigma_um: float) -> Candidate:
    """Return the shape with a parameter that lowers chi-squared most beside columns of a fit.

    Waves have to show away from the reversals: what the fit leaves of spikes there has all wave lengths.

    Parameters
    ----------
    test
        The circle test.
    columns
        That are in the fit, shape (points, numbers).
    deviation_um
        What is fitted, shape (points,).
    sigma_um
        Noise of a point.
    """
    design = Design.of(columns)
    residual = design.without(deviation_um) / sigma_um
    found = [Candidate(shape, design.gain(shape, residual)) for shape in _spikes(test, design, residual)]
    away = _away_from_reversals(test)
    part = replace(test, turn_rad=test.turn_rad[away], deviation_um=deviation_um[away], sense=test.sense[away],
                   number=test.number[away])  # fmt: skip
    design = Design.of(columns[away])
    residual = design.without(deviation_um[away]) / sigma_um
    for wave in (*_cyclic(part, design, residual), _vibration(part, design, residual)):
        found.append(Candidate(wave.on(test), design.gain(wave, residual)))
    return max(found, key=lambda one: one.gain - 2.0 * one.shape.columns.shape[1])


def _away_from_reversals(test: CircleTest) -> npt.NDArray[np.bool_]:
    after = [behind(axis, end, test.angle_rad, test.sense) for axis in AXES for end in (1, -1)]
    found: npt.NDArray[np.bool_] = np.min(after, axis=0) > np.radians(_CATCHING_UP_DEG)
    return found


def _spikes(test: CircleTest, design: Design, residual: Floats) -> list[Shape]:
    narrowest = _POINTS_A_SPIKE * 360.0 / test.points_a_revolution
    widths = [width for width in SPIKE_WIDTHS_DEG if width >= narrowest] or [narrowest]
    tried = [
        [spike_shape(test, axis, np.radians(width), rising) for width in widths for rising in (False, True)]
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
            moving = main * speed(axis, test.angle_rad, test.sense)
            power = np.zeros(high.size)
            for weight in (main, moving):
                power += _power(weight * residual, main, high) / np.sum(weight**2)
            tried.append(cyclic_shape(test, axis, float(high[power.argmax()]), float(numbers.size)))
        found.append(refined(test, max(tried, key=lambda shape: design.gain(shape, residual)), design, residual))
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
    return refined(test, vibration_shape(test, *best, 3.0 * numbers.size), design, residual)


def _power(values: Floats, phase: Floats, numbers: Floats) -> Floats:
    """Return the power of values at wave numbers over a phase, shape (numbers,); the step between them is even."""
    turn = np.exp(1j * phase * (numbers[1] - numbers[0])) if numbers.size > 1 else np.ones(phase.size)
    wave = values * np.exp(1j * phase * numbers[0])
    found = np.empty(numbers.size)
    for index in range(numbers.size):
        found[index] = abs(wave.sum()) ** 2
        wave *= turn
    return found


def refined(test: CircleTest, shape: Shape, design: Design, residual: Floats) -> Shape:
    """Return a wave at the best parameter within a step of its own, by golden sections; other shapes as they are."""
    if (of := shape.of) is None:
        return shape

    def gain(parameter: float) -> float:
        return design.gain(of(test, parameter), residual)

    low, high = shape.parameter - _STEP, shape.parameter + _STEP
    inner = [high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)]
    gains = [gain(x) for x in inner]
    while high - low > _PRECISE:
        if gains[0] > gains[1]:
            high, inner[1], gains[1] = inner[1], inner[0], gains[0]
            inner[0] = high - _GOLDEN * (high - low)
            gains[0] = gain(inner[0])
        else:
            low, inner[0], gains[0] = inner[0], inner[1], gains[1]
            inner[1] = low + _GOLDEN * (high - low)
            gains[1] = gain(inner[1])
    return of(test, inner[0] if gains[0] > gains[1] else inner[1])
