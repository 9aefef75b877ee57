"""A NARX network sample by sample: output, and slopes of the output over all weights.

Everything is scaled. ``inputs`` has shape (samples, channels), ``measured`` and ``output`` shape (samples,). What a
neuron sees at sample t are the taps: first inputs, ``taps[i] = (channel, delay)``, then outputs before t by
``back[k]`` samples, which rise. A stretch ``(first, end)`` is predicted from ``first`` on; its memory begins with
measured outputs.

``hidden`` has shape (taps + 1, EIGHT * n): a column for each neuron, the biases last, zeros behind the last neuron;
``outer`` has as many numbers and the bias of the output behind them; ``direct`` one for each tap.

A row of slopes stands in the order of the weights: taps and bias of the neurons ``[tap, neuron]``, the output's
weight of each neuron, its bias, then those of the direct terms, where there are any.
"""

from __future__ import annotations

from typing import Any

from rtec._jit import fused_helper, fused_kernel, summing_helper
from rtec.predictors._columns import Floats
from rtec.predictors._logistic_kernels import logistic

EIGHT = 8
"""Neurons that the processor computes at once."""
FARTHEST = 1e3
"""A scaled output beyond it has diverged: what was measured lies from -1 to 1."""


@summing_helper
def _product(a: Floats, b: Floats, size: int) -> float:
    total = 0.0
    for j in range(size):
        total += a[j] * b[j]
    return total


@fused_helper
def _respond(seen: Floats, hidden: Floats, outer: Floats, direct: Floats, level: Floats) -> float:
    """Return the output for taps that are seen, and write the level of each neuron."""
    taps, wide = seen.shape[0], level.shape[0]
    for j in range(wide):
        level[j] = hidden[taps, j]
    for i in range(taps):
        one = seen[i]
        for j in range(wide):
            level[j] += one * hidden[i, j]
    for j in range(wide):
        level[j] = 2.0 * logistic(2.0 * level[j]) - 1.0
    return float(_product(outer, level, wide) + outer[wide] + _product(direct, seen, direct.shape[0]))


@fused_helper
def _look(t: int, inputs: Floats, past: Floats, taps: Any, back: Any, seen: Floats) -> None:
    for i in range(taps.shape[0]):
        seen[i] = inputs[t - taps[i, 1], taps[i, 0]]
    for k in range(back.shape[0]):
        seen[taps.shape[0] + k] = past[t - back[k]]


@fused_kernel
def one_step(
    inputs: Floats,
    past: Floats,
    taps: Any,
    back: Any,
    hidden: Floats,
    outer: Floats,
    direct: Floats,
    seen: Floats,
    level: Floats,
) -> float:
    """Return the output of the last of ``lags + 1`` inputs, from the ``lags`` outputs before it."""
    _look(past.shape[0], inputs, past, taps, back, seen)
    return _respond(seen, hidden, outer, direct, level)


@fused_kernel
def predict(
    stretches: Any,
    inputs: Floats,
    measured: Floats,
    output: Floats,
    closed: bool,
    taps: Any,
    back: Any,
    hidden: Floats,
    outer: Floats,
    direct: Floats,
    seen: Floats,
    level: Floats,
) -> float:
    """Write the outputs of all stretches; return the sum of squared errors, infinite where one diverged.

    With ``closed`` the network sees its own outputs, else those that were measured.
    """
    lags = back[-1]
    squares = 0.0
    for stretch in range(stretches.shape[0]):
        first = stretches[stretch, 0]
        for t in range(first - lags, first):
            output[t] = measured[t]
        for t in range(first, stretches[stretch, 1]):
            _look(t, inputs, output if closed else measured, taps, back, seen)
            found = _respond(seen, hidden, outer, direct, level)
            if not abs(found) < FARTHEST:
                return float("inf")
            output[t] = found
            squares += (found - measured[t]) ** 2
    return squares


@fused_helper
def _own_slopes(
    row: Floats, seen: Floats, level: Floats, outer: Floats, rise: Floats, neurons: int, directs: int
) -> None:
    """Write the slopes of an output over the weights, its past held; and over what each neuron is given, ``rise``."""
    taps = seen.shape[0]
    after = (taps + 1) * neurons
    for j in range(level.shape[0]):
        rise[j] = outer[j] * (1.0 - level[j] * level[j])
    for i in range(taps):
        one = seen[i]
        for j in range(neurons):
            row[i * neurons + j] = one * rise[j]
    for j in range(neurons):
        row[taps * neurons + j] = rise[j]
        row[after + j] = level[j]
    row[after + neurons] = 1.0
    for i in range(directs):
        row[after + neurons + 1 + i] = seen[i]


@fused_helper
def _through(tap: int, rise: Floats, hidden: Floats, direct: Floats) -> float:
    """Return the slope of the output over a tap."""
    return float(_product(rise, hidden[tap], rise.shape[0]) + (direct[tap] if direct.shape[0] > 0 else 0.0))


@fused_helper
def _carry(row: Floats, before: Floats, share: float) -> None:
    for p in range(row.shape[0]):
        row[p] += share * before[p]


@fused_kernel
def slopes(
    cursor: Any,
    stretches: Any,
    inputs: Floats,
    measured: Floats,
    output: Floats,
    closed: bool,
    rise: Floats,
    rows: Floats,
    error: Floats,
    neurons: int,
    taps: Any,
    back: Any,
    hidden: Floats,
    outer: Floats,
    direct: Floats,
    seen: Floats,
    level: Floats,
) -> int:
    """Write rows of slopes and their errors from where the cursor stands; return how many, negative if it diverged.

    The cursor is (stretch, sample). The first rows, as many as the longest delay, are those of the samples before;
    the caller moves them there. An output's slopes are its own, with its past held; those of a closed network are
    these and ``d output / d past output * slopes of the past output`` of each output that it sees.
    """
    lags = back[-1]
    past = output if closed else measured
    inner = taps.shape[0]
    room = rows.shape[0] - lags
    used = 0
    while cursor[0] < stretches.shape[0] and used < room:
        first, end = stretches[cursor[0], 0], stretches[cursor[0], 1]
        if cursor[1] <= first:
            cursor[1] = first
            for t in range(first - lags, first):
                output[t] = measured[t]
        here = cursor[1]
        until = min(end, here + room - used)
        for t in range(here, until):
            _look(t, inputs, past, taps, back, seen)
            found = _respond(seen, hidden, outer, direct, level)
            if not abs(found) < FARTHEST:
                return -1
            output[t] = found
            error[used] = found - measured[t]
            row = rows[lags + used]
            _own_slopes(row, seen, level, outer, rise, neurons, direct.shape[0])
            if closed:
                for k in range(back.shape[0]):
                    if t - back[k] >= first:
                        _carry(row, rows[lags + used - back[k]], _through(inner + k, rise, hidden, direct))
            used += 1
        cursor[1] = until
        if until == end:
            cursor[0] += 1
            cursor[1] = 0
    return used
