"""Compiled: what a Bayesian network says of rows whose block is taken out of its counts."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rtec._jit import helper, kernel
from rtec.predictors._columns import Floats

Places = npt.NDArray[np.int64]


@helper
def count_rows(
    first: int, end: int, step: float, cells: Places, strides: Places, states: Places, counts: Floats
) -> None:
    """Add ``step`` to the cell of each row in the table of each family."""
    for row in range(first, end):
        for f in range(strides.size):
            counts[cells[f, row] + strides[f] * states[row]] += step


@helper
def weigh(row: int, cells: Places, strides: Places, own: Places, sizes: Places, counts: Floats, prior: float,
          weights: Floats) -> None:  # fmt: skip
    """Write the product of the probabilities of all families for each state of the output, the largest first 1."""
    weights[:] = 1.0
    for f in range(strides.size):
        largest = 0.0
        for k in range(weights.size):
            cell = cells[f, row] + k * strides[f]
            total = 1.0  # of the output's own family it is the same for all its states
            if sizes[f] > 0:
                total = sizes[f] * prior
                beside = cell - own[f, row]
                for other in range(beside, beside + sizes[f]):
                    total += counts[other]
            weights[k] *= (prior + counts[cell]) / total
            largest = max(largest, weights[k])
        weights /= largest


@kernel
def answers_left_out(
    starts: Places,
    cells: Places,
    strides: Places,
    own: Places,
    sizes: Places,
    counts: Floats,
    prior: float,
    states: Places,
    output: Floats,
    sums: Floats,
    weights: Floats,
    found: Floats,
) -> None:
    """Write what the other blocks say of each row; leave the counts as they were.

    Parameters
    ----------
    starts
        First row of each block and the end of the last: the rows of a block stand together.
    cells
        Of each family that the output is in, and each row: the place in ``counts`` where the output's state is 0.
    strides
        Cells from one state of the output to the next, of each family.
    own, sizes
        State in each row, and number of states, of the effect that the family belongs to; 0 of the output's own.
    counts
        Tables of all families, one behind the other, of all rows.
    states, output
        Of each row: the output's state and its value.
    sums
        Room for two rows: number and sum of the output in each of its states.
    """
    sums[:] = 0.0
    for row in range(output.size):
        sums[0, states[row]] += 1.0
        sums[1, states[row]] += output[row]
    for b in range(starts.size - 1):
        first, end = starts[b], starts[b + 1]
        count_rows(first, end, -1.0, cells, strides, states, counts)
        for row in range(first, end):
            sums[0, states[row]] -= 1.0
            sums[1, states[row]] -= output[row]
        middle = np.sum(sums[1]) / np.sum(sums[0])
        for row in range(first, end):
            weigh(row, cells, strides, own, sizes, counts, prior, weights)
            total = answer = 0.0
            for k in range(weights.size):
                total += weights[k]
                answer += weights[k] * (sums[1, k] / sums[0, k] if sums[0, k] > 0.5 else middle)
            found[row] = answer / total
        for row in range(first, end):
            sums[0, states[row]] += 1.0
            sums[1, states[row]] += output[row]
        count_rows(first, end, 1.0, cells, strides, states, counts)
