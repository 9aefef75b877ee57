"""One regressor of each kind that a file holds, with numbers of some size."""

import numpy as np

from rtec.predictors.warm.bayes import BayesRegressor
from rtec.predictors.warm.bayes_network import BayesNetwork, Node
from rtec.predictors.warm.linear import Linear
from rtec.predictors.warm.lssvm import LsSvm


def one_of_each(kind, *, features):
    """Return a regressor of a kind for temperatures near 20 and for heat."""
    rng = np.random.default_rng(8)
    if kind == Linear.kind:
        slopes, spread = rng.normal(0.0, 2.0, features), rng.normal(0.0, 0.1, (features, features))
        return Linear(centre=np.full(features, 20.0), intercept=1 / 3, slopes=slopes, noise_sd=0.5, spread=spread)
    if kind == BayesRegressor.kind:
        names = [f"f{k}" for k in range(features)]
        nodes = [Node(name=name, states=3) for name in names]
        nodes.append(Node(name="output", states=4, parents=tuple(names[:2])))
        rows = rng.integers(0, 3, (40, features + 1))
        cuts = tuple([18.0, 21.0 + k] for k in range(features))
        network = BayesNetwork.learn(tuple(nodes), rows)
        means, variances = rng.normal(0.0, 9.0, 4), [1.0, 2.0, 3.0, 1 / 3]
        return BayesRegressor(network=network, cuts=cuts, means=means, variances=variances)
    assert kind == LsSvm.kind
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
