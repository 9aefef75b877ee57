"""Friction that a load presses on: it grows with a column of the file, with the sign of the motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.coulomb import Coulomb
from rtec.effects.protocol import Card, Per, Shape

LEAST_CHANGE = 0.05
"""Share of the largest load by which it has to change."""


class LoadFriction(Coulomb):
    """Dry friction in proportion to a load, at once or built up over a distance after each reversal.

    Notes
    -----
    ``force = load_friction * load * direction``, and nothing at rest; times the share built up, as of ``coulomb``.

    Examples
    --------
    >>> way, load = np.array([1.0, -1.0]), np.array([10.0, 20.0])
    >>> c = Conditions(
    ...     position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64), direction=way, load=load
    ... )
    >>> from rtec.effects import BuildUpShape
    >>> LoadFriction().contribution(c, BuildUpShape(), [0.1]).tolist()
    [1.0, -2.0]
    """

    name = "load_friction"
    amplitude_per = Per.LOAD
    card = Card(
        title="Load-dependent friction",
        formula="`load_friction · load · d`, built up as `coulomb`",
        needs="a load column that changes, and both directions of motion",
        plot="The step of the force between the two directions grows with the load, at every speed.",
        cause="Guides, nut, bearings or gears carry the load: their friction is a share of the force on them.",
        consequence="A friction compensation set without a load is too weak with one.",
        action="Feed friction forward by the load, lubricate, or relieve the guide (rollers, counterbalance).",
        invariant_to="position and speed; it changes with the lubricant. It cannot be below zero.",
        source="Armstrong-Helouvry et al. (1994), section 2.",
    )

    def untestable(self, conditions: Conditions) -> str | None:
        load = conditions.load
        if load is None:
            return "no load column"
        if not conditions.both_directions:
            return "one direction only"
        change, largest = float(np.ptp(load)), float(np.abs(load).max())
        return None if change > LEAST_CHANGE * largest else f"the load changes by {change:.3g} of {largest:.3g} only"

    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        return super().scan(conditions, shapes) * self._needed(conditions.load, "a load column")
