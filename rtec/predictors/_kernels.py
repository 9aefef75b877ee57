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

`cubic_error`
    ``n, positions[n], errors[n], slopes[n]`` of the forward direction, then the same of the reverse direction: a
    cubic between two points that has their errors and slopes.

`layered_error`
    ``low, high`` (mm) in which the first input is held, ``pitch, touch`` (mm), the number of networks, the most
    neurons of a layer rounded up to a multiple of EIGHT, and room for twice as many, which the function writes into;
    then each network, whose outputs are added: ``inputs, hidden layers, neurons of each``; for each input ``place,
    kind, middle, half``; weights and biases layer by layer as `rtec.predictors.fitting.layers` has them; ``bias,
    factor`` of the output in mm. An input of kind PLAIN is what stands at its place less the middle, divided by the
    half; before that, a SIGN is 0 forward and 1 in reverse, a TURN the position within a turn of the screw in mm. A
    position at most ``touch`` below a multiple of the pitch counts as that multiple: a network need not be continuous
    there, and rounding would choose the side.
    A HELD is held within the half of the middle.

`tables_error`
    ``low, high`` (mm) in which the first input is held, the number of tables; then each table, which are added:
    ``place, direction, arm, arm_low, arm_high, n, positions[n], values[n]``. A table is linear between its points,
    held beyond them, and counts in its direction alone, in both where that is 0. An arm is the place of another
    input, held within its ends: the value is multiplied by how far it is from their middle; -1: none.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from rtec._jit import fused_kernel, fused_step, helper, kernel, step, summing_helper
from rtec.link._frame_kernels import MOST_AXES
from rtec.predictors._columns import Floats
from rtec.predictors._logistic_kernels import logistic

POSITION, DIRECTION, VELOCITY, TIME = 0, 1, 2, 3
"""Places of what the PC senses of its own axis: mm, +1 or -1, mm/s, and its clock in s."""
AXES = 4
"""Place of the position of axis 1 in mm; those of the others follow."""
SENSORS = AXES + MOST_AXES
"""Number of places that every PC has; those of heat follow, as many as there are (`rtec.heat._heat_kernels`)."""
SD, SAID, OUTSIDE = 8, 9, 10
"""Places in a bound model: room for a standard deviation, for what sensors of heat say, and for the input outside."""
INSIDE = -1
"""In the room for the input outside: none is."""

NINETY = 1.6448536269514722
"""Standard deviations in half an interval of 90 %."""
PLAIN, SIGN, TURN, HELD = 0, 1, 2, 3
"""Kinds of inputs of a layered network."""
LAYERED_HEAD = 6
"""Numbers in front of the room of layered networks."""
EIGHT = 8
"""Neurons that answer at once; those beyond the last of a layer answer, too, to nobody."""
MOST_NEURONS = 64
"""In a layer."""
TABLE_HEAD = 6
"""Numbers in front of the positions of a table in a sum."""
MOST_TABLES = 1000
"""In a sum."""


@helper
def _segment(par: Floats, first: int, n: int, x_mm: float) -> int:
    """Return the index of the last of ``n`` ascending positions, from index ``first`` on, that is not above ``x_mm``.

    Of positions within the table; the last one belongs to the segment before it.
    """
    below = first
    above = first + n - 1
    while above - below > 1:
        middle = (below + above) // 2
        if par[middle] <= x_mm:
            below = middle
        else:
            above = middle
    return below


@helper
def _interpolate(par: Floats, first: int, n: int, x_mm: float) -> float:
    """Return the error of the table whose positions start at index ``first``."""
    if x_mm <= par[first]:
        return par[first + n]
    last = first + n - 1
    if x_mm >= par[last]:
        return par[last + n]
    below = _segment(par, first, n, x_mm)
    above = below + 1
    share = (x_mm - par[below]) / (par[above] - par[below])
    return (1.0 - share) * par[below + n] + share * par[above + n]


