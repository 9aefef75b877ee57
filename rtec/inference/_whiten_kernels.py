"""Innovations of a first-order autoregressive noise with a white part, for many columns at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import kernel


@kernel
def gains(rho: float, white: float, longest: int, gain: NDArray[np.float64], sd: NDArray[np.float64]) -> None:
    """Fill Kalman gain and standard deviation of the innovation at each place of a segment, total variance 1."""
    variance = 1.0 - white
    prior = variance
    for i in range(longest):
        innovation = prior + white
        gain[i] = prior / innovation
        sd[i] = np.sqrt(innovation)
        prior = rho * rho * prior * (1.0 - gain[i]) + variance * (1.0 - rho * rho)


@kernel
def whiten(
    columns: NDArray[np.float64],
    place: NDArray[np.int64],
    rho: float,
    gain: NDArray[np.float64],
    sd: NDArray[np.float64],
) -> None:
    """Replace each column, shape (columns, rows), by its standardised innovations; place 0 begins a segment."""
    count, rows = columns.shape
    for c in range(count):
        mean = 0.0
        for i in range(rows):
            at = place[i]
            if at == 0:
                mean = 0.0
            error = columns[c, i] - mean
            mean = rho * (mean + gain[at] * error)
            columns[c, i] = error / sd[at]
