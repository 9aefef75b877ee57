"""A force of constant size against the motion: dry friction."""

from __future__ import annotations

from rtec.effects._build_up import BuildsUp, BuildUpShape
from rtec.effects.conditions import Conditions, one_way
from rtec.effects.protocol import Card


class Coulomb(BuildsUp):
    """Friction with the sign of the motion, at once or built up over a distance after each reversal.

    Notes
    -----
    ``force = coulomb * direction``, and 0 at rest, where friction is whatever holds the axis. With a distance the
    share ``1 - exp(-since_reversal / distance)`` of it: near standstill the force lies anywhere below breakaway, and
    rises with the way (Dahl 1968), not with the sign of a velocity that is noise. Carried over a reversal, it starts
    from the friction of the motion before.

    Examples
    --------
    >>> import numpy as np
    >>> way = np.array([1.0, 0.0, -1.0])
    >>> c = Conditions(position=np.zeros(3), position_unit="mm", run=np.ones(3, dtype=np.int64), direction=way)
    >>> Coulomb().contribution(c, BuildUpShape(), [20.0]).tolist()
    [20.0, 0.0, -20.0]
    """

    name = "coulomb"
    shape_type = BuildUpShape
    card = Card(
        title="Coulomb friction",
        formula="`coulomb · d`, or `coulomb · d · (1 − exp(−r/distance))`",
        needs="motion in both directions",
        plot=(
            "The force changes between two levels where the motion reverses, the same at every speed; with "
            "presliding it builds up over a distance."
        ),
        cause="Dry friction of guideways, seals, wipers and preloaded nuts.",
        consequence="Quadrant glitches on circles, stick-slip, wind-up of an elastic drive after each reversal.",
        action="Lubricate, ease gibs and wipers, check preload; enter it as friction compensation.",
        invariant_to="position, speed and acceleration. It cannot be below zero.",
        source="Erwinski et al. (2019), section 3: the constant component.",
    )

    def untestable(self, conditions: Conditions) -> str | None:
        if conditions.direction is None:
            return "no directions: moving data or a direction column needed"
        return one_way(conditions)