@helper
def _cubic(par: Floats, first: int, n: int, x_mm: float) -> float:
    """Return the error of the table of cubics whose positions start at index ``first``."""
    last = first + n - 1
    if x_mm <= par[first]:
        return par[first + n]
    if x_mm >= par[last]:
        return par[last + n]
    k = _segment(par, first, n, x_mm)
    width = par[k + 1] - par[k]
    t = (x_mm - par[k]) / width
    left, right = par[k + n], par[k + n + 1]
    rise = right - left
    rising, falling = par[k + 2 * n] * width, par[k + 2 * n + 1] * width
    return left + t * (rising + t * (3.0 * rise - 2.0 * rising - falling + t * (rising + falling - 2.0 * rise)))


@summing_helper
def _product(left: Floats, right: Floats) -> float:
    """Return the sum of products of two columns."""
    total = 0.0
    for i in range(left.size):
        total += left[i] * right[i]
    return total


@helper
def within_turn(position_mm: float, pitch_mm: float, touch_mm: float) -> float:
    """Return the position within a turn of the screw, from 0 on; just below a whole turn it is 0."""
    phase_mm = position_mm - pitch_mm * math.floor(position_mm / pitch_mm)
    return 0.0 if pitch_mm - phase_mm <= touch_mm or phase_mm < 0.0 else phase_mm


