"""Discrete Bayesian networks: causes and effects with counted states, and exact answers from whatever is observed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from graphlib import CycleError, TopologicalSorter

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError, nearest, unknown
from rtec.predictors._columns import Floats
from rtec.predictors.warm._bayes_kernels import UNKNOWN
from rtec.predictors.warm.elimination import Plan, Tables

MOST_CELLS = 1 << 22
"""Of the table of one node: its states times those of all its parents."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """A variable with a number of states.

    Parameters
    ----------
    name
        Of the variable.
    states
        How many: 0 to states - 1.
    parents
        Names of its causes.
    """

    name: str
    states: int
    parents: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Posterior:
    """What a network says of one node.

    Parameters
    ----------
    probabilities
        Of its states, shape (states,).
    unseen
        Nodes for which no row had the observed states together with those of their parents: of the node that is asked
        for and its effects. There the prior answers.
    """

    probabilities: Floats
    unseen: tuple[str, ...] = ()

    @property
    def mode(self) -> int:
        """The most probable state (Yao et al., equations 11 and 12); the first of those that are equal."""
        return int(np.argmax(self.probabilities))

    def mean(self, values: npt.ArrayLike) -> float:
        """Return the mean of a quantity that has a value, or a mean, in each state, shape (states,)."""
        return float(self.probabilities @ np.asarray(values, dtype=np.float64))

    def sd(self, values: npt.ArrayLike, variances: npt.ArrayLike = 0.0) -> float:
        """Return its standard deviation; ``variances`` are those within the states, shape (states,)."""
        beside = np.asarray(values, dtype=np.float64) - self.mean(values)
        return math.sqrt(self.probabilities @ (beside * beside + np.asarray(variances)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BayesNetwork:
    """A directed acyclic graph of nodes with counted states.

    Parameters
    ----------
    nodes
        In any order.
    counts
        How many rows had each state: of each node an array, an axis for each parent as the node names them, the last
        for the node itself.
    prior
        What is added to each count (Dirichlet prior); above 0.

    Raises
    ------
    ArgumentError
        Names that repeat, a parent that is no node, causes that run in a circle, counts of another shape or below 0.

    Notes
    -----
    Probability of state k below the states j of the parents: ``(prior + N_jk) / sum_k (prior + N_jk)``. Equation 10
    of the paper lacks the sum, so that it equals 1 as printed.

    References
    ----------
    Yao et al. 2013, section 3.3, equations 8 to 12. Heckerman, Bayesian networks for data mining (1997).

    Examples
    --------
    >>> nodes = (Node(name="speed", states=2), Node(name="warm", states=2, parents=("speed",)))
    >>> rows = [[0, 0], [0, 0], [1, 1], [1, 1], [1, 0]]
    >>> network = BayesNetwork.learn(nodes, rows)
    >>> network.posterior("warm", {"speed": 1}).probabilities.tolist()
    [0.4, 0.6]
    >>> network.posterior("speed", {"warm": 1}).probabilities.round(3).tolist()
    [0.238, 0.762]
    """

    nodes: tuple[Node, ...]
    counts: tuple[Floats, ...]
    prior: float = 1.0
    families: tuple[tuple[int, ...], ...] = field(init=False, repr=False)
    """Of each node the places of its parents, then its own."""
    _places: dict[str, int] = field(init=False, repr=False)
    _tables: list[Tables] = field(default_factory=list, init=False, repr=False)
    _plans: dict[int, Plan] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "families", families_of(self.nodes))
        object.__setattr__(self, "_places", {node.name: i for i, node in enumerate(self.nodes)})
        if not 0.0 < self.prior < math.inf:
            raise ArgumentError("prior", self.prior, "a finite number above 0")
        if len(self.counts) != len(self.nodes):
            raise ArgumentError("counts", f"{len(self.counts)} tables", f"{len(self.nodes)}, one for each node")
        tables = []
        for node, family, given in zip(self.nodes, self.families, self.counts, strict=True):
            table, shape = np.array(given, dtype=np.float64), tuple(self.nodes[i].states for i in family)
            if table.shape != shape or not (np.isfinite(table) & (table >= 0.0)).all():
                found = f"an array of shape {table.shape}"
                raise ArgumentError(f"counts of {node.name}", found, f"counts from 0, shape {shape}")
            table.setflags(write=False)
            tables.append(table)
        object.__setattr__(self, "counts", tuple(tables))

    @classmethod
    def learn(cls, nodes: Sequence[Node], rows: npt.ArrayLike, prior: float = 1.0) -> BayesNetwork:
        """Count rows of states, shape (rows, nodes), in the order of the nodes.

        Raises
        ------
        ArgumentError
            A graph that cannot be, or rows that do not fit it.
        """
        nodes = tuple(nodes)
        families = families_of(nodes)
        states = np.asarray(rows)
        if states.ndim != 2 or states.shape[1] != len(nodes) or not np.issubdtype(states.dtype, np.integer):
            found = f"an array of {states.dtype}, shape {states.shape}"
            raise ArgumentError("rows", found, f"whole numbers, {len(nodes)} in each row")
        for node, values in zip(nodes, states.T, strict=True):
            if values.size and not 0 <= values.min() <= values.max() < node.states:
                found = f"{values.min()} to {values.max()}"
                raise ArgumentError(f"rows, {node.name}", found, f"states from 0 to {node.states - 1}")
        tables = []
        for family in families:
            shape = tuple(nodes[i].states for i in family)
            cells = np.zeros(len(states), dtype=np.int64)
            for i in family:
                cells = cells * nodes[i].states + states[:, i]
            tables.append(np.bincount(cells, minlength=math.prod(shape)).reshape(shape).astype(np.float64))
        return cls(nodes=nodes, counts=tuple(tables), prior=prior)

    @property
    def parameters(self) -> int:
        """How many probabilities are free."""
        return sum(
            table.size - table.size // node.states for node, table in zip(self.nodes, self.counts, strict=True)
        )

    def place(self, name: str) -> int:
        """Return where a node stands.

        Raises
        ------
        ArgumentError
            No node has this name.
        """
        if name not in self._places:
            raise unknown("node", name, self._places)
        return self._places[name]

    def probabilities(self, name: str) -> Floats:
        """Return the table of a node: an axis for each parent, the last for the node itself."""
        filled = self.counts[self.place(name)] + self.prior
        table: Floats = filled / filled.sum(axis=-1, keepdims=True)
        return table

    def posterior(self, target: str, evidence: Mapping[str, int] | None = None) -> Posterior:
        """Return what the network says of a node, given the states of others.

        Raises
        ------
        ArgumentError
            An unknown node, or a state that the node does not have.
        """
        goal = self.place(target)
        observed = self._observed(evidence or {})
        known, observed[goal] = observed[goal], UNKNOWN
        unseen = self.unseen(goal, observed)
        if known == UNKNOWN:
            probabilities = self.plan(target).posteriors(observed[None])[0]
        else:
            probabilities = np.zeros(self.nodes[goal].states)
            probabilities[int(known)] = 1.0
        return Posterior(probabilities=probabilities, unseen=unseen)

    def plan(self, target: str) -> Plan:
        """Return how to get the probabilities of a node, made once and kept."""
        goal = self.place(target)
        if goal not in self._plans:
            if not self._tables:
                self._tables.append(self._laid_out())
            self._plans[goal] = self._tables[0].plan(goal)
        return self._plans[goal]

    def _laid_out(self) -> Tables:
        causes = TopologicalSorter({family[-1]: family[:-1] for family in self.families})
        states, tables = [node.states for node in self.nodes], [self.probabilities(node.name) for node in self.nodes]
        return Tables.of(states, self.families, tables, tuple(causes.static_order()))

    def unseen(self, target: int, observed: Floats) -> tuple[str, ...]:
        """Return the nodes, the target or an effect of it, for which no row had what is observed.

        ``observed`` are states, shape (nodes,), -1 where a node is not observed.
        """
        found = []
        for family, counts in zip(self.families, self.counts, strict=True):
            if target in family:
                cells = tuple(slice(None) if observed[i] == UNKNOWN else int(observed[i]) for i in family)
                if not counts[cells].any():
                    found.append(self.nodes[family[-1]].name)
        return tuple(found)

    def _observed(self, evidence: Mapping[str, int]) -> Floats:
        observed = np.full(len(self.nodes), UNKNOWN)
        for name, state in evidence.items():
            i = self.place(name)
            if not (isinstance(state, int | np.integer) and 0 <= state < self.nodes[i].states):
                raise ArgumentError(f"evidence of {name}", state, f"a state from 0 to {self.nodes[i].states - 1}")
            observed[i] = state
        return observed


def families_of(nodes: Sequence[Node]) -> tuple[tuple[int, ...], ...]:
    """Return the places of the parents of each node, and behind them its own.

    Raises
    ------
    ArgumentError
        No nodes, names that repeat, a parent that is no node, a node without states, tables that are too large, or
        causes that run in a circle.
    """
    places = {node.name: i for i, node in enumerate(nodes)}
    if len(places) != len(nodes) or not nodes:
        raise ArgumentError(
            "nodes", ", ".join(node.name for node in nodes)[:60] or "no node", "one or more, each once"
        )
    families = []
    for i, node in enumerate(nodes):
        if node.states < 1:
            raise ArgumentError(f"states of {node.name}", node.states, "1 or more")
        for parent in node.parents:
            if parent not in places:
                raise ArgumentError(f"parents of {node.name}", parent, "a node", nearest(parent, places))
        if len(set(node.parents)) != len(node.parents):
            raise ArgumentError(f"parents of {node.name}", ", ".join(node.parents)[:60], "each cause once")
        families.append((*(places[parent] for parent in node.parents), i))
        cells = math.prod(nodes[k].states for k in families[-1])
        if cells > MOST_CELLS:
            found = f"{len(node.parents)} with {cells // node.states} combinations of states"
            raise ArgumentError(f"parents of {node.name}", found, f"fewer: a table of at most {MOST_CELLS} cells")
    try:
        TopologicalSorter({node.name: node.parents for node in nodes}).prepare()
    except CycleError as problem:
        circle = " -> ".join(problem.args[1])
        raise ArgumentError("network", circle[:80], "causes that do not run in a circle") from None
    return tuple(families)
