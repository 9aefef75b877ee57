"""Spectra of a residual: least-squares lines at many frequencies, in time that grows with the rows only linearly."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rtec.effects import Floats
from rtec.inference.results import NoiseFloor

PROBABILITY = 0.01
"""That noise alone passes the threshold anywhere in the spectrum."""
_CELLS_PER_CYCLE = 8
"""Of the grid at the highest frequency: readings move by 1/16 of a cycle at most, which takes 3 % of an amplitude."""
_FINER = 4
"""Frequencies per resolution 1/span: a line between two of them loses 3 % at most."""
_LONGEST = 2**21
"""Of a transform: 65 536 cycles over the span."""
_SINGULAR = 1e-6
_REGULAR = 0.05
"""Share of the median gap by which the gaps of regular places may differ."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spectrum:
    """Amplitude of the best-fitting wave at each frequency, shape (frequencies,)."""

    frequency: Floats
    amplitude: Floats
    """√2 times the RMS that the wave explains: the amplitude of a sine that the readings resolve."""


def highest_frequency(span: float, wanted: float) -> float:
    """Return the frequency up to which a spectrum is computed: as wanted, or as far as the longest transform goes."""
    return min(wanted, _LONGEST / (_FINER * _CELLS_PER_CYCLE * span))


def spectrum(x: Floats, y: Floats, top: float) -> Spectrum:
    """Return the spectrum of readings at any places.

    Parameters
    ----------
    x
        Places or times, shape (rows,), in any order, with repeats.
    y
        Readings, shape (rows,).
    top
        Highest frequency, in cycles per unit of ``x``; see ``highest_frequency``.

    Notes
    -----
    At every frequency a sine, a cosine and a constant are fitted by least squares, as in the generalised periodogram
    of Lomb and Scargle. The sums come from Fourier transforms of the readings and their number, gathered on a fine
    grid (Press and Rybicki 1989).

    References
    ----------
    Zechmeister and Kürster (2009), Astronomy & Astrophysics 496, 577, equations 4 to 19. Press and Rybicki (1989),
    Astrophysical Journal 338, 277.

    Examples
    --------
    >>> x = np.linspace(0.0, 100.0, 400)
    >>> found = spectrum(x, 3.0 + 0.5 * np.sin(2 * np.pi * 0.2 * x), 1.0)
    >>> k = int(np.argmax(found.amplitude))
    >>> round(float(found.frequency[k]), 2), round(float(found.amplitude[k]), 1)
    (0.2, 0.5)
    """
    span, step = float(np.ptp(x)), 1.0 / (_CELLS_PER_CYCLE * top)
    cell = np.rint((x - x.min()) / step).astype(np.int64)
    cells = int(cell.max()) + 1
    length = 2 ** math.ceil(math.log2(max(_FINER * cells, 16)))
    centred = y - y.mean()
    sums = np.fft.rfft(np.bincount(cell, weights=centred, minlength=cells), length) / x.size
    counts = np.fft.rfft(np.bincount(cell, minlength=cells).astype(np.float64), length) / x.size
    last = min(int(top * step * length), (sums.size - 1) // 2)
    k = np.arange(max(1, round(step * length / span)), last + 1)
    explained = _explained(sums[k], counts[k], counts[2 * k])
    return Spectrum(frequency=k / (length * step), amplitude=np.sqrt(2.0 * explained))


def _explained(sums: np.ndarray, counts: np.ndarray, doubled: np.ndarray) -> Floats:
    """Return the mean square that a wave with a constant explains at each frequency."""
    yc, ys = sums.real, -sums.imag
    c, s = counts.real, -counts.imag
    cc = 0.5 * (1.0 + doubled.real) - c * c
    ss = 0.5 * (1.0 - doubled.real) - s * s
    cs = 0.5 * -doubled.imag - c * s
    determinant = cc * ss - cs * cs
    # where the readings see one phase only, one of both waves is all that can be fitted
    regular = determinant > _SINGULAR * (cc + ss) ** 2
    both = (ss * yc**2 + cc * ys**2 - 2.0 * cs * yc * ys) / np.where(regular, determinant, 1.0)
    power = cc + ss
    one = (yc**2 + ys**2) / np.where(power > _SINGULAR, power, 1.0)
    explained: Floats = np.where(regular, both, np.where(power > _SINGULAR, one, 0.0))
    return np.maximum(explained, 0.0)


def threshold(frequency: Floats, noise: NoiseFloor, *, rows: int, resolved: float, spacing: float) -> Floats:
    """Return the amplitude that noise alone passes anywhere with a probability of 1 % only, shape (frequencies,).

    Parameters
    ----------
    frequency
        Shape (frequencies,).
    noise
        Of a reading: its correlation from reading to reading raises the threshold at low frequencies.
    rows
        Number of readings.
    resolved
        Number of frequencies that are independent of each other.
    spacing
        From reading to reading, in units of 1/frequency.

    Notes
    -----
    Of white noise, N explained/(2σ²) is exponential at each frequency (Scargle 1982, equation 13); the largest of M
    independent ones passes z with probability 1 − (1 − e⁻ᶻ)ᴹ.

    Examples
    --------
    >>> noise = NoiseFloor(from_repeats=True, sigma=1.0, correlation=0.0, white_share=1.0, degrees_of_freedom=99.0,
    ...     sigma_adjacent=None)
    >>> threshold(np.array([0.1]), noise, rows=400, resolved=1.0, spacing=1.0).round(4).tolist()
    [0.2146]
    """
    quiet = -np.log(-np.expm1(np.log1p(-PROBABILITY) / max(resolved, 1.0)))
    white = 2.0 * noise.sigma * math.sqrt(quiet / rows)
    rho = min(max(noise.correlation, 0.0), 0.999)
    reddened = (1.0 - rho**2) / (1.0 - 2.0 * rho * np.cos(2 * np.pi * frequency * spacing) + rho**2)
    return white * np.sqrt(noise.white_share + (1.0 - noise.white_share) * reddened)


@dataclass(frozen=True, slots=True)
class Sampling:
    """How often an axis was looked at along its length."""

    step: float | None
    """Between places that are regular; None where they are not."""
    nyquist: float
    """Half the places per unit of length: of those that are not regular, by their mean distance."""


def sampling_of(places: Floats) -> Sampling:
    """Return how distinct places, ascending, shape (places,), sample an axis.

    Examples
    --------
    >>> sampling_of(np.array([0.0, 5.0, 10.0, 15.0])), sampling_of(np.array([0.0, 2.0, 15.0])).step
    (Sampling(step=5.0, nyquist=0.1), None)
    """
    gaps = np.diff(places)
    step = float(np.median(gaps))
    if np.abs(gaps - step).max() < _REGULAR * step:
        return Sampling(step, 0.5 / step)
    return Sampling(None, 0.5 * gaps.size / float(np.ptp(places)))


def mirrored(frequency: float, step: float, top: float) -> list[float]:
    """Return where a line shows up again because targets lie at multiples of ``step``, up to ``top``.

    Examples
    --------
    >>> mirrored(0.2, 1.0, 1.0), mirrored(1.3, 1.0, 1.0)
    ([0.8], [0.3, 0.7])
    """
    rate = 1.0 / step
    inside = frequency % rate
    places = {round(place, 12) for place in (inside, rate - inside) if 0 < place <= top}
    return sorted(place for place in places if abs(place - frequency) > 1e-6 * rate)
