"""Models of warm machines as compiled models: lags brought up to the time of the inputs, then one regressor's answer.

One kernel for each kind of regressor, so that the loops that call a model by its address stay compiled.
"""

from __future__ import annotations

from typing import Any

from rtec._jit import helper, kernel, step, written_out
from rtec.predictors._columns import Floats
from rtec.predictors.warm._bayes_kernels import bayes_answer
from rtec.predictors.warm._bayes_lssvm_kernels import bayes_ls_svm_answer
from rtec.predictors.warm._feature_kernels import followed
from rtec.predictors.warm._fuzzy_kernels import fuzzy_answer
from rtec.predictors.warm._linear_kernels import linear_answer
from rtec.predictors.warm._lssvm_kernels import ls_svm_answer

MM_OF_UNIT, MM_OF_SD, LEAST_SD, FEATURES, TOLD, SEEN_AT_ONCE = range(6)
"""Places in the numbers: mm of deviation in a unit of the output (negative where the sign is), mm in a unit of its
standard deviation (0: it is not said), the least of it in the unit, how many features, how many of them lag and are
told at the first reading, and by how many. Behind: the features, four numbers each, the places of those that tell and
that are told, the numbers of these (`rtec.predictors.warm.begin`), then those of the regressor."""
NUMBERS_HEAD = 6
PLACE, LAG, POWER, HELD = range(4)
"""Of a feature: the input, its time constant in s, the power of its heat (0: none), whether it is held."""
FEATURE_NUMBERS = 4
BEGIN_HEAD = 3
"""Of a feature that is told, before its slopes: its lowest and highest value, and a constant."""
SEEN, LAST_S = range(2)
MEMORY_HEAD = 2
"""Before the values at the last time, the states behind them, and the room of the regressor."""
TIME = 0
"""Input that is the clock in s; the others follow."""


@helper
def follow_inputs(numbers: Floats, inputs: Floats, memory: Floats) -> None:
    """Bring the states in the memory up to the time of the inputs; at the first reading they begin.

    A clock that goes back stands still.
    """
    count = int(numbers[FEATURES])
    passed_s = max(inputs[TIME] - memory[LAST_S], 0.0)
    for k in range(count):
        at = NUMBERS_HEAD + FEATURE_NUMBERS * k
        value = inputs[int(numbers[at + PLACE])]
        if numbers[at + POWER] > 0.0:
            value = heat_of(value, numbers[at + POWER])
        before, state = MEMORY_HEAD + k, MEMORY_HEAD + count + k
        if memory[SEEN] == 0.0 or numbers[at + LAG] == 0.0:
            memory[state] = value
        else:
            passed = passed_s / numbers[at + LAG]
            memory[state] = followed(memory[state], memory[before], value, passed, numbers[at + HELD] > 0.0)
        memory[before] = value
    if memory[SEEN] == 0.0:
        begin_states(numbers, memory[MEMORY_HEAD + count : MEMORY_HEAD + 2 * count])
    memory[LAST_S] = inputs[TIME] if memory[SEEN] == 0.0 else memory[LAST_S] + passed_s
    memory[SEEN] = 1.0


@helper
def begin_states(numbers: Floats, states: Floats) -> None:
    """Let what lags begin as temperatures tell it; it is in balance, and stays so where nothing is told."""
    told, seen = int(numbers[TOLD]), int(numbers[SEEN_AT_ONCE])
    places = NUMBERS_HEAD + FEATURE_NUMBERS * int(numbers[FEATURES])
    for row in range(told):
        at = places + seen + told + row * (BEGIN_HEAD + seen)
        state = numbers[at + 2]
        for k in range(seen):
            state += numbers[at + BEGIN_HEAD + k] * states[int(numbers[places + k])]
        states[int(numbers[places + seen + row])] = min(max(state, numbers[at]), numbers[at + 1])


@helper
def regressor_at(numbers: Floats) -> int:
    """Return where the numbers of the regressor begin."""
    told, seen = int(numbers[TOLD]), int(numbers[SEEN_AT_ONCE])
    return NUMBERS_HEAD + FEATURE_NUMBERS * int(numbers[FEATURES]) + seen + told * (1 + BEGIN_HEAD + seen)


@step
def heat_of(rpm: float, power: float) -> float:
    """Return the heat of a bearing, 1 at 1000 rpm."""
    return float((abs(rpm) / 1000.0) ** power)


@written_out
def answered(regressor: Any, numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the deviation in mm that a regressor answers; its standard deviation in mm stands in ``sd`` then."""
    follow_inputs(numbers, inputs, memory)
    count = int(numbers[FEATURES])
    own = numbers[regressor_at(numbers) :]
    columns, room = memory[MEMORY_HEAD + count : MEMORY_HEAD + 2 * count], memory[MEMORY_HEAD + 2 * count :]
    answer = regressor(own, columns, room, sd)
    sd[0] = numbers[MM_OF_SD] * max(sd[0], numbers[LEAST_SD])
    return float(numbers[MM_OF_UNIT] * answer)


@kernel
def warm_linear(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the deviation in mm that a linear function predicts."""
    return answered(linear_answer, numbers, inputs, memory, sd)


@kernel
def warm_ls_svm(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the deviation in mm that an LS-SVM predicts."""
    return answered(ls_svm_answer, numbers, inputs, memory, sd)


@kernel
def warm_bayes(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the deviation in mm that a Bayesian network predicts."""
    return answered(bayes_answer, numbers, inputs, memory, sd)


@kernel
def warm_fuzzy(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the deviation in mm that a fuzzy network predicts."""
    return answered(fuzzy_answer, numbers, inputs, memory, sd)


@kernel
def warm_bayes_ls_svm(numbers: Floats, inputs: Floats, memory: Floats, sd: Floats) -> float:
    """Return the deviation in mm that LS-SVMs predict, weighted by a Bayesian network."""
    return answered(bayes_ls_svm_answer, numbers, inputs, memory, sd)
