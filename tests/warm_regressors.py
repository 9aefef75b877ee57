"""One regressor of each kind that a file holds, with numbers of some size."""

import numpy as np

from rtec.predictors.warm.bayes import BayesRegressor
from rtec.predictors.warm.bayes_lssvm import BayesLsSvm
from rtec.predictors.warm.bayes_network import BayesNetwork, Node
from rtec.predictors.warm.fuzzy import Fuzzy
from rtec.predictors.warm.linear import Linear
from rtec.predictors.warm.lssvm import LsSvm


def one_of_each(kind, *, features):
    """Return a regressor of a kind for temperatures near 20 and for heat."""
    rng = np.random.default_rng(8)
    return {
        "linear": _linear, "ls-svm": _machine, "fuzzy": _fuzzy, "bayes": _network, "bayes-ls-svm": _both
    }[kind](rng, features)  # fmt: skip


def _linear(rng, features):
    slopes, spread = rng.normal(0.0, 2.0, features), rng.normal(0.0, 0.1, (features, features))
    return Linear(centre=np.full(features, 20.0), intercept=1 / 3, slopes=slopes, noise_sd=0.5, spread=spread)


def _machine(rng, features):
    return LsSvm(
        centre=np.full(features, 20.0),
        per_unit=np.full(features, 0.1),
        width=1.5,
        gamma=50.0,
        points=rng.normal(0.0, 1.0, (30, features)),
        alpha=rng.normal(0.0, 5.0, 30),
        bias=1 / 3,
        noise_sd=2.0,
    )


def _fuzzy(rng, features):
    return Fuzzy(
        centre=np.full(features, 20.0),
        axes=0.1 * rng.normal(0.0, 1.0, (2, features)),
        rules=rng.normal(0.0, 1.0, (4, 2)),
        widths=rng.uniform(1.0, 3.0, (4, 2)),
        consequents=rng.normal(0.0, 5.0, (4, 3)),
        noise_sd=1 / 3,
    )


def _network(rng, features, states=4):
    names = [f"f{k}" for k in range(features)]
    nodes = [Node(name=name, states=3) for name in names]
    nodes.append(Node(name="output", states=states, parents=tuple(names[:2])))
    network = BayesNetwork.learn(tuple(nodes), rng.integers(0, min(states, 3), (40, features + 1)))
    cuts = tuple([18.0, 21.0 + k] for k in range(features))
    return BayesRegressor(
        network=network, cuts=cuts, means=rng.normal(0.0, 9.0, states), variances=[1.0, 2.0, 3.0, 1 / 3][:states]
    )


def _both(rng, features):
    return BayesLsSvm(
        signs=((0, -1), (1, 0)),
        classifier=_network(rng, 2, states=2),
        conditions=("warms up", 'cools "down"'),
        machines=(_machine(rng, features), _machine(rng, features)),
        machine_of=(0, 1),
    )
