"""Decimation of many signals at once: second-order sections forwards and backwards, side by side."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import kernel

SIDE_BY_SIDE = 16
"""Signals that pass the filter together: the machine multiplies them in one go."""


@kernel
def decimate_lines(
    signals: NDArray[np.float64],
    sections: NDArray[np.float64],
    settled: NDArray[np.float64],
    edge: int,
    factor: int,
    found: NDArray[np.float64],
) -> None:
    """Filter each row of ``signals`` without phase and keep every ``factor``-th sample in ``found``.

    The ends are mirrored about the end points over ``edge`` samples. ``sections`` is of shape (n, 6) with a0 = 1,
    ``settled`` of shape (n, 2) the state of each section after a long time at 1.
    """
    lines, samples = signals.shape
    long = samples + 2 * edge
    work = np.empty((long, SIDE_BY_SIDE))
    state = np.empty((sections.shape[0], 2, SIDE_BY_SIDE))
    for begin in range(0, lines, SIDE_BY_SIDE):
        wide = min(SIDE_BY_SIDE, lines - begin)
        for lane in range(SIDE_BY_SIDE):
            line = begin + min(lane, wide - 1)
            for i in range(samples):
                work[edge + i, lane] = signals[line, i]
            for i in range(edge):
                work[i, lane] = 2.0 * signals[line, 0] - signals[line, edge - i]
                work[edge + samples + i, lane] = 2.0 * signals[line, samples - 1] - signals[line, samples - 2 - i]
        for way in range(2):
            first = 0 if way == 0 else long - 1
            for s in range(sections.shape[0]):
                for lane in range(SIDE_BY_SIDE):
                    state[s, 0, lane] = settled[s, 0] * work[first, lane]
                    state[s, 1, lane] = settled[s, 1] * work[first, lane]
            for i in range(long):
                at = i if way == 0 else long - 1 - i
                for s in range(sections.shape[0]):
                    b0, b1, b2 = sections[s, 0], sections[s, 1], sections[s, 2]
                    a1, a2 = sections[s, 4], sections[s, 5]
                    for lane in range(SIDE_BY_SIDE):
                        x = work[at, lane]
                        y = b0 * x + state[s, 0, lane]
                        state[s, 0, lane] = b1 * x - a1 * y + state[s, 1, lane]
                        state[s, 1, lane] = b2 * x - a2 * y
                        work[at, lane] = y
        for lane in range(wide):
            for k in range(found.shape[1]):
                found[begin + lane, k] = work[edge + k * factor, lane]
