"""Discrete Bayesian networks against sums over the whole joint distribution, and against pyAgrum."""

import math

import numpy as np
import pytest
from bayes_oracle import PyAgrum, drawn_evidence, drawn_network, from_the_joint

from rtec.errors import ArgumentError
from rtec.predictors.warm.bayes_network import BayesNetwork, Node

CHAIN = (
    Node(name="speed", states=2),
    Node(name="room", states=2),
    Node(name="warm", states=3, parents=("speed", "room")),
    Node(name="error", states=2, parents=("warm",)),
)


@pytest.mark.parametrize("seed", range(8))
def test_every_node_given_any_evidence_is_as_the_joint_distribution_says(seed):
    nodes, data = drawn_network(seed, nodes=6, most_states=3, rows=60)
    network = BayesNetwork.learn(nodes, data, prior=0.5)
    evidence = drawn_evidence(seed, nodes)
    for node in nodes:
        expected = from_the_joint(nodes, data, node.name, evidence, 0.5)
        assert network.posterior(node.name, evidence).probabilities == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("seed", range(100))
def test_learning_and_inference_are_those_of_pyagrum(seed):
    pytest.importorskip("pyagrum")
    pandas = pytest.importorskip("pandas")
    nodes, data = drawn_network(seed, nodes=4 + seed % 7)
    evidence, names = drawn_evidence(seed, nodes), [node.name for node in nodes]
    peer = PyAgrum(nodes)
    peer.learn(pandas.DataFrame(data, columns=names))
    network = BayesNetwork.learn(nodes, data)
    for name, theirs in zip(names, peer.posteriors(names, evidence), strict=True):
        assert network.posterior(name, evidence).probabilities == pytest.approx(theirs, abs=1e-9)


def test_the_predictive_is_the_smoothed_share_of_the_counts():
    rows = [[0, 0, 0, 0]] * 3 + [[0, 0, 2, 1]]
    table = BayesNetwork.learn(CHAIN, rows, prior=1.0).probabilities("warm")
    assert table.shape == (2, 2, 3)
    assert table[0, 0].tolist() == pytest.approx([4 / 7, 1 / 7, 2 / 7])
    assert table[1, 1].tolist() == pytest.approx([1 / 3, 1 / 3, 1 / 3])


def test_mean_mode_and_deviation_of_a_quantity_whose_states_are_intervals():
    rows = [[0, 0, 0, 0]] * 8 + [[0, 0, 2, 1]] * 8
    found = BayesNetwork.learn(CHAIN, rows, prior=1e-9).posterior("warm", {"error": 1})
    assert found.mode == 2
    found = BayesNetwork.learn(CHAIN, rows, prior=1e-9).posterior("warm")
    assert found.probabilities == pytest.approx([0.5, 0.0, 0.5], abs=1e-6)
    assert found.mean([10.0, 20.0, 30.0]) == pytest.approx(20.0, abs=1e-5)
    assert found.sd([10.0, 20.0, 30.0], [4.0, 0.0, 4.0]) == pytest.approx(math.sqrt(104.0), abs=1e-5)


def test_unseen_states_are_answered_by_the_prior_and_flagged():
    network = BayesNetwork.learn(CHAIN, [[0, 0, 1, 0], [0, 1, 1, 1]])
    found = network.posterior("warm", {"speed": 1, "room": 0})
    assert found.probabilities == pytest.approx([1 / 3, 1 / 3, 1 / 3])
    assert found.unseen == ("warm",)
    assert network.posterior("warm", {"speed": 0}).unseen == ()
    assert network.posterior("warm", {"error": 1, "speed": 0}).unseen == ()
    assert network.posterior("error", {"warm": 2}).unseen == ("error",)


def test_no_rows_leave_the_prior():
    network = BayesNetwork.learn(CHAIN, np.zeros((0, 4), dtype=int))
    assert network.posterior("error").probabilities.tolist() == [0.5, 0.5]


