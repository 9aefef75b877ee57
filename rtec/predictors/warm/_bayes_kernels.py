"""Compiled Bayesian networks: exact inference by elimination of variables, and what one row of a machine says.

A plan (`rtec.predictors.warm.elimination`) is one array: nodes, target, the most nodes that a table depends on; the
states of each node; the place of each family, causes before their effects; the order in which nodes are summed over;
the families; the tables. A family holds the place of its table, how many nodes it depends on, and each of them with
its stride, the node itself last. Places count from the beginning of the plan.

The room begins with the observed state of each node (-1: none), then the state that is looked at, whether the node
matters, whether the target depends on it; the factors that a step multiplies, where each is read, and how far apart
two states of what is summed over are in it; then all factors, then the results of the steps. A factor holds whether
it is live, its kind, its place in the plan or in the room, one over its largest number, how many nodes it depends on,
and each of them with its stride. By its largest number a factor is divided wherever it is read: the product of many
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
HEAD = 3
"""Numbers before the states of a plan."""
MATTERS, REACHED, USED, PLACES, STRIDES, FACTORS = 2, 3, 4, 6, 8, 10
"""Where parts of the room begin, in nodes."""
LIVE, KIND, PLACE, SHARE, WIDTH, SCOPE = range(6)
"""Of a factor."""
TABLE, RESULT = 0.0, 1.0
"""Kinds of a factor."""
NOTHING = -1
"""What the last step sums over."""


@kernel
def least_weight(
    states: Floats, scopes: npt.NDArray[np.bool_], target: int, weights: Floats, order: Floats, found: Floats
) -> None:
    """Write the order in which nodes are summed over: next comes the one whose sum leaves the smallest table.

    Parameters
    ----------
    scopes
        On which nodes each family depends, shape (2 nodes, nodes): room for the results behind them.
    weights
        Room for a number a node.
    found
        The most nodes that a table depends on, and how many numbers all results take.
    """
    nodes = states.size
    weights[:] = 0.0
    weights[target] = np.inf
    found[0], found[1] = 1.0, 0.0
    for one in range(nodes):
        new = nodes + one
        summed = lightest(states, scopes, new, weights) if one < nodes - 1 else NOTHING
        size = joined(states, scopes, summed, new)
        if summed != NOTHING:
            scopes[new, summed] = False
            size /= states[summed]
            weights[summed] = np.inf
            order[one] = summed
        for f in range(new):
            if summed == NOTHING or scopes[f, summed]:
                scopes[f, :] = False
        width = 0
        for i in range(nodes):
            if scopes[new, i]:
                width += 1
                weights[i] = 0.0 if i != target else np.inf  # its factors are others now
        found[0] = max(found[0], width)
        found[1] += size


@helper
def lightest(states: Floats, scopes: npt.NDArray[np.bool_], new: int, weights: Floats) -> int:
    """Return the node whose factors have the smallest product; weights of 0 are not known yet."""
    found = NOTHING
    for i in range(states.size):
        if weights[i] == 0.0:
            weights[i] = joined(states, scopes, i, new)
        if weights[i] < np.inf and (found == NOTHING or weights[i] < weights[found]):
            found = i
    return found


@helper
def joined(states: Floats, scopes: npt.NDArray[np.bool_], summed: int, new: int) -> float:
    """Write on which nodes the product of all factors of a node depends; return the size of its table."""
    scopes[new, :] = False
    size = 1.0
    for f in range(new):
        if summed == NOTHING or scopes[f, summed]:
            for i in range(states.size):
                if scopes[f, i] and not scopes[new, i]:
                    scopes[new, i] = True
                    size *= states[i]
    return size


@step
def placed(room: Floats, q: int, nodes: int) -> int:
    """Return the place in a factor's table for the states that are looked at."""
    place = room[q + PLACE]
    for k in range(q + SCOPE, q + SCOPE + 2 * int(room[q + WIDTH]), 2):
        place += room[k + 1] * room[nodes + int(room[k])]
    return int(place)


@step
def advance(plan: Floats, states: int, room: Floats, q: int, nodes: int) -> bool:
    """Go on to the next states of the nodes of a factor; false after the last ones."""
    for k in range(q + SCOPE, q + SCOPE + 2 * int(room[q + WIDTH]), 2):
        i = int(room[k])
        room[nodes + i] += 1.0
        if room[nodes + i] < plan[states + i]:
            return True
        room[nodes + i] = 0.0
    return False


@helper
def look_at(plan: Floats, begin: int, room: Floats) -> None:
    """Find which nodes matter: the target, what is observed, and all their causes. Others sum to 1."""
    nodes, target = int(plan[begin]), int(plan[begin + 1])
    families, matters = begin + HEAD + nodes, MATTERS * nodes
    for i in range(nodes):
        room[nodes + i] = max(room[i], 0.0)
        room[matters + i] = 1.0 if room[i] >= 0.0 or i == target else 0.0
        room[REACHED * nodes + i] = 1.0 if i == target else 0.0
    for t in range(nodes - 1, -1, -1):
        p = begin + int(plan[families + t])
        own = p + 2 * int(plan[p + 1])
        if room[matters + int(plan[own])] > 0.0:
            for k in range(p + 2, own, 2):
                room[matters + int(plan[k])] = 1.0


