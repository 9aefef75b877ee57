"""Signals of a moving log: derivatives of position in a limited band, and decimation of whatever is fitted.

A force is explained by velocity and acceleration, which a log does not hold: they are differences of the position,
and differences of a rounded position are mostly noise. So the band is limited first, and every column passes the same
filters as the observed quantity, or the fit would blame the difference of the filters on the axis. The recipe is the
usual one of identifying robots and drives:

1. position through a Butterworth low pass of 4 poles, forwards and backwards, so that it has no phase;
2. velocity and acceleration by central differences;
3. 0.2 s dropped at each end, where the filter has not settled;
4. observed quantity and every column of every candidate through ``scipy.signal.decimate(..., ftype="iir")``.

References
----------
A. Janot, M. Gautier, M. Brunot, "Data set and reference models of EMPS", 2019 Workshop on Nonlinear System
Identification Benchmarks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rtec.effects import Floats

Ints = NDArray[np.int64]

CUTOFF_HZ = 100.0
"""Low pass of the differentiator; the drives of machine tools move nothing faster."""
CUTOFF_SHARE = 0.2
"""Largest cut-off, as a share of the sampling rate."""
SETTLING_S = 0.2
"""Dropped at each end."""
REMAINING_HZ = 100.0
"""Sampling rate that decimation aims at."""
DECIMATED_FROM_HZ = 500.0
"""Slower logs are not decimated."""
_POLES = 4
_LARGEST_STAGE = 13
"""Factor above which one pass of ``decimate`` loses accuracy, so that it is done in stages (scipy's own advice)."""
_FILTERED_AT_LEAST, _DECIMATED_AT_LEAST = 16, 28
"""Samples that scipy's ``filtfilt`` and ``decimate`` need to mirror the signal at its ends."""
_CHEBYSHEV_POLES, _RIPPLE_DB, _PASS_BAND = 8, 0.05, 0.8
"""Of the low pass in ``scipy.signal.decimate``: poles, ripple in dB, end of its pass band as a share of Nyquist."""
_COMPILED_FROM = 16
"""Signals from which the compiled filter is worth the time to load it."""
_WINDOW = 21
"""Rows of the local polynomial that differentiates an unevenly sampled log."""


def cutoff_of(rate_hz: float) -> float:
    """Return the cut-off of the low pass for a sampling rate, in Hz.

    Examples
    --------
    >>> cutoff_of(1000.0), cutoff_of(50.0)
    (100.0, 10.0)
    """
    return min(CUTOFF_HZ, CUTOFF_SHARE * rate_hz)


def stages_of(rate_hz: float) -> tuple[int, ...]:
    """Return the factors by which a log is decimated, one after the other; none for a slow log.

    Examples
    --------
    >>> stages_of(1000.0), stages_of(20_000.0), stages_of(100.0)
    ((10,), (10, 10, 2), ())
    """
    if rate_hz < DECIMATED_FROM_HZ:
        return ()
    left, stages = rate_hz / REMAINING_HZ, []
    while left > _LARGEST_STAGE:
        stages.append(10)
        left /= 10
    if round(left) > 1:
        stages.append(round(left))
    return tuple(stages)


def low_pass(values: Floats, rate_hz: float, cutoff_hz: float) -> Floats:
    """Return evenly sampled values without what is faster than ``cutoff_hz``, with no phase; shape (samples,)."""
    from scipy.signal import butter, filtfilt  # noqa: PLC0415 - 0.5 s, for moving logs only

    numerator, denominator = butter(_POLES, cutoff_hz / (rate_hz / 2.0))
    smooth: Floats = filtfilt(numerator, denominator, values)
    return smooth


def shortest_stretch(rate_hz: float) -> int:
    """Return the fewest samples of an evenly sampled stretch that leave a reading after filter and decimation.

    Examples
    --------
    >>> shortest_stretch(1000.0), shortest_stretch(20.0)
    (428, 16)
    """
    stages = stages_of(rate_hz)
    left = _DECIMATED_AT_LEAST * int(np.prod(stages[:-1])) if stages else 1
    return max(_FILTERED_AT_LEAST, 2 * settling_samples(rate_hz) + left)


def settling_samples(rate_hz: float) -> int:
    """Return the samples dropped at each end.

    Examples
    --------
    >>> settling_samples(1000.0), settling_samples(1.0)
    (200, 1)
    """
    return max(1, round(SETTLING_S * rate_hz))


def local_derivatives(time_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return first and second derivative of unevenly sampled values.

    Parameters
    ----------
    time_s, values
        Shape (rows,); times do not decrease.

    Returns
    -------
    tuple of ndarray
        Each of shape (rows,): of the parabola that fits the 21 nearest rows best (all rows, where there are fewer),
        at the actual times.

    Examples
    --------
    >>> t = np.sort(np.random.default_rng(1).uniform(0, 1, 50))
    >>> first, second = local_derivatives(t, 3 * t**2 - t)
    >>> bool(np.allclose(first, 6 * t - 1)), bool(np.allclose(second, 6))
    (True, True)
    """
    width = min(_WINDOW, time_s.size)
    windows = time_s.size - width + 1
    first, second = np.empty(time_s.size), np.empty(time_s.size)
    nearest = np.clip(np.arange(time_s.size) - width // 2, 0, windows - 1)
    for begin in range(0, time_s.size, 50_000):
        rows = slice(begin, min(begin + 50_000, time_s.size))
        at = nearest[rows, None] + np.arange(width)
        first[rows], second[rows] = _parabola(time_s[at], values[at], time_s[rows])
    return first, second


def _parabola(time_s: Floats, values: Floats, at_s: Floats) -> tuple[Floats, Floats]:
    """Return slope and curvature at one time of the parabola through each row of a window, shape (rows, width)."""
    mean = time_s.mean(1)
    u = time_s - mean[:, None]
    square = (u**2).sum(1)
    spread = np.where(square > 0, square, 1.0)
    skew = (u**3).sum(1) / spread
    w = u**2 - skew[:, None] * u - (square / u.shape[1])[:, None]
    norm = (w**2).sum(1)
    bends = norm > 1e-9 * spread**2
    slope = (u * values).sum(1) / spread
    bend = np.where(bends, (w * values).sum(1) / np.where(bends, norm, 1.0), 0.0)
    return slope + bend * (2.0 * (at_s - mean) - skew), 2.0 * bend


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Resample:
    """Decimation of columns that were computed for every sample.

    Parameters
    ----------
    stretches
        First sample and end of each evenly sampled stretch: each is filtered for itself. Together they hold every
        sample.
    stages
        Factors of ``scipy.signal.decimate``, one after the other.
    picked
        Which of the decimated rows are taken, shape (rows,); None for all.

    Notes
    -----
    A constant comes out 1.1 % smaller from each stage: with its even number of poles the filter has its ripple of
    0.05 dB, forwards and backwards, at frequency zero. Columns and observed quantity shrink alike, so that amplitudes
    stay what they are.

    Examples
    --------
    >>> resample = Resample(stretches=((0, 500),), stages=(10,))
    >>> resample.samples, resample.rows, resample.kept[:3].tolist()
    (500, 50, [0, 10, 20])
    >>> resample.apply(np.ones((500, 2))).shape
    (50, 2)
    """

    stretches: tuple[tuple[int, int], ...]
    stages: tuple[int, ...]
    picked: Ints | None = None

    @property
    def samples(self) -> int:
        """Samples before."""
        return self.stretches[-1][1]

    @property
    def factor(self) -> int:
        """Samples for one row."""
        return int(np.prod(self.stages))

    @property
    def kept(self) -> Ints:
        """The sample at which each row stands, shape (rows,)."""
        every = np.concatenate([np.arange(*stretch, self.factor) for stretch in self.stretches])
        return every if self.picked is None else every[self.picked]

    @property
    def rows(self) -> int:
        """Rows after."""
        if self.picked is not None:
            return int(self.picked.size)
        return sum(-(-(end - begin) // self.factor) for begin, end in self.stretches)

    def apply(self, columns: Floats) -> Floats:
        """Return columns of shape (samples, amplitudes) decimated, shape (rows, amplitudes)."""
        return self.apply_rows(columns.T).T

    def apply_rows(self, signals: Floats) -> Floats:
        """Return signals of shape (..., samples) decimated, shape (..., rows)."""
        lines = np.ascontiguousarray(signals, dtype=np.float64).reshape(-1, self.samples)
        parts = []
        for begin, end in self.stretches:
            part = lines[:, begin:end]
            for factor in self.stages:
                part = _decimated(part, factor)
            parts.append(part)
        every = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=-1)
        picked: Floats = every if self.picked is None else every[:, self.picked]
        return np.ascontiguousarray(picked).reshape(*signals.shape[:-1], self.rows)

    def take(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> Resample:
        """Return the decimation to some of the rows."""
        every = np.arange(self.rows) if self.picked is None else self.picked
        return replace(self, picked=every[rows])


def _decimated(lines: Floats, factor: int) -> Floats:
    """Return signals of shape (lines, samples) as ``scipy.signal.decimate(..., ftype="iir")`` gives them.

    Many signals, as a scan has them, pass a compiled filter side by side: the same arithmetic, ten times faster.
    """
    from scipy.signal import cheby1, decimate, sosfilt_zi  # noqa: PLC0415 - 0.5 s, for moving logs only

    if len(lines) < _COMPILED_FROM:
        few: Floats = decimate(lines, factor, ftype="iir", axis=-1)
        return few
    from rtec.dataset._decimate_kernels import decimate_lines  # noqa: PLC0415 - loads numba, for scans only

    sections = cheby1(_CHEBYSHEV_POLES, _RIPPLE_DB, _PASS_BAND / factor, output="sos")
    found = np.empty((len(lines), -(-lines.shape[1] // factor)))
    edge = _DECIMATED_AT_LEAST - 1
    decimate_lines(np.ascontiguousarray(lines), sections, sosfilt_zi(sections), edge, factor, found)
    return found
