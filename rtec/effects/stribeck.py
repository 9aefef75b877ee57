"""Friction that falls as motion begins: the surfaces part when lubricant is drawn between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rtec.effects._build_up import BuildsUp, BuildUpShape, without_build_up
from rtec.effects._ladders import ladder
from rtec.effects.conditions import Conditions, Floats, no_speed, one_way
from rtec.effects.protocol import Card, Quantity, Shape, Tunable, own_shape, parameter

FEWEST_SPEEDS = 4
SLOWEST = 1 / 300
"""Of the highest speed: slower motion counts as rest."""


@dataclass(frozen=True, slots=True)
class StribeckShape(BuildUpShape):
    """Also, at which speed the surfaces have parted."""

    speed: float = field(default=1.0, metadata=parameter(Quantity.SPEED, "Stribeck speed"))


class Stribeck(BuildsUp):
    """Friction on top of dry friction that is gone beyond a speed.

    Notes
    -----
    ``force = stribeck * direction * exp(-(velocity / speed)**2)``, 0 at rest; times the share built up, as of
    ``coulomb``: the same asperities bend before they slip.

    Examples
    --------
    >>> v = np.array([0.0, 1.0, -100.0])
    >>> c = Conditions(
    ...     position=np.zeros(3), position_unit="mm", run=np.ones(3, dtype=np.int64), velocity=v, direction=np.sign(v)
    ... )
    >>> Stribeck().contribution(c, StribeckShape(speed=1.0), [10.0]).round(3).tolist()
    [0.0, 3.679, 0.0]
    """

    name = "stribeck"
    builds_on = frozenset({"coulomb"})
    shape_type = StribeckShape
    data_checks = (no_speed, one_way)
    card = Card(
        title="Stribeck friction",
        formula="`stribeck · d · exp(−(v/speed)²)`, built up as `coulomb`",
        needs="motion in both directions at four speeds at least, creep among them",
        plot="Against speed the force falls from a peak at creep to a minimum before viscous friction raises it.",
        cause="At creep the surfaces touch; at speed lubricant is drawn between them.",
        consequence="Stick-slip at slow feeds, steps after standstill, glitches where circles reverse.",
        action="Use guideway oil with friction modifier or roller guides; keep feeds above the Stribeck speed.",
        invariant_to="position and acceleration; gone well above the Stribeck speed. It cannot be below zero.",
        source=(
            "Erwinski et al. (2019), section 3: friction drops after standstill and rises again above the Stribeck "
            "velocity."
        ),
    )

    def untestable(self, conditions: Conditions) -> str | None:
        speeds = _speeds(conditions).size
        few = None if speeds >= FEWEST_SPEEDS else f"{speeds} speeds only: at least {FEWEST_SPEEDS} needed"
        return super().untestable(conditions) or few

    def at_once(self, conditions: Conditions) -> Sequence[StribeckShape]:
        """Return speeds from the slowest motion to a third of the fastest; higher: collinear with coulomb."""
        speeds = _speeds(conditions)
        if speeds.size < 2:
            return []
        slowest, fastest = float(speeds[0]), float(speeds[-1])
        return [StribeckShape(speed=speed) for speed in ladder(slowest, max(fastest / 3, slowest))]

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return the speeds: with every build-up they would take twenty times as long, and peak where they do."""
        return self.at_once(conditions)

    def variants(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        plain = without_build_up(shape)
        return [shape] if plain is None else [plain, shape]

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        """Return the Stribeck speed, free by a half more or less, and a distance of build-up."""
        speed = own_shape(shape, StribeckShape).speed
        speeds = _speeds(conditions)
        top = max(float(speeds[-1]) / 3, speed) if speeds.size else speed * 1.5
        return (Tunable("speed", speed / 1.5, min(speed * 1.5, top)), *super().tunables(conditions, shape))

    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        """Return the columns of several speeds and build-ups, shape (shapes, 1, rows)."""
        velocity = self._needed(conditions.velocity, "a velocity or feed column")
        speeds = np.array([own_shape(shape, StribeckShape).speed for shape in shapes])
        left: Floats = np.exp(-((velocity / speeds[:, None]) ** 2))[:, None, :] * super().scan(conditions, shapes)
        return left


def _speeds(conditions: Conditions) -> Floats:
    """Return the distinct speeds of motion, ascending: those that differ by 1 % at least."""
    if conditions.velocity is None:
        return np.empty(0)
    speeds = np.unique(np.abs(conditions.velocity))
    speeds = speeds[speeds > SLOWEST * speeds[-1]]
    marks = np.unique(np.round(np.log(speeds) / 0.01), return_index=True)[1]
    distinct: Floats = speeds[marks]
    return distinct
