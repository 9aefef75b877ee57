"""Random Bayesian networks, and two that know what they say: sums over the joint distribution, and pyAgrum."""

import numpy as np

from rtec.predictors.warm.bayes_network import Node


def drawn_network(seed, *, nodes=8, most_states=5, rows=300):
    """Nodes of a random acyclic graph in random order, and random rows of states."""
    draw = np.random.default_rng(seed)
    states = draw.integers(1, most_states + 1, nodes)
    order = draw.permutation(nodes)
    made = {}
    for place, i in enumerate(order):
        parents = [f"n{j}" for j in order[:place] if draw.random() < 0.35][:4]
        made[i] = Node(name=f"n{i}", states=int(states[i]), parents=tuple(parents))
    data = np.stack([(draw.random(rows) ** 2 * k).astype(np.int64) for k in states], axis=1)
    return tuple(made[i] for i in range(nodes)), data


def drawn_evidence(seed, nodes):
    draw = np.random.default_rng(seed + 1000)
    return {node.name: int(draw.integers(node.states)) for node in nodes if draw.random() < 0.4}


def from_the_joint(nodes, data, target, evidence, prior):
    """Count row by row, write the joint distribution down cell by cell, and sum over it."""
    places = {node.name: i for i, node in enumerate(nodes)}
    joint = np.ones([node.states for node in nodes])
    families = [[*(places[parent] for parent in node.parents), i] for i, node in enumerate(nodes)]
    counted = []
    for family in families:
        cells = {}
        for row in data:
            key = tuple(row[family])
            cells[key] = cells.get(key, 0) + 1
        counted.append(cells)
    for cell in np.ndindex(joint.shape):
        for node, family, cells in zip(nodes, families, counted, strict=True):
            above = tuple(cell[i] for i in family[:-1])
            below = sum(prior + cells.get((*above, k), 0) for k in range(node.states))
            joint[cell] *= (prior + cells.get((*above, cell[family[-1]]), 0)) / below
    for name, state in evidence.items():
        seen = np.arange(nodes[places[name]].states) == state
        joint = joint * seen.reshape([-1 if node.name == name else 1 for node in nodes])
    found = joint.sum(axis=tuple(i for i in range(len(nodes)) if i != places[target]))
    return found / found.sum()


class PyAgrum:
    """pyAgrum 3.3 given the same graph: counts smoothed by 1, exact inference."""

    def __init__(self, nodes):
        import pyagrum

        self.gum = pyagrum
        self.graph = pyagrum.BayesNet()
        for node in nodes:
            self.graph.add(pyagrum.RangeVariable(node.name, "", 0, node.states - 1))
        for node in nodes:
            for parent in node.parents:
                self.graph.addArc(parent, node.name)

    def learn(self, frame):
        """Learn from a data frame, a column for each node."""
        learner = self.gum.BNLearner(frame, self.graph)
        learner.useSmoothingPrior(1.0)
        self.inference = self.gum.LazyPropagation(learner.learnParameters(self.graph.dag()))

    def posteriors(self, targets, evidence):
        """Return the probabilities of each target; axes of observed nodes with a single state come along."""
        self.inference.setEvidence(evidence)
        self.inference.makeInference()
        return [self.inference.posterior(target).toarray().ravel() for target in targets]
