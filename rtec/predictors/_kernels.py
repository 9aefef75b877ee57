"""Compiled models: functions of inputs that say how far an axis is off, and the sensors that the inputs come from.

Every model is one compiled function ``(numbers, inputs, memory, sd) -> mm`` with its own numbers, called by its
address: loops are compiled once for all models. All four arguments are one-dimensional arrays of float64.
``inputs`` stand in the order in which the model names them; ``memory`` is its own to keep from call to call; into
``sd[0]`` it may write the standard deviation of what it returns, in mm. Positions and errors are in mm, a direction
is +1 (forward) or -1 (reverse; whatever is below zero).

A curve is a model of position and direction, in this order, alone.

`table_error`
    ``n, positions[n], errors[n]`` of the forward direction, then the same of the reverse direction. Positions ascend
    strictly, n >= 1; between them the error is linear, beyond them it is that of the nearest point.

`growth_error`
    The temperature at which there is none, and mm for each degree; the temperature is the only input.

`network_error`
    ``low, high, pitch, touch, unit`` (mm), then the long-range network, then the cyclic one, each as
    ``n, weights[n], biases_forward[n], biases_reverse[n], layer_weights[n], bias``. Inputs and outputs of both are in
    ``unit``. The position is held in low .. high; the cyclic network sees it modulo ``pitch``, and a position at most
    ``touch`` below a multiple of the pitch counts as that multiple (input 0): the cyclic network is not continuous
    there, and rounding would choose the side. A network of n = 0 neurons gives its bias; the pitch is above zero.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from rtec._jit import helper, kernel
from rtec.link._frame_kernels import MOST_AXES

POSITION, DIRECTION, VELOCITY, TIME = 0, 1, 2, 3
"""Places of what the PC senses of its own axis: mm, +1 or -1, mm/s, and its clock in s."""
AXES = 4
"""Place of the position of axis 1 in mm; those of the others follow."""
TEMPERATURES, MOST_TEMPERATURES = AXES + MOST_AXES, 8
"""Place of the first temperature in degrees Celsius."""
SENSORS = TEMPERATURES + MOST_TEMPERATURES

NETWORK_HEAD = 5
"""Numbers in front of the first network."""


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


@kernel
def no_error(
    numbers: npt.NDArray[np.float64],
    inputs: npt.NDArray[np.float64],
    memory: npt.NDArray[np.float64],
    sd: npt.NDArray[np.float64],
) -> float:
    """Return zero everywhere."""
    return 0.0


@kernel
def table_error(
    numbers: npt.NDArray[np.float64],
    inputs: npt.NDArray[np.float64],
    memory: npt.NDArray[np.float64],
    sd: npt.NDArray[np.float64],
) -> float:
    """Return the error of a table, linear between its points."""
    n = int(numbers[0])
    if inputs[1] >= 0.0:
        return float(_interpolate(numbers, 1, n, inputs[0]))
    reverse = 1 + 2 * n
    return float(_interpolate(numbers, reverse + 1, int(numbers[reverse]), inputs[0]))


@kernel
def network_error(
    numbers: npt.NDArray[np.float64],
    inputs: npt.NDArray[np.float64],
    memory: npt.NDArray[np.float64],
    sd: npt.NDArray[np.float64],
) -> float:
    """Return the error of a pair of sigmoid networks, long-range and cyclic."""
    held_mm = min(max(inputs[0], numbers[0]), numbers[1])
    direction = 1 if inputs[1] >= 0.0 else -1
    pitch_mm = numbers[2]
    phase_mm = held_mm - pitch_mm * math.floor(held_mm / pitch_mm)
    if pitch_mm - phase_mm <= numbers[3] or phase_mm < 0.0:
        phase_mm = 0.0
    unit_mm = numbers[4]
    cyclic = NETWORK_HEAD + 4 * int(numbers[NETWORK_HEAD]) + 2
    long_range = _network(numbers, NETWORK_HEAD, held_mm / unit_mm, direction)
    return float((long_range + _network(numbers, cyclic, phase_mm / unit_mm, direction)) * unit_mm)


@kernel
def growth_error(
    numbers: npt.NDArray[np.float64],
    inputs: npt.NDArray[np.float64],
    memory: npt.NDArray[np.float64],
    sd: npt.NDArray[np.float64],
) -> float:
    """Return how far an axis has grown that grows in proportion to its temperature."""
    return float(numbers[1] * (inputs[0] - numbers[0]))


@helper
def error_at(curve: Any, x_mm: float, direction: int) -> float:
    """Return the error (actual minus target, mm) of a curve at ``x_mm``, held outside its range."""
    function, numbers, _, _, _, inputs, memory, sd = curve
    inputs[0] = x_mm
    inputs[1] = direction
    return float(function(numbers, inputs, memory[0], sd))


@helper
def believed_mm(model: Any, sensors: npt.NDArray[np.float64], place: int) -> float:
    """Return the error that a model sees in what the sensors say; no number outside what it was trained for.

    ``model`` is the function with its numbers, where among the sensors its inputs come from, the lowest and highest
    value of each that it knows, room for the inputs, and a memory and room for a standard deviation for each
    ``place`` at which it is at work.
    """
    function, numbers, wanted, low, high, inputs, memory, sd = model
    sd[place] = math.nan
    for k in range(wanted.size):
        inputs[k] = sensors[wanted[k]]
        if not low[k] <= inputs[k] <= high[k]:  # as it does not where nothing was read
            return math.nan
    return float(function(numbers, inputs, memory[place], sd[place : place + 1]))


@kernel
def errors_along(
    curve: Any,
    x_mm: npt.NDArray[np.float64],
    direction: npt.NDArray[np.int64],
    error_mm: npt.NDArray[np.float64],
) -> None:
    """Write the error of a curve at each position, approached in each direction, into ``error_mm``."""
    for i in range(x_mm.size):
        error_mm[i] = error_at(curve, x_mm[i], direction[i])
