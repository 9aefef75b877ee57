"""Innovations of a first-order autoregressive noise with a white part, for many columns and uneven steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import kernel

TOGETHER = 8
"""Columns that pass the filter side by side: one alone would wait for its own last result at every row."""


@kernel
def filter_steps(
    gap: NDArray[np.float64], rho: float, white: float, carry: NDArray[np.float64], sd: NDArray[np.float64],
    gain: NDArray[np.float64],
) -> float:  # fmt: skip
    """Fill what each row takes over from the one before, its Kalman gain and innovation; return log |covariance|.

    ``gap`` is the number of steps since the row before, infinite where a chain begins. Total variance 1.
    """
    variance = 1.0 - white
    left = variance
    total = 0.0
    for i in range(gap.size):
        kept = 0.0 if gap[i] == np.inf else rho ** gap[i]
        prior = kept * kept * left + (1.0 - kept * kept) * variance
        innovation = prior + white
        carry[i] = kept
        sd[i] = np.sqrt(innovation)
        gain[i] = prior / innovation
        left = prior * (1.0 - gain[i])
        total += np.log(innovation)
    return total


@kernel
def whiten_rows(
    columns: NDArray[np.float64], unit: float, carry: NDArray[np.float64], sd: NDArray[np.float64],
    gain: NDArray[np.float64], without: NDArray[np.float64], white: NDArray[np.float64],
) -> None:  # fmt: skip
    """Fill ``white`` with the standardised innovations of each column times ``unit``, shape (columns, rows).

    A direction ``without`` of length 1 is taken out of them, shape (1, rows); none where that has no rows.
    """
    count, rows = columns.shape
    mean = np.zeros(TOGETHER)
    for first in range(0, count, TOGETHER):
        width = min(TOGETHER, count - first)
        mean[:] = 0.0
        for i in range(rows):
            scale = unit / sd[i]
            for c in range(width):
                expected = carry[i] * mean[c]
                error = columns[first + c, i] - expected
                mean[c] = expected + gain[i] * error
                white[first + c, i] = error * scale
        if without.shape[0]:
            for c in range(first, first + width):
                share = np.dot(white[c], without[0])
                for i in range(rows):
                    white[c, i] -= share * without[0, i]


@kernel
def coloured_rows(columns: NDArray[np.float64], carry: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """Fill ``out`` with the correlation matrix of the slow part times each column, shape (columns, rows)."""
    count, rows = columns.shape
    for c in range(count):
        so_far = 0.0
        for i in range(rows):
            so_far = carry[i] * so_far + columns[c, i]
            out[c, i] = so_far
        to_come = 0.0
        for i in range(rows - 1, -1, -1):
            out[c, i] += to_come
            to_come = carry[i] * (to_come + columns[c, i])
