"""A network of logistic neurons in plain Python: loops over neurons, and slopes by a complex step.

The weights are numbered as the documentation of the fitting room has it: layer by layer, input by input, biases last.
A step of 1e-30 along the imaginary axis gives a slope without a difference of large numbers, so to the last digit.
"""

from __future__ import annotations

import cmath
from collections.abc import Sequence

_STEP = 1e-30


def output(hidden: Sequence[int], weights: Sequence[complex], inputs: Sequence[float]) -> complex:
    """Return the output for one row of inputs."""
    seen = [complex(value) for value in inputs]
    at = 0
    for number, neurons in enumerate([*hidden, 1]):
        given = []
        for neuron in range(neurons):
            total = weights[at + len(seen) * neurons + neuron]
            for place, value in enumerate(seen):
                total += weights[at + place * neurons + neuron] * value
            given.append(total)
        at += (len(seen) + 1) * neurons
        seen = given if number == len(hidden) else [1.0 / (1.0 + cmath.exp(-value)) for value in given]
    return seen[0]


def slopes(hidden: Sequence[int], weights: Sequence[float], inputs: Sequence[float]) -> list[float]:
    """Return the slope of the output over each weight."""
    found = []
    for number in range(len(weights)):
        moved = [complex(weight) for weight in weights]
        moved[number] += 1j * _STEP
        found.append(output(hidden, moved, inputs).imag / _STEP)
    return found
