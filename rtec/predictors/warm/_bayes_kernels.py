"""Compiled Bayesian networks: elimination of variables along a plan, and what one row of a machine says.

A plan (`rtec.predictors.warm.elimination`) is one array: nodes, steps, the place of the first step, the states of
each node, the tables of the nodes, the steps. A step holds the node that it sums over (-1: none), then its result: a
place, how many nodes it depends on, each of them with its stride; then how many factors it multiplies, each with its
kind (0 a table of the plan, 1 the result of a step), place, nodes and strides. Places of tables count from the
beginning of the plan, those of results from the beginning of the room.

The room begins with the observed state of each node (-1: none), then the state that is looked at, then the results.
In front of each result stands its largest number, by which it is divided wherever it is read: the product of many
small probabilities stays above zero.

The numbers of a regressor: features, states of the output, place of the plan; for each feature the number of its
cuts and the cuts, which ascend; means and variances of the output in each state; the plan, whose nodes are the
features and last the output.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from rtec._jit import helper, kernel, step
from rtec.predictors._columns import Floats

UNKNOWN = -1.0
"""State of what is not observed."""
FACTOR_TABLE, FACTOR_RESULT = 0, 1
HEAD = 3
"""Numbers before the states of a plan."""


@step
def placed(plan: Floats, p: int, nodes: int, room: Floats) -> int:
    """Return the place, for the states that are looked at, in a table that is described at ``p``."""
    place = plan[p]
    first = p + 2
    for k in range(first, first + 2 * int(plan[p + 1]), 2):
        place += plan[k + 1] * room[nodes + int(plan[k])]
    return int(place)


@step
def product(plan: Floats, begin: int, p: int, nodes: int, room: Floats) -> float:
    """Return the product of factors, whose number stands at ``p``, for the states that are looked at."""
    found = 1.0
    count = int(plan[p])
    p += 1
    for _ in range(count):
        place = placed(plan, p + 1, nodes, room)
        if plan[p] == FACTOR_TABLE:
            found *= plan[begin + place]
        else:
            found *= room[place] / room[int(plan[p + 1]) - 1]
        p += 3 + 2 * int(plan[p + 2])
    return found


@step
def advance(plan: Floats, states: int, p: int, nodes: int, room: Floats) -> bool:
    """Go on to the next states of the nodes of a table that is described at ``p``; false after the last ones."""
    for k in range(p + 2 * int(plan[p + 1]), p + 1, -2):
        i = int(plan[k])
        if room[i] < 0.0:
            room[nodes + i] += 1.0
            if room[nodes + i] < plan[states + i]:
                return True
            room[nodes + i] = 0.0
    return False


@helper
def eliminate(plan: Floats, begin: int, room: Floats) -> int:
    """Carry out the steps of a plan that stands at ``begin``; return the place of the last result in the room."""
    nodes, states = int(plan[begin]), begin + HEAD
    p = begin + int(plan[begin + 2])
    for i in range(nodes):
        room[nodes + i] = max(room[i], 0.0)
    result = 0
    for _ in range(int(plan[begin + 1])):
        summed, result = int(plan[p]), int(plan[p + 1])
        factors = p + 3 + 2 * int(plan[p + 2])
        hidden = summed >= 0 and room[summed] < 0.0
        count = int(plan[states + summed]) if hidden else 1
        largest = 0.0
        more = True
        while more:
            total = 0.0
            for x in range(count):
                if hidden:
                    room[nodes + summed] = x
                total += product(plan, begin, factors, nodes, room)
            room[placed(plan, p + 1, nodes, room)] = total
            largest = max(largest, total)
            more = advance(plan, states, p + 1, nodes, room)
        room[result - 1] = largest
        p = factors + 1
        for _ in range(int(plan[factors])):
            p += 3 + 2 * int(plan[p + 2])
    return result


@kernel
def posteriors(plan: Floats, observed: Floats, room: Floats, found: Floats) -> None:
    """Write the probabilities of the target of a plan, shape (rows, states), for rows of observed states."""
    nodes = observed.shape[1]
    for row in range(observed.shape[0]):
        for i in range(nodes):
            room[i] = observed[row, i]
        result = eliminate(plan, 0, room)
        total = 0.0
        for k in range(found.shape[1]):
            total += room[result + k]
        for k in range(found.shape[1]):
            found[row, k] = room[result + k] / total


@step
def state_of(value: float, numbers: Floats, first: int, cuts: int) -> float:
    """Return how many cuts a value lies above; UNKNOWN where it is not finite."""
    if not math.isfinite(value):
        return UNKNOWN
    low, high = 0, cuts
    while low < high:
        middle = (low + high) // 2
        if value > numbers[first + middle]:
            low = middle + 1
        else:
            high = middle
    return float(low)


@helper
def observe(numbers: Floats, columns: Floats, room: Floats) -> None:
    """Write the states of a row's columns into the room; the output's is not known."""
    features = int(numbers[0])
    p = 3
    for i in range(features):
        cuts = int(numbers[p])
        room[i] = state_of(columns[i], numbers, p + 1, cuts)
        p += 1 + cuts
    room[features] = UNKNOWN


@kernel
def bayes_answer(numbers: Floats, columns: Floats, room: Floats, sd: Floats) -> float:
    """Return the posterior mean of the output for a row of columns, and write its standard deviation."""
    observe(numbers, columns, room)
    states, plan = int(numbers[1]), int(numbers[2])
    result = eliminate(numbers, plan, room)
    means, variances = plan - 2 * states, plan - states
    total = mean = 0.0
    for k in range(states):
        total += room[result + k]
        mean += room[result + k] * numbers[means + k]
    mean /= total
    variance = 0.0
    for k in range(states):
        beside = numbers[means + k] - mean
        variance += room[result + k] / total * (numbers[variances + k] + beside * beside)
    sd[0] = math.sqrt(variance)
    return mean


@kernel
def bayes_answers(numbers: Floats, columns: Floats, room: Floats, found: Floats, sd: Floats) -> None:
    """Write answers and standard deviations for rows of columns."""
    one = sd[:0]
    for row in range(columns.shape[0]):
        one = sd[row : row + 1]
        found[row] = bayes_answer(numbers, columns[row], room, one)


@kernel
def states_of(values: Floats, cuts: Floats, found: npt.NDArray[np.int64]) -> None:
    """Write how many cuts each value lies above."""
    for row in range(values.size):
        found[row] = int(state_of(values[row], cuts, 0, cuts.size))
