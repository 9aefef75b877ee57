"""Signals of a moving log: derivatives of position in a limited band, and decimation of whatever is fitted.

A force is explained by velocity and acceleration, which a log does not hold: they are differences of the position,
and differences of a rounded position are mostly noise. So the band is limited first, and every column passes the same
filters as the observed quantity, or the fit would blame the difference of the filters on the axis. The recipe is the
usual one of identifying robots and drives (A. Janot, M. Gautier, M. Brunot, "Data set and reference models of EMPS",
2019 Workshop on Nonlinear System Identification Benchmarks):

1. position through a Butterworth low pass of 4 poles, forwards and backwards, so that it has no phase;
2. velocity and acceleration by central differences;
3. 0.2 s dropped at each end, where the filter has not settled;
4. observed quantity and every column of every candidate through ``scipy.signal.decimate(..., ftype="iir")``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.standstill import Ints, Stretch, group_means
from rtec.effects import Floats

_CUTOFF_HZ = 100.0  # low pass of the differentiator; the drives of machine tools move nothing faster
_CUTOFF_SHARE, _OF_COMMANDS = 0.2, 0.45  # largest cut-off, as a share of the sampling rate
_FEWEST_BENDS = 64  # of which a spectrum tells anything
_ONLY_NOISE, _ABOVE = 0.35, 3.0  # share of the sampling rate above which nothing moves; times the noise, motion
_LOWEST, _MARGIN = 0.02, 1.5  # of the largest cut-off; times the highest frequency of motion, which shall pass
_NO_MATTER, _MOST_NOISE = 1e-4, 1e-4  # of the variance of an acceleration may be noise; of a position or velocity is
_IN_LINES = 0.5  # of the noise of rounding may stand in lines, at the frequency at which steps pass
_OF_DIFFERENCES = 4.0  # largest noise of the difference of roundings, over that of one
_SHOWN, _LEAST_LAG = 0.5, 0.25  # of what is left without a lag; samples that a velocity is late at least
_SETTLING_S = 0.2  # dropped at each end
_REMAINING_HZ = 100.0  # sampling rate that decimation aims at
_DECIMATED_FROM_HZ = 500.0  # slower logs are not decimated
_POLES = 4
_MIRRORED = 1.5  # periods of the cut-off that a signal is continued beyond its ends
_LARGEST_STAGE = 13  # factor above which one pass of ``decimate`` loses accuracy (scipy's own advice)
_FILTERED_AT_LEAST, _DECIMATED_AT_LEAST = 16, 28  # that ``filtfilt`` and ``decimate`` need to mirror a signal's ends
_WINDOW, _AT_ONCE = 21, 50_000  # rows of the local polynomial of an uneven log; windows that are computed together


def cutoff_of(
    parts: Sequence[Floats], rate_hz: float, step: float = 0.0, *, noisy: bool = True, commanded: bool = False
) -> float:
    """Return the cut-off of the low pass for positions or velocities sampled at a rate, in Hz.

    The band up to it holds the most of the spectrum beyond noise, which an acceleration holds times the square of the
    frequency. ``parts`` are stretches of samples, each of shape (samples,). The noise is that of rounding to
    ``step``, or what is left in the highest frequencies if that is more; of a velocity (not ``noisy``), whose
    spectrum falls more slowly, the latter may be motion, and of a ``commanded`` position it is.
    """
    most = min(_CUTOFF_HZ, (_OF_COMMANDS if commanded else _CUTOFF_SHARE) * rate_hz)
    bends = np.concatenate([np.empty(0), *(np.diff(part, 2) for part in parts if part.size > 2)])
    if bends.size < _FEWEST_BENDS:
        return most
    share = np.arange(1, bends.size // 2) / bends.size
    power = np.abs(np.fft.rfft(bends * np.hanning(bends.size))[1 : share.size + 1]) ** 2 / np.sin(np.pi * share) ** 4
    tells_noise = noisy and not commanded
    high = float(np.median(power[share > _ONLY_NOISE])) / np.log(2.0) if tells_noise else 0.0
    # 16 / 12 of the step's square, 3 / 8 of it by the window; a velocity is mostly the difference of two roundings
    floor = max(high, step**2 / 2.0 * bends.size * (1.0 if noisy else _OF_DIFFERENCES))
    bent = np.sin(np.pi * share) ** 4 * (share * rate_hz < most)
    no_matter = floor * bent.sum() < _NO_MATTER * (power * bent).sum()
    faster = noisy and floor * share.size > _MOST_NOISE * power.sum()  # it is motion, too fast for the samples
    if no_matter or faster or share[0] * rate_hz > most:
        return most
    gained = np.cumsum((power - _ABOVE * floor)[share * rate_hz <= most])
    lines = _IN_LINES * share.size * (floor if noisy else floor / _OF_DIFFERENCES)
    last = int(np.argmax(gained > gained.max() - lines))
    return float(np.clip(_MARGIN * share[last] * rate_hz, _LOWEST * most, most))


def step_of(values: Floats, fewest_levels: int = 2) -> float:
    """Return the step in which values are rounded, 0 where they are multiples of none, or have fewer levels."""
    steps = np.abs(np.diff(values))
    if not steps.any() or np.unique(values).size < fewest_levels:
        return 0.0
    step = float(np.quantile(steps[steps > 0.0], 0.01))
    off = np.abs(steps / step - np.round(steps / step))
    return step if float(np.quantile(off, 0.9)) < 0.05 else 0.0


def stages_of(rate_hz: float) -> tuple[int, ...]:
    """Return the factors by which a log is decimated, one after the other; none for a slow log."""
    left, stages = rate_hz / _REMAINING_HZ if rate_hz >= _DECIMATED_FROM_HZ else 1.0, []
    while left > _LARGEST_STAGE:
        stages.append(10)
        left /= 10
    return (*stages, round(left)) if round(left) > 1 else tuple(stages)


def even_rate(time_s: Floats, stretches: list[Stretch]) -> float | None:
    """Return the sampling rate of an evenly sampled log in Hz, or None where it is not.

    Even: no time is farther from the best regular grid than a tenth of the interval, or half of the last digit
    in which the file writes its times. A lost sample makes a log uneven.
    """
    counts = [np.arange(end - begin) - (end - begin - 1) / 2.0 for begin, end in stretches]
    times = [time_s[begin:end] - time_s[begin:end].mean() for begin, end in stretches]
    spread = sum(float(count @ count) for count in counts)
    interval = sum(float(count @ time) for count, time in zip(counts, times, strict=True)) / (spread or 1.0)
    if interval <= 0.0:
        return None
    few, last_digit = time_s[:: max(1, time_s.size // 1000)], 0.0
    for digits in range(6, -1, -1):
        step = 10.0**-digits
        if step <= interval and np.abs(few - np.round(few, digits)).max() <= 1e-3 * step:
            last_digit = step
    far = max(np.ptp(time - interval * count) for count, time in zip(counts, times, strict=True))
    return float(f"{1.0 / interval:.9g}") if far <= max(0.2 * interval, 1.02 * last_digit) else None


def settling_samples(rate_hz: float) -> int:
    """Return the samples dropped at each end."""
    return max(1, round(_SETTLING_S * rate_hz))


def shortest_stretch(rate_hz: float) -> int:
    """Return the fewest samples of an evenly sampled stretch that leave a reading after filter and decimation."""
    stages = stages_of(rate_hz)
    left = _DECIMATED_AT_LEAST * int(np.prod(stages[:-1])) if stages else 1
    return max(_FILTERED_AT_LEAST, 2 * settling_samples(rate_hz) + left)


def low_pass(values: Floats, rate_hz: float, cutoff_hz: float) -> Floats:
    """Return evenly sampled values without what is faster than ``cutoff_hz``, with no phase; shape (samples,)."""
    from scipy.signal import butter, filtfilt  # noqa: PLC0415 - 0.5 s, for moving logs only

    mirrored = min(max(_FILTERED_AT_LEAST - 1, round(_MIRRORED * rate_hz / cutoff_hz)), values.size - 1)
    found = filtfilt(*butter(_POLES, cutoff_hz / (rate_hz / 2.0)), values, padlen=mirrored)
    return np.asarray(found, dtype=np.float64)


def lag_of(rate_hz: float, position: Floats, velocity: Floats) -> float:
    """Return by how many seconds an evenly sampled velocity is late against the position; 0 where nothing shows it.

    A drive filters the velocity that it reports. Its sum over time is then the position less the lag times the
    velocity, up to a gain and an offset of its own.

    Examples
    --------
    >>> t = np.arange(0.0, 10.0, 0.01)
    >>> round(lag_of(100.0, np.sin(t), np.cos(t - 0.03)), 4), lag_of(100.0, np.sin(t), np.cos(t))
    (0.03, 0.0)
    """
    sums = (np.cumsum(velocity) - velocity / 2.0) / rate_hz
    table = np.stack([np.ones(sums.size), np.linspace(-1.0, 1.0, sums.size), position, velocity], axis=1)
    with_lag, without = (np.linalg.lstsq(x, sums, rcond=None)[0] for x in (table, table[:, :3]))
    left, more = (float(np.sum((sums - x @ found) ** 2)) for x, found in ((table, with_lag), (table[:, :3], without)))
    lag = -float(with_lag[3] / with_lag[2]) if with_lag[2] != 0.0 else 0.0
    return lag if left < _SHOWN * more and lag * rate_hz > _LEAST_LAG else 0.0


def even_grid(time_s: Floats, values: Floats, interval_s: float) -> tuple[Floats, Floats]:
    """Return times about ``interval_s`` apart, and values there of unevenly sampled ones."""
    first, passed = float(time_s[0]), float(time_s[-1] - time_s[0])
    samples = max(_FILTERED_AT_LEAST, round(passed / interval_s) + 1)
    grid = first + np.arange(samples, dtype=np.float64) * (passed / (samples - 1) if passed > 0.0 else interval_s)
    starts = np.flatnonzero(np.append(True, np.diff(time_s) > 0.0))  # a coarse clock gives several readings one time
    there = np.interp(grid, time_s[starts], group_means(values, starts))
    return grid, np.asarray(there, dtype=np.float64)


def smooth_derivatives(time_s: Floats, values: Floats, cutoff_hz: float) -> tuple[Floats, Floats, Floats]:
    """Return evenly sampled values through the low pass, their first and their second derivative."""
    rate_hz = (time_s.size - 1) / float(time_s[-1] - time_s[0])
    smooth = low_pass(values, rate_hz, cutoff_hz)
    velocity = np.gradient(smooth, 1.0 / rate_hz)
    return smooth, velocity, np.gradient(velocity, 1.0 / rate_hz)


def local_derivatives(time_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return first and second derivative of unevenly sampled values, each of shape (rows,); times do not decrease.

    They are those of the parabola that fits the 21 nearest rows best (all rows, where there are fewer; more, where
    rows follow each other so closely that 21 of them last less than half as long as usual), at the actual times.
    """
    found, passed = np.empty((2, time_s.size)), np.diff(time_s)
    enough = (_WINDOW - 1) / 2.0 * float(np.median(passed[passed > 0.0])) if (passed > 0.0).any() else 0.0
    left, width = np.arange(time_s.size), min(_WINDOW, time_s.size)
    while left.size:
        nearest = np.clip(left - width // 2, 0, time_s.size - width)
        wide = (time_s[nearest + width - 1] - time_s[nearest] >= enough) | (width == time_s.size)
        for begin in range(0, int(wide.sum()), _AT_ONCE):
            rows = left[wide][begin : begin + _AT_ONCE]
            at = nearest[wide][begin : begin + _AT_ONCE, None] + np.arange(width)
            found[:, rows] = _parabola(time_s[at], values[at], time_s[rows])
        left, width = left[~wide], min(2 * width, time_s.size)
    return found[0], found[1]


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


@cache
def _chebyshev(factor: int) -> Floats:
    """Return the low pass of ``decimate``, shape (sections, 6), designed once: a search filters a thousand times."""
    from scipy.signal import cheby1  # noqa: PLC0415 - 0.5 s, for moving logs only

    found: Floats = cheby1(8, 0.05, 0.8 / factor, output="sos")
    return found


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Resample:
    """Decimation of columns that were computed for every sample.

    A constant comes out 1.1 % smaller from each stage: with its even number of poles the filter has its ripple of
    0.05 dB, forwards and backwards, at frequency zero. Columns and observed quantity shrink alike, so that amplitudes
    stay what they are.
    """

    stretches: tuple[Stretch, ...]
    """First sample and end of each evenly sampled stretch: each is filtered for itself. Together they hold every
    sample."""
    stages: tuple[int, ...]
    """Factors of ``scipy.signal.decimate``, one after the other."""
    starts: Ints | None = None
    """First decimated row of each group that becomes one row, its mean, shape (rows,); None where all stay apart."""
    picked: Ints | None = None
    """Which of these rows are taken, shape (rows,); None for all."""

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
        """The sample at which each row stands, of a group the middle one, shape (rows,)."""
        every = np.concatenate([np.arange(*stretch, self.factor) for stretch in self.stretches])
        if self.starts is not None:
            every = every[(self.starts + np.append(self.starts[1:], every.size) - 1) // 2]
        return every if self.picked is None else every[self.picked]

    @property
    def stands_for(self) -> Floats | None:
        """How many decimated rows were put together into each, shape (rows,); None where all stayed apart."""
        if self.starts is None:
            return None
        every = replace(self, starts=None, picked=None).rows
        sizes = np.diff(np.append(self.starts, every)).astype(np.float64)
        return sizes if self.picked is None else sizes[self.picked]

    @property
    def rows(self) -> int:
        """Rows after."""
        return int(self.kept.size)

    def apply(self, signals: Floats) -> Floats:
        """Return signals of shape (..., samples) decimated, shape (..., rows)."""
        from scipy.signal import sosfiltfilt  # noqa: PLC0415 - as above

        lines = np.ascontiguousarray(signals, dtype=np.float64).reshape(-1, self.samples)
        parts = [lines[:, begin:end] for begin, end in self.stretches]
        for factor in self.stages:
            parts = [sosfiltfilt(_chebyshev(factor), part)[:, ::factor] for part in parts]
        every = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=-1)
        every = every if self.starts is None else group_means(every, self.starts)
        every = every if self.picked is None else every[:, self.picked]
        return np.ascontiguousarray(every).reshape(*signals.shape[:-1], -1)

    def take(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> Resample:
        """Return the decimation to some of the rows."""
        return replace(self, picked=(np.arange(self.rows) if self.picked is None else self.picked)[rows])
