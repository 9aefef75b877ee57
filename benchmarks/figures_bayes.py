"""Figures of Bayesian networks: learning and exact inference beside pyAgrum, by turns, on 100 random networks."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from figures import Bar, Figure, Setting, Spread, skipped
from open_path_job import WrongResultError

from rtec.predictors.warm.bayes_network import BayesNetwork, Node

sys.path.append(str(Path(__file__).parents[1] / "tests" / "oracles"))
from bayes_oracle import PyAgrum, drawn_evidence, drawn_network

THIS = "python benchmarks/measure.py --only bayes"
NETWORKS, NODES, ROWS, QUESTIONS = 100, 10, 1000, 10
AGREED = 1e-9
FASTER = Bar(value=1.0, unit="x pyAgrum")
PARTS = ("Learning", "One node asked", "Every node asked", "All together")


def bayes(setting: Setting) -> Iterator[Figure]:
    """Measure learning, and ten rows of evidence asked for one node and for all."""
    what = f"{NETWORKS} random networks of {NODES} nodes"
    try:
        import pandas
        import pyagrum
    except ImportError:
        yield skipped(what, "pyAgrum and pandas are not installed: pip install pyagrum pandas", THIS, FASTER)
        return
    jobs = []
    for seed in range(NETWORKS):
        nodes, data = drawn_network(seed, nodes=NODES, rows=ROWS)
        frame = pandas.DataFrame(data, columns=[node.name for node in nodes])
        jobs.append((nodes, data, frame, [drawn_evidence(100 * seed + k, nodes) for k in range(QUESTIONS)]))
    _ours(*jobs[0])
    ours, theirs, apart = [], [], 0.0
    for _ in range(setting.of(7, 2)):
        own, peer = np.zeros(3), np.zeros(3)
        for nodes, data, frame, evidence in jobs:
            seconds, found = _ours(nodes, data, frame, evidence)
            own += seconds
            seconds, other = _pyagrum(nodes, data, frame, evidence)
            peer += seconds
            apart = max(apart, *(float(np.abs(a - b).max()) for a, b in zip(found, other, strict=True)))
        ours.append((*own, own.sum()))
        theirs.append((*peer, peer.sum()))
    if not apart < AGREED:
        raise WrongResultError(f"probabilities differ by {apart:g}")
    for part, own, peer in zip(PARTS, zip(*ours, strict=True), zip(*theirs, strict=True), strict=True):
        one, other = Spread(own), Spread(peer)
        ratio = other.best / one.best
        both = f"{one.text(_in_ms)}, pyAgrum {pyagrum.__version__} {other.text(_in_ms)}"
        yield Figure(
            what=f"{part}: {what}, {ROWS} rows, {QUESTIONS} rows of evidence",
            measured=f"{ratio:.1f} x: {both}",
            value=ratio,
            bar=FASTER,
            command=THIS,
        )
    yield Figure(
        what="Largest difference between two probabilities",
        measured=f"{apart:.1e}",
        value=apart,
        bar=Bar(value=AGREED, unit="", at_most=True),
        command=THIS,
    )


def _in_ms(seconds: float) -> str:
    return f"{1e3 * seconds:.0f} ms"


def _timed(nodes: tuple[Node, ...], evidence: list[dict[str, int]], learn: Any, ask: Any) -> tuple[Any, list[Any]]:
    """Return the processor times of learning, of asking one node, and of asking all, and all answers."""
    names = [node.name for node in nodes]
    begun = time.process_time()
    known = learn()
    learned = time.process_time()
    for one in evidence:
        ask(known, names[-1:], one)
    first = time.process_time()
    answers = [answer for one in evidence for answer in ask(known, names, one)]
    return np.array([learned - begun, first - learned, time.process_time() - first]), answers


def _ours(nodes: tuple[Node, ...], data: Any, _: Any, evidence: list[dict[str, int]]) -> tuple[Any, list[Any]]:
    def ask(network: BayesNetwork, names: list[str], one: dict[str, int]) -> list[Any]:
        return [network.posterior(name, one).probabilities for name in names]

    return _timed(nodes, evidence, lambda: BayesNetwork.learn(nodes, data), ask)


def _pyagrum(nodes: tuple[Node, ...], _: Any, frame: Any, evidence: list[dict[str, int]]) -> tuple[Any, list[Any]]:
    peer = PyAgrum(nodes)

    def learn() -> PyAgrum:
        peer.learn(frame)
        return peer

    return _timed(nodes, evidence, learn, PyAgrum.posteriors)
