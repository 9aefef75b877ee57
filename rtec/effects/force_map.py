"""A force that is a smooth function of position: cables, springs, covers, a guide that is tighter in places."""

from __future__ import annotations

from rtec.effects.conditions import Conditions
from rtec.effects.pitch_map import PitchMap, closes
from rtec.effects.protocol import Card, Observable


class ForceMap(PitchMap):
    """A natural cubic spline through nodes, in the force of a drive.

    Notes
    -----
    ``force = s(position)``; the amplitudes are the values of ``s`` at the nodes.

    Examples
    --------
    >>> import numpy as np
    >>> from rtec.effects.pitch_map import MapShape
    >>> c = Conditions(position=np.array([0.0, 25.0]), position_unit="mm", run=np.ones(2, dtype=np.int64))
    >>> ForceMap().contribution(c, MapShape((0.0, 50.0, 100.0)), [4.0, 2.0, 0.0]).round(9).tolist()
    [4.0, 3.0]
    """

    name = "force_map"
    observable = Observable.DRIVE
    card = Card(
        title="Force map",
        formula="`s(x)`",
        needs="force and position, positions dense enough: three at least",
        plot="Force against position is a smooth curve, the same in both directions and every run.",
        cause=(
            "Cables, hoses, covers and springs that pull more at one end; a screw or belt tighter in places; a "
            "counterweight that moves."
        ),
        consequence="The following error changes along the axis.",
        action=(
            "Check cable chains, covers, counterbalance and alignment where the curve is steep, or map the force and "
            "feed it forward."
        ),
        invariant_to="direction, speed, acceleration and time.",
        source="Erwinski et al. (2019), section 3, Figure 6: a current that depends on position is mapped.",
    )

    def untestable(self, conditions: Conditions) -> str | None:
        if conditions.time_is_coordinate:
            return "no positions: time stands for them"
        if closes(conditions):
            return "one turn of a rotary axis closes: what is smooth over it comes back every turn (gravity, cogging)"
        return super().untestable(conditions)
