"""Smooth functions of position: cubic splines through nodes, and the ladder of how many nodes to try."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtec.effects.conditions import Conditions, Floats

FEWEST_NODES, MOST_NODES = 4, 24
"""A smooth curve is slower than a wave that could be named, of five cycles and more: what needs more is none."""
NODES_A_TARGET = 0.6
"""At most: what is left of the targets has to show whether the map fits, and a wave is no smooth curve."""
TABLE_TARGETS = 12
"""With so few targets a node stands at each: a smooth function and a table cannot be told apart."""


def smooth_columns(position: Floats, nodes: Sequence[float]) -> Floats:
    """Return natural cubic splines that are 1 at one node and 0 at the others, shape (rows, nodes).

    Beyond the outer nodes they go on straight, so that a model read at a place outside does not run away.
    """
    knots = np.asarray(nodes, dtype=np.float64)
    step = np.diff(knots)
    # second derivatives at the nodes, 0 at the outer ones; scipy's splines would cost 0.35 s to load
    rise = np.diff(np.eye(knots.size), axis=0) / step[:, None]
    inner = np.diag(2.0 * (step[:-1] + step[1:])) + np.diag(step[1:-1], 1) + np.diag(step[1:-1], -1)
    bend = np.zeros((knots.size, knots.size))
    bend[1:-1] = np.linalg.solve(inner, 6.0 * np.diff(rise, axis=0))
    left = np.clip(np.searchsorted(knots, position, side="right") - 1, 0, knots.size - 2)
    size = step[left]
    ahead, behind = knots[left + 1] - position, position - knots[left]
    rows = np.arange(position.size)
    bends = np.zeros((position.size, knots.size))
    bends[rows, left], bends[rows, left + 1] = _bow(ahead, size), _bow(behind, size)
    columns: Floats = bends @ bend
    columns[rows, left] += ahead / size
    columns[rows, left + 1] += behind / size
    return columns


def _bow(distance: Floats, size: Floats) -> Floats:
    """Return what a unit second derivative at one end of a section adds, by the distance from the other end."""
    return (np.maximum(distance, 0.0) ** 3 / size - size * distance) / 6.0


def node_ladder(conditions: Conditions) -> list[tuple[float, ...]]:
    """Return the sets of nodes to try, from few to many: at most three for four targets, or one at each of few."""
    places = conditions.places
    counts, count = [], FEWEST_NODES
    while count <= min(int(NODES_A_TARGET * places.size), MOST_NODES):
        counts.append(count)
        count = count + 1 if count < TABLE_TARGETS else int(count * 1.3)
    ladder = [tuple(np.linspace(places[0], places[-1], count).tolist()) for count in counts]
    if 3 <= places.size <= TABLE_TARGETS:
        ladder.append(tuple(places.tolist()))
    return ladder


def node_names(nodes: Sequence[float]) -> list[str]:
    """Return ``at_<position>`` of each node, with as many digits as it takes to tell them apart."""
    for digits in range(4, 18):
        names = [f"at_{node:.{digits}g}" for node in nodes]
        if len(set(names)) == len(names):
            break
    return names
