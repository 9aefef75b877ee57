"""A Bayesian network as a function of features: columns cut into states, a displacement from their probabilities."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.warm import _bayes_kernels as kernels, _plain
from rtec.predictors.warm.bayes_network import BayesNetwork, Node, Posterior, families_of
from rtec.predictors.warm.causes import OUTPUT


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BayesRegressor:
    """A network whose nodes are features, cut into states, and an output with a mean and a variance in each state.

    A column that is not finite is not observed: the others answer.

    Parameters
    ----------
    network
        Nodes in the order of the features, then ``output``.
    cuts
        Of each feature where it is cut, ascending: a value that lies above k of them is in state k.
    means, variances
        Of the output within each of its states, shape (states,).

    Raises
    ------
    ArgumentError
        Nodes, cuts or means that do not fit each other, or a number that is not finite.

    Notes
    -----
    With the probabilities p of the output's states, the answer is ``sum p m`` and its variance
    ``sum p (v + (m - answer) ** 2)``. Where no row had the observed states, p is the prior: the answer is near the
    mean of all rows and its standard deviation wide (`unseen` says so).

    References
    ----------
    Yao et al. 2013, section 3.3, equations 8 to 12.

    Examples
    --------
    >>> nodes = (Node(name="warm", states=2), Node(name="output", states=2, parents=("warm",)))
    >>> network = BayesNetwork.learn(nodes, [[0, 0]] * 8 + [[1, 1]] * 8)
    >>> machine = BayesRegressor(network=network, cuts=([25.0],), means=[0.0, 20.0], variances=[1.0, 1.0])
    >>> machine.predict(np.array([[20.0], [30.0], [np.nan]]))[0].round(6).tolist()
    [2.0, 18.0, 10.0]
    """

    kind: ClassVar[str] = "bayes"

    network: BayesNetwork
    cuts: tuple[Floats, ...]
    means: Floats
    variances: Floats
    numbers: Floats = field(init=False, repr=False)
    """What the compiled function computes with; its layout stands in ``_bayes_kernels.py``."""
    room: int = field(init=False, repr=False)

    def __post_init__(self) -> None:
        *nodes, output = self.network.nodes
        if output.name != OUTPUT or not nodes:
            raise ArgumentError("network", f"{output.name} as the last node", f"features, then {OUTPUT}")
        if len(self.cuts) != len(nodes):
            raise ArgumentError("cuts", f"those of {len(self.cuts)} features", f"those of {len(nodes)}")
        object.__setattr__(self, "cuts", tuple(np.asarray(one, dtype=np.float64) for one in self.cuts))
        for node, cuts in zip(nodes, self.cuts, strict=True):
            if cuts.shape != (node.states - 1,) or not np.isfinite(cuts).all() or (np.diff(cuts) <= 0.0).any():
                found = f"an array of shape {cuts.shape}"
                raise ArgumentError(f"cuts of {node.name}", found, f"{node.states - 1} finite numbers that ascend")
        for name in ("means", "variances"):
            values = np.asarray(getattr(self, name), dtype=np.float64)
            if values.shape != (output.states,) or not np.isfinite(values).all():
                raise ArgumentError(name, f"an array of shape {values.shape}", f"{output.states} finite numbers")
            object.__setattr__(self, name, values)
        if (self.variances < 0.0).any():
            raise ArgumentError("variances", float(self.variances.min()), "numbers from 0")
        plan = self.network.plan(OUTPUT)
        cut = [np.concatenate([[one.size], one]) for one in self.cuts]
        head = [len(nodes), output.states, 3 + sum(one.size for one in cut) + 2 * output.states]
        object.__setattr__(self, "numbers", np.concatenate([head, *cut, self.means, self.variances, plan.numbers]))
        object.__setattr__(self, "room", plan.room)

    @property
    def parameters(self) -> int:
        """Free probabilities and the means of the output's states."""
        return self.network.parameters + self.means.size

    @property
    def names(self) -> tuple[str, ...]:
        """Of the features."""
        return tuple(node.name for node in self.network.nodes[:-1])

    @property
    def function(self) -> Callable[..., float]:
        """Compiled, for one row."""
        found: Callable[..., float] = kernels.bayes_answer
        return found

    def predict(self, columns: Floats) -> tuple[Floats, Floats]:
        """Return posterior mean and standard deviation, shape (rows,) each, of columns, shape (rows, features)."""
        columns = self._checked(columns)
        found, sd = np.empty(len(columns)), np.empty(len(columns))
        kernels.bayes_answers(self.numbers, columns, np.empty(self.room), found, sd)
        return found, sd

    def weights(self, columns: Floats) -> Floats:
        """Return the probabilities of the output's states, shape (rows, states)."""
        states = self._states(self._checked(columns))
        observed = np.pad(states, ((0, 0), (0, 1)), constant_values=kernels.UNKNOWN)
        return self.network.plan(OUTPUT).posteriors(observed)

    def posterior(self, row: npt.ArrayLike) -> Posterior:
        """Return the probabilities of the output's states for one row, shape (features,): the most probable, too."""
        states = self._states(self._checked(np.asarray(row, dtype=np.float64)[None]))[0]
        observed = {name: int(state) for name, state in zip(self.names, states, strict=True) if state >= 0.0}
        return self.network.posterior(OUTPUT, observed)

    def unseen(self, columns: Floats) -> npt.NDArray[np.bool_]:
        """Return where no row of the training had the observed states of the output's causes, shape (rows,)."""
        states = self._states(self._checked(columns))
        target = len(self.names)
        different, which = np.unique(states, axis=0, return_inverse=True)
        observed = np.column_stack([different, np.full(len(different), kernels.UNKNOWN)])
        found = np.array([bool(self.network.unseen(target, one)) for one in observed])
        return found[which.ravel()]

    def moved(self, row: npt.ArrayLike) -> tuple[tuple[str, float], ...]:
        """Return by how much each observed feature moves the answer against leaving it out, the largest first.

        Parameters
        ----------
        row
            One row of columns, shape (features,).

        Returns
        -------
        tuple
            Name of the feature, and the change of the posterior mean: that of all observed features less that without
            this one. Of what the observed causes of the output already say, it is exactly 0.
        """
        seen = self._checked(np.asarray(row, dtype=np.float64)[None])
        without = np.repeat(seen, len(self.names), axis=0)
        np.fill_diagonal(without, np.nan)
        changes = self.predict(seen)[0] - self.predict(without)[0]
        found = [(name, float(changes[k])) for k, name in enumerate(self.names) if math.isfinite(seen[0, k])]
        return tuple(sorted(found, key=lambda one: -abs(one[1])))

    def _checked(self, columns: Floats) -> Floats:
        found = np.ascontiguousarray(columns, dtype=np.float64)
        if found.ndim != 2 or found.shape[1] != len(self.names):
            raise ArgumentError("columns", f"an array of shape {found.shape}", f"rows of {len(self.names)} features")
        return found

    def _states(self, columns: Floats) -> Floats:
        found = np.empty(columns.shape)
        for k, cuts in enumerate(self.cuts):
            found[:, k] = np.where(np.isfinite(columns[:, k]), np.searchsorted(cuts, columns[:, k]), kernels.UNKNOWN)
        return found

    @property
    def plain(self) -> _plain.Plain:
        """All that `of` needs to build the same function again; parents are places of nodes, the output's last."""
        families = self.network.families
        return {
            "names": list(self.names),
            "states": [node.states for node in self.network.nodes],
            "cuts": np.concatenate(self.cuts).tolist(),
            "causes": [len(family) - 1 for family in families],
            "parents": [i for family in families for i in family[:-1]],
            "counts": np.concatenate([table.ravel() for table in self.network.counts]).tolist(),
            "prior": float(self.network.prior),
            "means": self.means.tolist(),
            "variances": self.variances.tolist(),
        }

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> BayesRegressor:
        """Build the function from plain data.

        Raises
        ------
        ArgumentError
            A value is missing, no number, or of another length.
        """
        nodes = _nodes(plain)
        shapes = [tuple(nodes[i].states for i in family) for family in families_of(nodes)]
        sizes = [math.prod(shape) for shape in shapes]
        counts = np.split(_plain.array(plain, "counts", sum(sizes)), np.cumsum(sizes)[:-1])
        tables = [table.reshape(shape) for shape, table in zip(shapes, counts, strict=True)]
        many = [node.states - 1 for node in nodes[:-1]]
        network = BayesNetwork(nodes=nodes, counts=tuple(tables), prior=_plain.number(plain, "prior", above=0.0))
        return cls(
            network=network,
            cuts=tuple(np.split(_plain.array(plain, "cuts", sum(many)), np.cumsum(many)[:-1])),
            means=_plain.array(plain, "means", nodes[-1].states),
            variances=_plain.array(plain, "variances", nodes[-1].states),
        )


def _nodes(plain: Mapping[str, Any]) -> tuple[Node, ...]:
    names = (*_plain.names(plain, "names"), OUTPUT)
    states, causes = (_plain.whole(plain, key, len(names)) for key in ("states", "causes"))
    if min(causes) < 0:
        raise ArgumentError("causes", min(causes), "numbers of parents from 0")
    parents = _plain.whole(plain, "parents", sum(causes))
    if parents and not 0 <= min(parents) <= max(parents) < len(names):
        found = f"{min(parents)} to {max(parents)}"
        raise ArgumentError("parents", found, f"places of nodes, 0 to {len(names) - 1}")
    ends = np.cumsum([0, *causes]).tolist()
    return tuple(
        Node(name=name, states=states[k], parents=tuple(names[i] for i in parents[ends[k] : ends[k + 1]]))
        for k, name in enumerate(names)
    )
