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
    scope: tuple[int, ...]
    kind: int
    place: int

    def numbers(self, states: Sequence[int]) -> list[float]:
        """As a step holds it."""
        return [self.kind, *_dependence(self.place, self.scope, states)]


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
    places = np.cumsum([HEAD + len(states), *(table.size for table in tables)])
    live = [_Factor(family, FACTOR_TABLE, int(place)) for family, place in zip(families, places, strict=False)]
    steps: list[float] = []
    room = 2 * len(states)
    order = [*_least_weight(states, families, target), NOTHING]
    for summed in order:
        used = [factor for factor in live if summed in (*factor.scope, NOTHING)]
        scope = tuple(sorted({i for factor in used for i in factor.scope} - {summed}))
        result = _Factor(scope, FACTOR_RESULT, room + 1)
        room += 1 + math.prod(states[i] for i in scope)
        if room > MOST_ROOM:
            allowed = f"fewer states, or nodes with fewer parents: at most {MOST_ROOM:g} numbers between the steps"
            raise ArgumentError("network", f"{len(states)} nodes of up to {max(states)} states", allowed)
        steps += [summed, *_dependence(result.place, scope, states), len(used)]
        steps += [number for factor in used for number in factor.numbers(states)]
        live = [factor for factor in live if factor not in used] + [result]
    head = [len(states), len(order), int(places[-1]), *states]
    numbers = np.concatenate([head, *(table.ravel() for table in tables), steps])
    return Plan(numbers=numbers, room=room, states=states[target])


def _dependence(place: int, scope: tuple[int, ...], states: Sequence[int]) -> list[float]:
    """Return the place of a table, on how many nodes it depends, and each of these with its stride."""
    strides = [math.prod(states[i] for i in scope[k + 1 :]) for k in range(len(scope))]
    return [place, len(scope), *(number for pair in zip(scope, strides, strict=True) for number in pair)]


def _least_weight(states: Sequence[int], families: Sequence[tuple[int, ...]], target: int) -> list[int]:
    """Return all nodes but the target, the one whose sum leaves the smallest table first."""
    scopes = [set(family) for family in families]
    left, order = set(range(len(states))) - {target}, []
    weights: dict[int, float] = {}
    while left:
        for i in left - weights.keys():
            joined = set().union(*(scope for scope in scopes if i in scope))
            weights[i] = math.prod(states[j] for j in joined)
        summed = min(left, key=lambda i: (weights[i], i))
        joined = set().union(*(scope for scope in scopes if summed in scope)) - {summed}
        scopes = [scope for scope in scopes if summed not in scope] + [joined]
        left.remove(summed)
        order.append(summed)
        for i in joined:
            weights.pop(i, None)
    return order
