"""Compiled part of the scan over periods: sines and cosines of many equally spaced frequencies."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rtec._jit import array_kernel

ANCHOR = 32
"""Frequencies from one exact sine to the next; turning on from there loses 1e-14 at most."""


@array_kernel
def fill_waves(first: float, step: float, position: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """Fill ``out[k, 0]`` and ``out[k, 1]`` with sine and cosine of ``2 pi (first + k step) position``.

    ``out`` has the shape (frequencies, 2, rows). Each wave is the one before it, turned on by the angle of a step;
    every 32nd is computed anew.
    """
    count, rows = out.shape[0], position.size
    turn_sin, turn_cos = np.empty(rows), np.empty(rows)
    for row in range(rows):
        angle = 2.0 * math.pi * step * position[row]
        turn_sin[row], turn_cos[row] = math.sin(angle), math.cos(angle)
    for k in range(count):
        if k % ANCHOR == 0:
            scale = 2.0 * math.pi * (first + k * step)
            for row in range(rows):
                angle = scale * position[row]
                out[k, 0, row], out[k, 1, row] = math.sin(angle), math.cos(angle)
        else:
            for row in range(rows):
                s, c = out[k - 1, 0, row], out[k - 1, 1, row]
                out[k, 0, row] = s * turn_cos[row] + c * turn_sin[row]
                out[k, 1, row] = c * turn_cos[row] - s * turn_sin[row]
