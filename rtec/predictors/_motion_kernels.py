"""A NARX network as a compiled model: stepped at its sample time, from the velocity that the PC reads."""

from __future__ import annotations

import math

from rtec._jit import helper, kernel
from rtec.predictors._columns import Floats

PERIOD, SCALE, SPEED_AT, ACCELERATION_AT, CHANNELS, INNER, BACK, NEURONS, LINEAR, LAGS = range(10)
"""Places in the numbers: s, mm of a unit of the output, channel of each (-1: none), then the shape. Behind: delays of
the inputs, of the output, middles and halves (inputs, then the output), and weights as `rtec.predictors.narx` has
them."""
NUMBERS_HEAD = 10
SEEN, LAST_S, LAST_SPEED = range(3)
MEMORY_HEAD = 3
"""Before the delay lines in the memory: ``lags + 1`` inputs of each channel, ``lags`` outputs, the latest last."""
MOST_MISSED = 1000
"""Steps that are made at once: more, and the memory is that of a rest."""
VELOCITY, TIME = 0, 1


@helper
def _seen(numbers: Floats, memory: Floats, tap: int, outputs: int) -> float:
    """Return what a tap sees: those of the inputs come first, channel by channel, then those of the output."""
    inner, lags = int(numbers[INNER]), int(numbers[LAGS])
    if tap < inner * int(numbers[CHANNELS]):
        delay = int(numbers[NUMBERS_HEAD + tap % inner])
        return float(memory[MEMORY_HEAD + (tap // inner) * (lags + 1) + lags - delay])
    back = int(numbers[NUMBERS_HEAD + inner + tap - inner * int(numbers[CHANNELS])])
    return float(memory[outputs + lags - back])


@helper
def _respond(numbers: Floats, memory: Floats, weights: int, outputs: int) -> float:
    """Return the next output, scaled; the weights begin at ``weights``, the outputs before at ``outputs``."""
    taps = int(numbers[INNER]) * int(numbers[CHANNELS]) + int(numbers[BACK])
    neurons = int(numbers[NEURONS])
    outer = weights + (taps + 1) * neurons
    total = numbers[outer + neurons]
    if numbers[LINEAR] > 0.0:
        for tap in range(taps):
            total += numbers[outer + neurons + 1 + tap] * _seen(numbers, memory, tap, outputs)
    for j in range(neurons):
        level = numbers[weights + taps * neurons + j]
        for tap in range(taps):
            level += _seen(numbers, memory, tap, outputs) * numbers[weights + tap * neurons + j]
        total += numbers[outer + j] * math.tanh(level)
    return float(total)


@kernel
def motion_error(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the deviation in mm that a network predicts, its memory brought up to the time of the inputs."""
    channels, lags = int(numbers[CHANNELS]), int(numbers[LAGS])
    middle = NUMBERS_HEAD + int(numbers[INNER]) + int(numbers[BACK])
    half = middle + channels + 1
    outputs = MEMORY_HEAD + channels * (lags + 1)
    period, speed = numbers[PERIOD], inputs[VELOCITY]
    steps = int(math.floor((inputs[TIME] - memory[LAST_S]) / period + 0.5))
    if memory[SEEN] == 0.0 or steps > MOST_MISSED:
        for k in range(channels):
            first = speed if k == int(numbers[SPEED_AT]) else 0.0
            for i in range(lags + 1):
                memory[MEMORY_HEAD + k * (lags + 1) + i] = (first - numbers[middle + k]) / numbers[half + k]
        for i in range(lags):
            memory[outputs + i] = -numbers[middle + channels] / numbers[half + channels]
        memory[SEEN], memory[LAST_S], memory[LAST_SPEED] = 1.0, inputs[TIME], speed
        return 0.0
    if steps > 0:
        acceleration = (speed - memory[LAST_SPEED]) / (steps * period)
        for step in range(1, steps + 1):
            between = memory[LAST_SPEED] + step * period * acceleration
            for k in range(channels):
                value = between if k == int(numbers[SPEED_AT]) else acceleration
                line = MEMORY_HEAD + k * (lags + 1)
                for i in range(lags):
                    memory[line + i] = memory[line + i + 1]
                memory[line + lags] = (value - numbers[middle + k]) / numbers[half + k]
            later = _respond(numbers, memory, half + channels + 1, outputs)
            for i in range(lags - 1):
                memory[outputs + i] = memory[outputs + i + 1]
            memory[outputs + lags - 1] = later
        memory[LAST_S] += steps * period
        memory[LAST_SPEED] = speed
    scaled = memory[outputs + lags - 1]
    return float(numbers[SCALE] * (scaled * numbers[half + channels] + numbers[middle + channels]))