def test_an_observed_node_is_what_was_observed():
    network = BayesNetwork.learn(CHAIN, [[0, 0, 1, 0], [0, 1, 1, 1]])
    assert network.posterior("room", {"room": 1}).probabilities.tolist() == [0.0, 1.0]


def test_many_observed_effects_do_not_underflow():
    """The probability of 1000 states at once is below the smallest number of the machine."""
    effects = [Node(name=f"e{k}", states=2, parents=("cause",)) for k in range(1000)]
    rows = [[0] * 1001, [1] * 1001, [1] * 1001]
    network = BayesNetwork.learn((Node(name="cause", states=2), *effects), rows)
    halves = {f"e{k}": k % 2 for k in range(1000)}
    one, other = network.posterior("cause", halves).probabilities
    # 500 effects each say 2/3 to 1/4 and 1/3 to 3/4
    odds = 2 / 5 / (3 / 5) * ((2 / 3) / (1 / 4)) ** 500 / ((3 / 4) / (1 / 3)) ** 500
    assert one / other == pytest.approx(odds, rel=1e-9)


@pytest.mark.parametrize(
    ("nodes", "said"),
    [
        ((), "no node"),
        ((Node(name="a", states=2), Node(name="a", states=2)), "a, a"),
        ((Node(name="a", states=2, parents=("b",)),), "parents of a: b"),
        ((Node(name="a", states=0),), "states of a: 0"),
        ((Node(name="a", states=2), Node(name="b", states=2, parents=("a", "a"))), "each cause once"),
        ((Node(name="a", states=2, parents=("b",)), Node(name="b", states=2, parents=("a",))), "circle"),
        ((Node(name="a", states=3000), Node(name="b", states=3000, parents=("a",))), "parents of b: 1 with 3000"),
    ],
)
def test_a_graph_that_cannot_be_says_why(nodes, said):
    with pytest.raises(ArgumentError, match=said):
        BayesNetwork.learn(nodes, np.zeros((1, len(nodes)), dtype=int))


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda: BayesNetwork.learn(CHAIN, [[0, 0, 3, 0]]), "rows, warm: 3 to 3"),
        (lambda: BayesNetwork.learn(CHAIN, [[0, 0, 1]]), "4 in each row"),
        (lambda: BayesNetwork.learn(CHAIN, [[0.0, 0.0, 1.0, 0.0]]), "whole numbers"),
        (lambda: BayesNetwork.learn(CHAIN, [[0, 0, 0, 0]], prior=0.0), "prior: 0"),
        (lambda: BayesNetwork(nodes=CHAIN, counts=()), "4, one for each node"),
        (lambda: BayesNetwork(nodes=CHAIN[:1], counts=([1.0, -1.0],)), "counts of speed"),
        (lambda: BayesNetwork.learn(CHAIN, [[0, 0, 0, 0]]).posterior("warn"), "warm"),
        (lambda: BayesNetwork.learn(CHAIN, [[0, 0, 0, 0]]).posterior("warm", {"speed": 2}), "evidence of speed: 2"),
        (lambda: BayesNetwork.learn(CHAIN, [[0, 0, 0, 0]]).posterior("warm", {"speed": 0.5}), "evidence of speed"),
    ],
)
def test_what_is_wrong_is_named(ask, said):
    with pytest.raises(ArgumentError, match=said):
        ask()


def test_a_network_too_entangled_for_exact_inference_says_so():
    """A common effect of pairs of 20 causes of 8 states: some table between the steps has 8 ** 12 numbers."""
    causes = [Node(name=f"c{k}", states=8) for k in range(20)]
    near = [(f"c{i}", f"c{j}") for i in range(20) for j in range(i) if i - j < 13]
    pairs = [Node(name="-".join(pair), states=2, parents=pair) for pair in near]
    network = BayesNetwork.learn((*causes, *pairs), np.zeros((1, 20 + len(pairs)), dtype=int))
    with pytest.raises(ArgumentError, match="fewer states"):
        network.posterior("c0")
