"""Friction that grows with speed faster one way than the other: guideways out of parallel, a one-sided load."""

from __future__ import annotations

import numpy as np

from rtec.effects.conditions import Conditions, Floats, no_speed
from rtec.effects.protocol import Card, Effect, Observable, Over, Per, Shape

LEAST_EACH_WAY = 0.05
"""Share of the travel that has to go each way: a jolt back is no motion in the other direction."""


class AsymmetricFriction(Effect):
    """Difference of the viscous coefficient by direction.

    Notes
    -----
    ``force = asymmetry * |velocity|``: added to ``viscous * velocity`` the coefficient is viscous + asymmetry forward
    and viscous - asymmetry backward. Either sign is possible.

    Examples
    --------
    >>> v = np.array([10.0, -10.0])
    >>> c = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64), velocity=v)
    >>> AsymmetricFriction().contribution(c, Shape(), [0.03]).round(9).tolist()
    [0.3, 0.3]
    """

    name = "asymmetric_friction"
    over = Over.VELOCITY
    observable = Observable.DRIVE
    builds_on = frozenset({"viscous"})
    amplitude = "asymmetry"
    amplitude_per = Per.SPEED
    card = Card(
        title="Friction that differs by direction",
        formula="`asymmetry · abs(v)`",
        needs="motion in both directions",
        plot="Force against velocity has different slopes forward and backward.",
        cause="Guideways out of parallel, a tilting nut or wiper, a one-sided load, an inclined axis.",
        consequence="Feed-forward that suits one direction is wrong in the other.",
        action=(
            "Check parallelism of the guideways and mounting of nut and wipers; use a coefficient for each direction."
        ),
        invariant_to="position and acceleration; it grows with speed.",
        source=(
            "Erwinski et al. (2019), section 3: friction is not symmetric where the unit is inclined or the "
            "guideways are not parallel."
        ),
    )

    def untestable(self, conditions: Conditions) -> str | None:
        velocity = conditions.velocity
        if velocity is None or not np.any(velocity):
            return no_speed(conditions)
        forward, backward = float(np.maximum(velocity, 0.0).sum()), float(np.maximum(-velocity, 0.0).sum())
        return None if min(forward, backward) > LEAST_EACH_WAY * (forward + backward) else "one direction only"

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        return np.abs(self._needed(conditions.velocity, "a velocity or feed column"))[:, None]
