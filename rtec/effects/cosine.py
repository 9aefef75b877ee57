"""The laser beam is not parallel to the axis: an error proportional to position, like a wrong scale."""

from __future__ import annotations

from rtec.effects.conditions import Conditions, Floats, one_place
from rtec.effects.protocol import Card, Effect, Per, Shape


class Cosine(Effect):
    """A beam at an angle to the travel, which reads short by the cosine of the angle.

    Notes
    -----
    ``deviation = (cos(angle) - 1) * position``, in the angle ``-angle**2 / 2``: 1 mrad reads 0.5 um/m short. The
    column is that of ``scale``, so that no measurement with the same set-up tells the two apart; this effect is
    listed beside ``scale`` and never ranked.

    Examples
    --------
    >>> import numpy as np
    >>> c = Conditions(position=np.array([0.0, 1000.0]), position_unit="mm", run=np.ones(2, dtype=np.int64))
    >>> (Cosine().contribution(c, Shape(), [np.cos(1e-3) - 1]) * 1e3).round(3).tolist()
    [0.0, -0.5]
    """

    name = "cosine"
    amplitude_per = Per.LENGTH
    data_checks = (one_place,)
    card = Card(
        title="Cosine error of the laser",
        formula="`(cos(angle) − 1) · x`",
        needs="spread of positions; a second instrument or a new alignment to tell it from scale",
        plot="The deviation falls on a straight line with position: a tilted beam reads short, 0.5 um/m at 1 mrad.",
        cause=(
            "The laser beam is not parallel to the axis and measures the cosine of the travel. The machine has no "
            "error."
        ),
        consequence="A compensation made from this measurement puts the error into the machine.",
        action="Align the beam over the full travel, measure again, and see whether the slope changes.",
        invariant_to="direction, feed, time and temperature; it changes with each set-up of the laser.",
        source="ISO 230-1, alignment of the measuring line; thesis, section 2.3.2.",
    )

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        return conditions.position[:, None].astype(float)
