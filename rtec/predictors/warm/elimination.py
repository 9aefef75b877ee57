"""Exact inference in a discrete Bayesian network: in which order the nodes are summed over."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.warm._bayes_kernels import FACTOR_RESULT, FACTOR_TABLE, HEAD, posteriors

MOST_ROOM = 1 << 24
"""Numbers that the results of all steps may take."""
NOTHING = -1
"""What the last step sums over: it multiplies all that is left."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """How to get the probabilities of one node, whatever else is observed.

    Parameters
    ----------
    numbers
        As the kernel takes them (`_bayes_kernels`).
    room
        How many numbers of scratch room it needs.
    states
        Of the target.
    """

    numbers: Floats
    room: int
    states: int

    def posteriors(self, observed: Floats) -> Floats:
        """Return the probabilities of the target, shape (rows, states), of observed states, shape (rows, nodes).

        A state of -1 is not observed; the target must not be.
        """
        found = np.empty((len(observed), self.states))
        posteriors(self.numbers, observed, np.empty(self.room), found)
        return found


class _Factor(NamedTuple):
    """A table: the nodes it depends on, and as a step tells it (place, number of nodes, each with its stride)."""

    scope: set[int]
    kind: int
    told: list[int]
    size: int


def _factor(kind: int, place: int, scope: Sequence[int], states: Sequence[int]) -> _Factor:
    told, stride = [], 1
    for i in reversed(scope):
        told += [stride, i]
        stride *= states[i]
    return _Factor(set(scope), kind, [place, len(scope), *reversed(told)], stride)


def plan_of(
    states: Sequence[int], families: Sequence[tuple[int, ...]], tables: Sequence[Floats], target: int
) -> Plan:
    """Return the plan for a target.

    Parameters
    ----------
    states
        Of each node.
    families
        Nodes that the table of each node depends on, as its axes stand.
    tables
        Conditional probabilities, an axis for each node of the family.
    target
        Whose probabilities are asked for.

    Raises
    ------
    ArgumentError
        The tables between the steps would be too large.

    Notes
    -----
    Variables are eliminated in the order of least weight: next comes the node whose sum leaves the smallest table.
    The steps are those without any evidence. What is observed counts as one state when the plan is carried out, so
    that tables shrink and never grow.

    References
    ----------
    Koller and Friedman, Probabilistic Graphical Models (2009), sections 9.3 and 9.4.3.
    """
    live, end = [], HEAD + len(states)
    for family in families:
        live.append(_factor(FACTOR_TABLE, end, family, states))
        end += live[-1].size
    order = [*_least_weight(states, [factor.scope for factor in live], target), NOTHING]
    steps: list[int] = []
    room = 2 * len(states)
    for summed in order:
        used = [factor for factor in live if summed in factor.scope] if summed != NOTHING else live
        scope = set().union(*(factor.scope for factor in used)) - {summed}
        result = _factor(FACTOR_RESULT, room + 1, sorted(scope), states)
        room += 1 + result.size
        if room > MOST_ROOM:
            allowed = f"fewer states, or nodes with fewer parents: at most {MOST_ROOM:g} numbers between the steps"
            raise ArgumentError("network", f"{len(states)} nodes of up to {max(states)} states", allowed)
        steps += [summed, *result.told, len(used)]
        for factor in used:
            steps += [factor.kind, *factor.told]
        live = [factor for factor in live if summed not in factor.scope] + [result]
    head = [len(states), len(order), end, *states]
    numbers = np.concatenate([head, *(table.ravel() for table in tables), steps])
    return Plan(numbers=numbers, room=room, states=states[target])


def _least_weight(states: Sequence[int], scopes: Sequence[set[int]], target: int) -> list[int]:
    """Return all nodes but the target, the one whose sum leaves the smallest table first."""
    left, order = set(range(len(states))) - {target}, []
    weights: dict[int, int] = {}
    joined: dict[int, set[int]] = {}
    while left:
        for i in left - weights.keys():
            joined[i] = set().union(*(scope for scope in scopes if i in scope))
            weights[i] = math.prod([states[j] for j in joined[i]])
        summed = min(left, key=lambda i: (weights[i], i))
        scope = joined[summed] - {summed}
        scopes = [*(one for one in scopes if summed not in one), scope]
        left.remove(summed)
        order.append(summed)
        for i in scope:
            weights.pop(i, None)
    return order
