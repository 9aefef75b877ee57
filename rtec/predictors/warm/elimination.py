"""Exact inference in a discrete Bayesian network: in which order the nodes are summed over."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.warm._bayes_kernels import FACTORS, HEAD, SCOPE, least_weight, posteriors

MOST_ROOM = 1 << 24
"""Numbers that the results of all steps may take."""


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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tables:
    """States, families and tables of a network as plans of all targets hold them.

    Parameters
    ----------
    numbers
        A plan without a target and an order.
    states
        Of each node.
    scopes
        On which nodes each family depends, shape (nodes, nodes).
    """

    numbers: Floats
    states: Floats
    scopes: npt.NDArray[np.bool_]

    @classmethod
    def of(
        cls,
        states: Sequence[int],
        families: Sequence[tuple[int, ...]],
        tables: Sequence[Floats],
        order: Sequence[int],
    ) -> Tables:
        """Lay them out.

        Parameters
        ----------
        states
            Of each node.
        families
            Nodes that the table of each node depends on, as its axes stand, the node itself last.
        tables
            Conditional probabilities, an axis for each node of the family.
        order
            All nodes, causes before their effects.
        """
        nodes = len(states)
        scopes = np.zeros((nodes, nodes), dtype=np.bool_)
        places: list[int] = []
        told: list[int] = []
        begin = HEAD + 3 * nodes - 1
        end = begin + sum(2 + 2 * len(family) for family in families)
        for node in order:
            family = families[node]
            scopes[node, list(family)] = True
            places.append(begin + len(told))
            told += [end, len(family)]
            stride = tables[node].size
            for i in family:
                stride //= states[i]
                told += [i, stride]
            end += tables[node].size
        head = [nodes, 0, 0, *states, *places, *([0] * (nodes - 1)), *told]
        numbers = np.concatenate([head, *(tables[node].ravel() for node in order)])
        return cls(numbers=numbers, states=np.array(states, dtype=np.float64), scopes=scopes)

    def plan(self, target: int) -> Plan:
        """Return the plan for a target.

        Raises
        ------
        ArgumentError
            The results of the steps would be too large.

        Notes
        -----
        Nodes are summed over in the order of least weight, which is found without any evidence. When the plan is
        carried out, what is observed is no variable any more, and what the target does not depend on is left out:
        each result depends on some of the nodes that it depends on without evidence, and never on others.

        References
        ----------
        Koller and Friedman 2009, sections 9.3 and 9.4.3; 3.3 for what does not matter.
        """
        nodes = self.states.size
        scopes = np.zeros((2 * nodes, nodes), dtype=np.bool_)
        scopes[:nodes] = self.scopes
        numbers, found = self.numbers.copy(), np.empty(2)
        order = numbers[HEAD + 2 * nodes : HEAD + 3 * nodes - 1]
        least_weight(self.states, scopes, target, np.empty(nodes), order, found)
        if found[1] > MOST_ROOM:
            allowed = f"fewer states, or nodes with fewer parents: at most {MOST_ROOM:g} numbers between the steps"
            raise ArgumentError("network", f"{nodes} nodes of up to {int(self.states.max())} states", allowed)
        width = max(int(found[0]), int(self.scopes.sum(axis=1).max()))
        numbers[1], numbers[2] = target, width
        room = (FACTORS + 2 * (SCOPE + 2 * width)) * nodes + int(found[1])
        return Plan(numbers=numbers, room=room, states=int(self.states[target]))
