"""What neurons do with all readings at once, between the products of matrices.

Arrays are of shape (neurons, readings) unless a kernel says otherwise.
"""

from __future__ import annotations

from rtec._jit import fused_kernel
from rtec.predictors._columns import Floats
from rtec.predictors._logistic_kernels import logistic


@fused_kernel
def answer(level: Floats) -> None:
    """Turn what neurons are given into their levels, where it stands."""
    for j in range(level.shape[0]):
        for i in range(level.shape[1]):
            level[j, i] = logistic(level[j, i])


@fused_kernel
def through_last(level: Floats, weight: Floats, residual: Floats, out: Floats) -> None:
    """Write the slope over what each neuron is given, of half the sum of squares if the output is off by a residual.

    ``weight`` is that of each neuron in the output, ``residual`` that of each reading; ones give slopes of the
    output.
    """
    for j in range(level.shape[0]):
        for i in range(level.shape[1]):
            out[j, i] = (level[j, i] - level[j, i] * level[j, i]) * (weight[j] * residual[i])


@fused_kernel
def through(level: Floats, out: Floats) -> None:
    """Turn slopes over the levels into those over what the neurons are given, where they stand."""
    for j in range(level.shape[0]):
        for i in range(level.shape[1]):
            out[j, i] *= level[j, i] - level[j, i] * level[j, i]


@fused_kernel
def bend(level: Floats, first: Floats, second: Floats, given: bool) -> None:
    """Turn first and second derivatives of what neurons are given into those of their levels, where they stand.

    Without ``given``, the second derivatives of what they are given are zero.
    """
    for j in range(level.shape[0]):
        for i in range(level.shape[1]):
            slope = level[j, i] - level[j, i] * level[j, i]
            rise = first[j, i]
            turn = second[j, i] if given else 0.0
            first[j, i] = slope * rise
            second[j, i] = slope * (turn + (1.0 - 2.0 * level[j, i]) * rise * rise)


@fused_kernel
def bend_last(
    level: Floats,
    first: Floats,
    second: Floats,
    given: bool,
    weight: Floats,
    change: Floats,
    rise: Floats,
    turn: Floats,
) -> None:
    """Add the neurons' part to first and second derivative of the output, ``rise`` and ``turn`` of each reading.

    As `bend`, for the layer before the output; there, ``weight`` of each neuron changes by ``change``.
    """
    for j in range(level.shape[0]):
        for i in range(level.shape[1]):
            slope = level[j, i] - level[j, i] * level[j, i]
            faster = slope * first[j, i]
            bent = (1.0 - 2.0 * level[j, i]) * first[j, i] * faster + (slope * second[j, i] if given else 0.0)
            rise[i] += change[j] * level[j, i] + weight[j] * faster
            turn[i] += 2.0 * change[j] * faster + weight[j] * bent
