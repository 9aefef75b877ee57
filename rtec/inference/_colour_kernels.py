"""Innovations of a first-order autoregressive noise with a white part, for many columns and uneven steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import kernel


@kernel
def filter_steps(
    gap: NDArray[np.float64], rho: float, white: float, carry: NDArray[np.float64], keep: NDArray[np.float64],
    gain: NDArray[np.float64], scale: NDArray[np.float64],
) -> float:  # fmt: skip
    """Fill the filter's numbers of each row; return log |covariance|.

    What a row takes over from the one before, and how much of that it keeps beside its own reading, which counts with
    the Kalman ``gain``; one over the standard deviation of its innovation. ``gap`` is the number of steps since the
    row before, infinite where a chain begins. Total variance 1.
    """
    variance = 1.0 - white
    left = variance
    total = 0.0
    for i in range(gap.size):
        kept = 0.0 if gap[i] == np.inf else rho ** gap[i]
        prior = kept * kept * left + (1.0 - kept * kept) * variance
        innovation = prior + white
        carry[i] = kept
        gain[i] = prior / innovation
        keep[i] = kept * (1.0 - gain[i])
        scale[i] = 1.0 / np.sqrt(innovation)
        left = prior * (1.0 - gain[i])
        total += np.log(innovation)
    return total


@kernel
def whiten_rows(
    columns: NDArray[np.float64], unit: float, carry: NDArray[np.float64], keep: NDArray[np.float64],
    gain: NDArray[np.float64], scale: NDArray[np.float64], without: NDArray[np.float64], white: NDArray[np.float64],
) -> None:  # fmt: skip
    """Fill ``white`` with the standardised innovations of each column times ``unit``, shape (columns, rows).

    A direction ``without`` of length 1 is taken out of them, shape (1, rows); none where that has no rows.
    """
    count, rows = columns.shape
    in_fours = count - count % 4  # side by side: one alone waits for its own last result at every row
    for c in range(0, in_fours, 4):
        mean_0 = mean_1 = mean_2 = mean_3 = 0.0
        for i in range(rows):
            taken, kept, weight, factor = carry[i], keep[i], gain[i], unit * scale[i]
            x_0, x_1, x_2, x_3 = columns[c, i], columns[c + 1, i], columns[c + 2, i], columns[c + 3, i]
            white[c, i] = (x_0 - taken * mean_0) * factor
            white[c + 1, i] = (x_1 - taken * mean_1) * factor
            white[c + 2, i] = (x_2 - taken * mean_2) * factor
            white[c + 3, i] = (x_3 - taken * mean_3) * factor
            mean_0, mean_1 = kept * mean_0 + weight * x_0, kept * mean_1 + weight * x_1
            mean_2, mean_3 = kept * mean_2 + weight * x_2, kept * mean_3 + weight * x_3
    for c in range(in_fours, count):
        mean = 0.0
        for i in range(rows):
            white[c, i] = (columns[c, i] - carry[i] * mean) * (unit * scale[i])
            mean = keep[i] * mean + gain[i] * columns[c, i]
    if without.shape[0]:
        for c in range(count):
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