@kernel
def no_error(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return zero everywhere."""
    return 0.0


@kernel
def table_error(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the error of a table, linear between its points."""
    n = int(numbers[0])
    if inputs[1] >= 0.0:
        return float(_interpolate(numbers, 1, n, inputs[0]))
    reverse = 1 + 2 * n
    return float(_interpolate(numbers, reverse + 1, int(numbers[reverse]), inputs[0]))


@kernel
def cubic_error(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the error of a table, cubic between its points."""
    n = int(numbers[0])
    if inputs[1] >= 0.0:
        return float(_cubic(numbers, 1, n, inputs[0]))
    reverse = 1 + 3 * n
    return float(_cubic(numbers, reverse + 1, int(numbers[reverse]), inputs[0]))


@fused_step
def input_value(value: float, kind: int, middle: float, half: float, first_mm: float, pitch_mm: float) -> float:
    """Return an input of a network as it is trained: what kind of input it is stands with it."""
    if kind == SIGN:
        value = 0.0 if value >= 0.0 else 1.0
    elif kind == TURN:
        value = within_turn(value, first_mm, pitch_mm)
    elif kind == HELD:
        value = min(max(value, middle - half), middle + half)
    return (value - middle) / half


@fused_kernel
def layered_error(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the sum of networks of logistic neurons."""
    held_mm = min(max(inputs[0], numbers[0]), numbers[1])
    most = int(numbers[5])
    at = LAYERED_HEAD + 2 * most
    total = 0.0
    for _ in range(int(numbers[4])):
        seen, given = LAYERED_HEAD, LAYERED_HEAD + most
        before = int(numbers[at])
        layers = int(numbers[at + 1])
        widths = at + 2
        at = widths + layers
        for i in range(before):
            place = int(numbers[at])
            value = held_mm if place == 0 else inputs[place]
            kind, middle, half = int(numbers[at + 1]), numbers[at + 2], numbers[at + 3]
            numbers[seen + i] = input_value(value, kind, middle, half, numbers[2], numbers[3])
            at += 4
        for layer in range(layers):
            after = int(numbers[widths + layer])
            level = numbers[given : given + EIGHT * ((after + EIGHT - 1) // EIGHT)]
            # slices: of their indices the compiler knows that they are not negative
            biases = numbers[at + before * after : at + (before + 1) * after]
            for j in range(after):
                level[j] = biases[j]
            for i in range(before):
                one = numbers[seen + i]
                weight = numbers[at : at + after]
                for j in range(after):
                    level[j] += one * weight[j]
                at += after
            for j in range(level.size):
                level[j] = logistic(level[j])
            at += after
            before = after
            seen, given = given, seen
        output = numbers[at + before] + _product(numbers[seen : seen + before], numbers[at : at + before])
        at += before + 1
        total += numbers[at] + numbers[at + 1] * output
        at += 2
    return total


@kernel
def tables_error(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the sum of tables of the positions of several axes."""
    held_mm = min(max(inputs[0], numbers[0]), numbers[1])
    at = 3
    total = 0.0
    for _ in range(int(numbers[2])):
        n = int(numbers[at + 5])
        if numbers[at + 1] == 0.0 or (numbers[at + 1] > 0.0) == (inputs[1] >= 0.0):
            place = int(numbers[at])
            value = _interpolate(numbers, at + TABLE_HEAD, n, held_mm if place == 0 else inputs[place])
            arm = int(numbers[at + 2])
            if arm >= 0:
                low_mm, high_mm = numbers[at + 3], numbers[at + 4]
                out_mm = min(max(held_mm if arm == 0 else inputs[arm], low_mm), high_mm)
                value *= out_mm - 0.5 * (low_mm + high_mm)
            total += value
        at += TABLE_HEAD + 2 * n
    return total


@kernel
def growth_error(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return how far an axis has grown that grows in proportion to its temperature."""
    return float(numbers[1] * (inputs[0] - numbers[0]))


@helper
def sure_of(error_mm: float, unsure_mm: float) -> float:
    """Return the end of the interval about an error that is nearer to zero; zero where the interval holds it."""
    if error_mm > unsure_mm:
        return error_mm - unsure_mm
    if error_mm < -unsure_mm:
        return error_mm + unsure_mm
    return 0.0 if abs(error_mm) <= unsure_mm else error_mm


@step
def error_at(curve: Any, x_mm: float, direction: int) -> float:
    """Return the error (actual minus target, mm) of a curve at ``x_mm``, held outside its range."""
    function, numbers, _, _, _, inputs, memory, unsure_mm, sd, _, _ = curve
    inputs[0] = x_mm
    inputs[1] = direction
    return sure_of(float(function(numbers, inputs, memory, sd)), unsure_mm)


@step
def predicted_mm(model: Any, sensors: Floats) -> float:
    """Return the error that a model sees in what the sensors say; no number outside what it was trained for.

    A model that says how unsure it is is followed to the near end of its 90 % interval.

    Where it has no answer although its axis stands where it knows it and no sensor is lost, it notes which input is
    outside its range, or the number of its inputs where all are inside.

    ``model`` is the function with its numbers, where among the sensors its inputs come from, the lowest and highest
    value of each that it knows, room for the inputs, its memory, by how much it may be off, room for a standard
    deviation, what sensors of heat said last, and room for the input outside.
    """
    function, numbers, wanted, low, high, inputs, memory, unsure_mm, sd, said, outside = model
    sd[0] = math.nan
    outside[0] = INSIDE
    answers, lost = True, False
    for k in range(wanted.size):
        at = wanted[k]
        inputs[k] = sensors[at] if at < SENSORS else said[at - SENSORS]
        if low[k] <= inputs[k] <= high[k]:
            continue
        answers = False
        if at == POSITION or math.isnan(inputs[k]):
            lost = True
        elif outside[0] == INSIDE:
            outside[0] = k
    if lost:
        outside[0] = INSIDE
    if not answers:
        return math.nan
    error_mm = float(function(numbers, inputs, memory, sd))
    if math.isnan(error_mm):
        outside[0] = wanted.size
    if sd[0] > 0.0:  # not so where the model has not said it
        unsure_mm = max(unsure_mm, NINETY * sd[0])
    return sure_of(error_mm, unsure_mm)


@kernel
def errors_along(
    curve: Any, x_mm: Floats, direction: npt.NDArray[np.int64], others_mm: Floats, error_mm: Floats
) -> None:
    """Write the error at each position, approached in each direction, into ``error_mm``.

    ``others_mm`` are further inputs, shape (inputs, positions).
    """
    for i in range(x_mm.size):
        for k in range(others_mm.shape[0]):
            curve[5][2 + k] = others_mm[k, i]  # the room for inputs
        error_mm[i] = error_at(curve, x_mm[i], direction[i])
