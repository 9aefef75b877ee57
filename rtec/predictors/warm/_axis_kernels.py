"""Models of a warm axis as compiled models: a cold table, and what heat adds at one or two positions.

The numbers are ``places, at_mm[2], cold_mm[2], table, model, room``: how many positions (1 or 2), where they are,
what the models say where nothing has grown, how many numbers the table and each model have, and how many each model
remembers; then the table, then the models. The inputs are position and direction, then those of the models.

One kernel for each kind of regressor, as in `rtec.predictors.warm._warm_kernels`.
"""

from __future__ import annotations

import math
from typing import Any

from rtec._jit import kernel, written_out
from rtec.predictors._columns import Floats
from rtec.predictors._kernels import table_error
from rtec.predictors.warm._warm_kernels import (
    warm_bayes,
    warm_bayes_ls_svm,
    warm_fuzzy,
    warm_linear,
    warm_ls_svm,
)

PLACES, FIRST_MM, SECOND_MM, FIRST_COLD_MM, SECOND_COLD_MM, TABLE, MODEL, ROOM = range(8)
HEAD = 8


@written_out
def warm_axis(model: Any, numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the deviation in mm: that of the table, and what the models of heat say, on a line through both."""
    table, count, room = int(numbers[TABLE]), int(numbers[MODEL]), int(numbers[ROOM])
    cold_mm = table_error(numbers[HEAD : HEAD + table], inputs[:2], memory, sd)
    at = HEAD + table
    heat = inputs[2:]
    first_mm = model(numbers[at : at + count], heat, memory[:room], sd) - numbers[FIRST_COLD_MM]
    if numbers[PLACES] < 2.0:
        return float(cold_mm + first_mm)
    first_sd = sd[0]
    second_mm = (
        model(numbers[at + count : at + 2 * count], heat, memory[room : 2 * room], sd) - numbers[SECOND_COLD_MM]
    )
    share = (inputs[0] - numbers[FIRST_MM]) / (numbers[SECOND_MM] - numbers[FIRST_MM])
    sd[0] = math.sqrt(((1.0 - share) * first_sd) ** 2 + (share * sd[0]) ** 2)
    return float(cold_mm + (1.0 - share) * first_mm + share * second_mm)


@kernel
def axis_linear(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the deviation in mm by linear functions of heat."""
    return warm_axis(warm_linear, numbers, inputs, memory, sd)


@kernel
def axis_ls_svm(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the deviation in mm by LS-SVMs."""
    return warm_axis(warm_ls_svm, numbers, inputs, memory, sd)


@kernel
def axis_fuzzy(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the deviation in mm by fuzzy networks."""
    return warm_axis(warm_fuzzy, numbers, inputs, memory, sd)


@kernel
def axis_bayes_ls_svm(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the deviation in mm by Bayesian networks that choose among LS-SVMs."""
    return warm_axis(warm_bayes_ls_svm, numbers, inputs, memory, sd)


@kernel
def axis_bayes(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the deviation in mm by Bayesian networks."""
    return warm_axis(warm_bayes, numbers, inputs, memory, sd)
