"""Cyclic error: the part of the deviation that repeats with every turn of the screw (or tooth, or pole pair).

Method: one least-squares fit of a slow trend (Legendre polynomials over the travel) together with sine and cosine of
the period and its multiples; the answer is the peak to peak of the fitted periodic part. Fitting both together needs
neither a whole number of periods nor equal steps, so the same method serves a dense grid (0.025 inch on a 0.25 inch
screw: ten phases, four harmonics) and a coarse one whose targets drift through the phases (0.52 inch: 25 phases).

How many harmonics the targets resolve is found out from the targets alone: a harmonic counts where its columns keep
most of their length after the trend and the lower harmonics are projected off. What lies above the last one counted
is aliased onto those below and cannot be told from them. Targets at whole periods, or at half periods, resolve none:
they hide any cyclic error completely.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtec.errors import ArgumentError
from rtec.metrology.readings import Floats

MAX_HARMONICS = 6
MAX_TREND_DEGREE = 12
_TARGETS_PER_UNKNOWN = 2
_KEPT_LENGTH = 0.3
_PHASES = 2880
_MOST_PERIODS = 1e9
"""Beyond this many periods from zero a float64 position no longer says where in its period it is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CyclicError:
    """Cyclic error of one direction."""

    peak_to_peak: float | None
    """Of the fitted periodic part, in the unit of the deviations, or None where the targets cannot show it."""
    harmonics: int
    """Harmonics resolved."""
    note: str
    """Why there is no figure, or what the figure leaves out."""


def cyclic_error(position: Floats, deviation: Floats, period: float) -> CyclicError:
    """Estimate the cyclic error in one direction, or say why the targets cannot show it.

    Targets and the mean deviation at each have the shape (n,); the period is in the unit of the position.

    Raises
    ------
    ArgumentError
        A period that is not above zero.

    Examples
    --------
    >>> x = np.arange(0.0, 40, 0.5)
    >>> e = cyclic_error(x, 0.002 * x + 0.5 * np.sin(2 * np.pi * x / 5), 5.0)
    >>> round(e.peak_to_peak, 3), e.harmonics
    (1.0, 4)
    >>> cyclic_error(x[::10], x[::10], 5.0).note
    'the targets do not resolve the period: they lie at whole or half periods, or are too few'
    """
    if not 0 < period < np.inf:
        raise ArgumentError("period", period, "a length or angle above zero")
    span = float(np.ptp(position)) if position.size else 0.0
    if span < period:
        return CyclicError(peak_to_peak=None, harmonics=0, note="the travel is shorter than the period")
    if float(np.abs(position).max()) / period > _MOST_PERIODS:
        return CyclicError(
            peak_to_peak=None, harmonics=0, note="the period is too short for the digits of the targets"
        )
    degree = int(min(MAX_TREND_DEGREE, span / period, position.size // 6))
    scaled = 2 * (position - position.min()) / span - 1
    trend = np.polynomial.legendre.legvander(scaled, degree)
    harmonics = _resolved_harmonics(trend, position, period)
    if harmonics == 0:
        note = "the targets do not resolve the period: they lie at whole or half periods, or are too few"
        return CyclicError(peak_to_peak=None, harmonics=0, note=note)
    periodic = _periodic_columns(position / period, harmonics)
    coefficients = np.linalg.lstsq(np.hstack((trend, periodic)), deviation, rcond=None)[0][degree + 1 :]
    cycle = _periodic_columns(np.arange(_PHASES) / _PHASES, harmonics) @ coefficients
    note = f"harmonics 1 to {harmonics} of the period; higher ones, if any, are aliased onto these"
    return CyclicError(peak_to_peak=float(np.ptp(cycle)), harmonics=harmonics, note=note)


def _periodic_columns(cycles: Floats, harmonics: int) -> Floats:
    """Return cosine and sine of each harmonic, shape (n, 2 harmonics)."""
    phase = 2 * np.pi * np.mod(cycles, 1.0)
    columns = [wave(order * phase) for order in range(1, harmonics + 1) for wave in (np.cos, np.sin)]
    return np.stack(columns, axis=1)


def _resolved_harmonics(trend: Floats, position: Floats, period: float) -> int:
    """Return how many harmonics the targets tell from the trend and from each other."""
    columns = _periodic_columns(position / period, MAX_HARMONICS)
    known = np.linalg.qr(trend)[0]
    resolved = 0
    for order in range(MAX_HARMONICS):
        pair = columns[:, 2 * order : 2 * order + 2]
        if position.size < _TARGETS_PER_UNKNOWN * (known.shape[1] + 2):
            break
        left = pair - known @ (known.T @ pair)
        if np.linalg.svd(left, compute_uv=False)[-1] < _KEPT_LENGTH * np.sqrt(position.size / 2):
            break
        known = np.linalg.qr(np.hstack((known, pair)))[0]
        resolved += 1
    return resolved