@helper
def take_factors(plan: Floats, begin: int, room: Floats) -> int:
    """Write the tables of nodes that matter as factors of what is not observed; return how many."""
    nodes = int(plan[begin])
    families, size = begin + HEAD + nodes, SCOPE + 2 * int(plan[begin + 2])
    count = 0
    for t in range(nodes):
        p = begin + int(plan[families + t])
        own = p + 2 * int(plan[p + 1])
        if room[MATTERS * nodes + int(plan[own])] == 0.0:
            continue
        q = FACTORS * nodes + count * size
        place, width = plan[p] + begin, 0
        for k in range(p + 2, own + 1, 2):
            i = int(plan[k])
            if room[i] >= 0.0:
                place += plan[k + 1] * room[i]
            else:
                room[q + SCOPE + 2 * width] = i
                room[q + SCOPE + 2 * width + 1] = plan[k + 1]
                width += 1
        room[q + LIVE], room[q + KIND], room[q + PLACE], room[q + WIDTH] = 0.0, TABLE, place, width
        largest = 1.0
        if width == 1:  # one of perhaps many effects of a node
            largest = 0.0
            for k in range(int(plan[begin + HEAD + int(room[q + SCOPE])])):
                largest = max(largest, plan[int(place) + k * int(room[q + SCOPE + 1])])
        room[q + SHARE] = 1.0 / largest
        count += 1 if width > 0 else 0
    return count


@helper
def reach(nodes: int, size: int, count: int, room: Floats) -> None:
    """Make live the factors that the target depends on, by whatever chain of nodes that are not observed."""
    more = True
    while more:
        more = False
        for q in range(FACTORS * nodes, FACTORS * nodes + count * size, size):
            end = q + SCOPE + 2 * int(room[q + WIDTH])
            if room[q + LIVE] == 0.0:
                for k in range(q + SCOPE, end, 2):
                    if room[REACHED * nodes + int(room[k])] > 0.0:
                        room[q + LIVE] = 1.0
                        more = True
                if room[q + LIVE] > 0.0:
                    for k in range(q + SCOPE, end, 2):
                        room[REACHED * nodes + int(room[k])] = 1.0


@helper
def gather(plan: Floats, begin: int, room: Floats, summed: int, count: int) -> int:
    """Take the live factors of a node (or all) and write on what their product depends behind the last factor.

    Returns how many they are; they are live no more.
    """
    nodes, size = int(plan[begin]), SCOPE + 2 * int(plan[begin + 2])
    new, used, width = FACTORS * nodes + count * size, 0, 0
    for q in range(FACTORS * nodes, new, size):
        end = q + SCOPE + 2 * int(room[q + WIDTH])
        holds = room[q + LIVE] > 0.0 and summed == NOTHING
        for k in range(q + SCOPE, end, 2):
            holds = holds or (room[q + LIVE] > 0.0 and int(room[k]) == summed)
        if not holds:
            continue
        room[USED * nodes + used] = q
        used += 1
        room[q + LIVE] = 0.0
        for k in range(q + SCOPE, end, 2):
            known = int(room[k]) == summed
            for i in range(new + SCOPE, new + SCOPE + 2 * width, 2):
                known = known or room[i] == room[k]
            if not known:
                room[new + SCOPE + 2 * width] = room[k]
                width += 1
    room[new + LIVE], room[new + KIND], room[new + WIDTH] = 1.0, RESULT, width
    return used


@step
def stride_of(room: Floats, q: int, node: int) -> float:
    """Return how far apart two states of a node are in a factor's table; 0 where it does not depend on it."""
    for k in range(q + SCOPE, q + SCOPE + 2 * int(room[q + WIDTH]), 2):
        if int(room[k]) == node:
            return float(room[k + 1])
    return 0.0


@helper
def multiply(plan: Floats, begin: int, room: Floats, summed: int, used: int, q: int) -> int:
    """Write the product of the factors that are used, summed over a node, as a result; return where it ends."""
    nodes, states = int(plan[begin]), begin + HEAD
    first, places, strides = USED * nodes, PLACES * nodes, STRIDES * nodes
    stride = 1.0
    for k in range(q + SCOPE, q + SCOPE + 2 * int(room[q + WIDTH]), 2):
        room[k + 1] = stride
        stride *= plan[states + int(room[k])]
    for u in range(used):
        room[strides + u] = stride_of(room, int(room[first + u]), summed)
    count = int(plan[states + summed]) if summed != NOTHING else 1
    result = int(room[q + PLACE])
    largest = 0.0
    more = True
    while more:
        for u in range(used):
            room[places + u] = placed(room, int(room[first + u]), nodes)
        total = 0.0
        for x in range(count):
            found = 1.0
            for u in range(used):
                factor, place = int(room[first + u]), int(room[places + u] + x * room[strides + u])
                found *= (plan[place] if room[factor + KIND] == TABLE else room[place]) * room[factor + SHARE]
            total += found
        room[result] = total
        result += 1
        largest = max(largest, total)
        more = advance(plan, states, room, q, nodes)
    room[q + SHARE] = 1.0 / largest
    return result


@helper
def eliminate(plan: Floats, begin: int, room: Floats) -> int:
    """Answer a plan; return where the room holds the probabilities of the target, each times the same number."""
    nodes, size = int(plan[begin]), SCOPE + 2 * int(plan[begin + 2])
    order = begin + HEAD + 2 * nodes
    look_at(plan, begin, room)
    count = take_factors(plan, begin, room)
    reach(nodes, size, count, room)
    end = (FACTORS + 2 * size) * nodes
    q = 0
    for one in range(nodes):
        summed = int(plan[order + one]) if one < nodes - 1 else NOTHING
        if summed != NOTHING and (room[summed] >= 0.0 or room[REACHED * nodes + summed] == 0.0):
            continue
        q = FACTORS * nodes + count * size
        used = gather(plan, begin, room, summed, count)
        room[q + PLACE] = end
        end = multiply(plan, begin, room, summed, used, q)
        count += 1
    return int(room[q + PLACE])


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
