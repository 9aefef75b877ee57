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
SIZES = ((100, 10), (20, 22), (20, 30))
"""Networks, and nodes of each; the first is to be reached, the others show where it ends."""
ROWS, QUESTIONS = 1000, 10
AGREED = 1e-9
FASTER = Bar(value=1.0, unit="x pyAgrum")
PARTS = ("learning", "one node asked", "every node asked", "all together")


def bayes(setting: Setting) -> Iterator[Figure]:
    """Measure learning, and ten rows of evidence asked for one node and for all."""
    try:
        import pandas
        import pyagrum
    except ImportError:
        what = "Random networks, learned and asked"
        yield skipped(what, "pyAgrum and pandas are not installed: pip install pyagrum pandas", THIS, FASTER)
        return
    farthest = 0.0
    for networks, nodes in SIZES:
        jobs = []
        for seed in range(networks):
            drawn, data = drawn_network(seed, nodes=nodes, rows=ROWS)
            frame = pandas.DataFrame(data, columns=[node.name for node in drawn])
            jobs.append((drawn, data, frame, [drawn_evidence(100 * seed + k, drawn) for k in range(QUESTIONS)]))
        ours, theirs, apart = _by_turns(jobs, setting.of(7, 2))
        farthest = max(farthest, apart)
        for part, own, peer in zip(PARTS, zip(*ours, strict=True), zip(*theirs, strict=True), strict=True):
            one, other = Spread(own), Spread(peer)
            both = f"{one.text(_in_ms)}, pyAgrum {pyagrum.__version__} {other.text(_in_ms)}"
            yield Figure(
                what=f"{networks} random networks of {nodes} nodes, {part}",
                measured=f"{other.best / one.best:.1f} x: {both}",
                value=other.best / one.best,
                bar=FASTER,
                command=THIS,
                binding=(networks, nodes) == SIZES[0],
            )
    yield Figure(
        what="Largest difference between two probabilities",
        measured=f"{farthest:.1e}",
        value=farthest,
        bar=Bar(value=AGREED, unit="of 1", at_most=True),
        command=THIS,
    )


def _by_turns(jobs: list[Any], rounds: int) -> tuple[list[Any], list[Any], float]:
    """Return the times of each round, ours and pyAgrum's, and the largest difference between two answers."""
    _ours(*jobs[0])
    ours, theirs, apart = [], [], 0.0
    for _ in range(rounds):
        own, peer = np.zeros(3), np.zeros(3)
        for job in jobs:
            seconds, found = _ours(*job)
            own += seconds
            seconds, other = _pyagrum(*job)
            peer += seconds
            apart = max(apart, *(float(np.abs(a - b).max()) for a, b in zip(found, other, strict=True)))
        ours.append((*own, own.sum()))
        theirs.append((*peer, peer.sum()))
    if not apart < AGREED:
        raise WrongResultError(f"probabilities differ by {apart:g}")
    return ours, theirs, apart


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
