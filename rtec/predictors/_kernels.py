"""Compiled evaluation of every predictor: one function of kind, packed numbers, position and direction.

Each predictor packs itself into one flat float64 array, so that all have the same type inside a loop. Positions and
errors are in mm, the direction is +1 (forward) or -1 (reverse; whatever is below zero).

``TABLE``
    ``n, positions[n], errors[n]`` of the forward direction, then the same of the reverse direction. Positions ascend
    strictly, n >= 1; between them the error is linear, beyond them it is that of the nearest point.

``NETWORK``
    ``low, high, pitch, touch, unit`` (mm), then the long-range network, then the cyclic one, each as
    ``n, weights[n], biases_forward[n], biases_reverse[n], layer_weights[n], bias``. Inputs and outputs of both are in
    ``unit``. The position is held in low .. high; the cyclic network sees it modulo ``pitch``, and a position at most
    ``touch`` below a multiple of the pitch counts as that multiple (input 0): the cyclic network is not continuous
    there, and rounding would choose the side. A network of n = 0 neurons gives its bias; the pitch is above zero.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from rtec._jit import helper, kernel

NONE = 0
"""Kind of a predictor that says zero everywhere; its packed array is not read."""
TABLE = 1
"""Kind of a table of errors, linear between its points."""
NETWORK = 2
"""Kind of a pair of sigmoid networks, long-range and cyclic."""

NETWORK_HEAD = 5
"""Numbers in front of the first network of a packed ``NETWORK``."""


@helper
def _interpolate(par: npt.NDArray[np.float64], first: int, n: int, x_mm: float) -> float:
    """Return the error of the table whose positions start at index ``first``."""
    if x_mm <= par[first]:
        return par[first + n]
    last = first + n - 1
    if x_mm >= par[last]:
        return par[last + n]
    below = first
    above = last
    while above - below > 1:
        middle = (below + above) // 2
        if par[middle] <= x_mm:
            below = middle
        else:
            above = middle
    share = (x_mm - par[below]) / (par[above] - par[below])
    return (1.0 - share) * par[below + n] + share * par[above + n]


@helper
def _logsig(x: float) -> float:
    """Return 1 / (1 + exp(-x)) without an overflow on either side."""
    if x >= 0.0:
        return 1.0 / (1.0 + math.exp(-x))
    rising = math.exp(x)
    return rising / (1.0 + rising)


@helper
def _network(par: npt.NDArray[np.float64], start: int, position: float, direction: int) -> float:
    """Return the output of the network whose count of neurons stands at index ``start``."""
    n = int(par[start])
    weights = start + 1
    biases = weights + n if direction >= 0 else weights + 2 * n
    layer = weights + 3 * n
    total = par[layer + n]
    for i in range(n):
        total += par[layer + i] * _logsig(par[biases + i] + par[weights + i] * position)
    return total


@helper
def predict_mm(kind: int, par: npt.NDArray[np.float64], x_mm: float, direction: int) -> float:
    """Return the error (actual minus target, mm) at ``x_mm``, held outside the predictor's range."""
    if kind == TABLE:
        n = int(par[0])
        if direction >= 0:
            return _interpolate(par, 1, n, x_mm)
        reverse = 1 + 2 * n
        return _interpolate(par, reverse + 1, int(par[reverse]), x_mm)
    if kind == NETWORK:
        held_mm = min(max(x_mm, par[0]), par[1])
        pitch_mm = par[2]
        phase_mm = held_mm - pitch_mm * math.floor(held_mm / pitch_mm)
        if pitch_mm - phase_mm <= par[3] or phase_mm < 0.0:
            phase_mm = 0.0
        unit_mm = par[4]
        cyclic = NETWORK_HEAD + 4 * int(par[NETWORK_HEAD]) + 2
        long_range = _network(par, NETWORK_HEAD, held_mm / unit_mm, direction)
        return (long_range + _network(par, cyclic, phase_mm / unit_mm, direction)) * unit_mm
    return 0.0


@kernel
def predict_many(
    kind: int,
    par: npt.NDArray[np.float64],
    x_mm: npt.NDArray[np.float64],
    direction: npt.NDArray[np.int64],
    error_mm: npt.NDArray[np.float64],
) -> None:
    """Write the error at each position, approached in each direction, into ``error_mm``."""
    for i in range(x_mm.size):
        error_mm[i] = predict_mm(kind, par, x_mm[i], direction[i])
