"""Smooth functions of position: cubic splines through nodes, and the ladder of how many nodes to try."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtec.effects.conditions import Conditions, Floats

FEWEST_NODES, MOST_NODES = 4, 64
NODES_A_TARGET = 0.6
"""At most: what is left of the targets has to show whether the map fits, and a wave is no smooth curve."""
TABLE_TARGETS = 12
"""With so few targets a node stands at each: a smooth function and a table cannot be told apart."""


def smooth_columns(position: Floats, nodes: Sequence[float]) -> Floats:
    """Return natural cubic splines that are 1 at one node and 0 at the others, shape (rows, nodes).

    Beyond the outer nodes they go on straight, so that a model read at a place outside does not run away.
    """
    from scipy.interpolate import CubicSpline  # noqa: PLC0415 - 0.2 s, for fits only

    knots = np.asarray(nodes, dtype=np.float64)
    spline = CubicSpline(knots, np.eye(knots.size), bc_type="natural")
    inside = np.clip(position, knots[0], knots[-1])
    slope = spline(inside, 1)
    columns: Floats = spline(inside) + slope * (position - inside)[:, None]
    return columns


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
