"""Fourier series in position: columns, names of the amplitudes, and what people read of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Amplitude, Effect, Quantity, Shape, Units, own_shape, parameter

POINTS_A_PERIOD = 3600
"""On which the peak to peak value is looked up."""


@dataclass(frozen=True, slots=True)
class WavesShape(Shape):
    """Period and number of harmonics of one family of waves."""

    period: float = field(default=1.0, metadata=parameter(Quantity.POSITION, "period"))
    harmonics: int = field(default=1, metadata=parameter(Quantity.COUNT, "harmonics"))

    @property
    def is_one_wave(self) -> bool:
        """Whether it is a single wave, the same in both directions."""
        return self.harmonics == 1


class Waves(Effect):
    """Base of the effects that are a Fourier series in position."""

    shape_type: type[WavesShape] = WavesShape

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return sine and cosine of each harmonic, shape (rows, 2 harmonics)."""
        own = own_shape(shape, self.shape_type)
        return harmonic_columns(conditions.position, own.period, own.harmonics)

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        return harmonic_names(own_shape(shape, self.shape_type).harmonics, units)

    def summary(self, shape: Shape, amplitudes: Sequence[float], units: Units) -> tuple[tuple[str, float, str], ...]:
        """Return period, number of harmonics, amplitude and phase of each, and peak to peak."""
        own = own_shape(shape, self.shape_type)
        head = (("period", own.period, units.position), ("harmonics", float(own.harmonics), ""))
        return head + harmonic_summary(amplitudes, units)


def harmonic_columns(position: Floats, period: float, harmonics: int) -> Floats:
    """Return sine and cosine of each harmonic, shape (rows, 2 harmonics): sin_1, cos_1, sin_2, cos_2, ..."""
    angle = (2.0 * np.pi / period) * position
    turn = np.cos(angle) + 1j * np.sin(angle)
    columns = np.empty((2 * harmonics, position.size))
    wave = turn
    for order in range(harmonics):
        if order:
            wave = wave * turn  # a product for each harmonic takes a fifth of a sine's time, and rounds once more
        columns[2 * order], columns[2 * order + 1] = wave.imag, wave.real
    return columns.T


def harmonic_names(harmonics: int, units: Units, suffix: str = "") -> tuple[Amplitude, ...]:
    """Return names and units of the amplitudes of ``harmonic_columns``."""
    return tuple(
        Amplitude(f"{part}_{order}{suffix}", *units.shown)
        for order in range(1, harmonics + 1)
        for part in ("sin", "cos")
    )


def harmonic_summary(
    amplitudes: Sequence[float] | Floats, units: Units, suffix: str = "", beside: Floats | float = 0.0
) -> tuple[tuple[str, float, str], ...]:
    """Return amplitude and phase of each harmonic, and the peak to peak value of all together.

    The k-th harmonic is ``amplitude_k * sin(2 pi k x / period + phase_k)``. What stands ``beside`` them belongs to
    the peak to peak value: one value for each point of `POINTS_A_PERIOD`, or none.
    """
    unit, factor = units.shown
    parts = np.asarray(amplitudes, dtype=np.float64).reshape(-1, 2)
    lines: list[tuple[str, float, str]] = []
    for order, (sine, cosine) in enumerate(parts, start=1):
        lines.append((f"amplitude_{order}{suffix}", float(np.hypot(sine, cosine)) * factor, unit))
        lines.append((f"phase_{order}{suffix}", float(np.degrees(np.arctan2(cosine, sine))), "deg"))
    turn = harmonic_columns(np.arange(POINTS_A_PERIOD) / POINTS_A_PERIOD, 1.0, len(parts)) @ parts.ravel() + beside
    return (*lines, (f"peak_to_peak{suffix}", float(np.ptp(turn)) * factor, unit))
