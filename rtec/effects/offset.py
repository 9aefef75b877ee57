"""A constant error: where the zero of the axis and the zero of the instrument differ."""

from __future__ import annotations

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Amplitude, Card, Effect, Shape, Units


class Offset(Effect):
    """A constant.

    Notes
    -----
    ``deviation = offset``.

    Examples
    --------
    >>> c = Conditions(position=np.array([0.0, 5.0]), position_unit="mm", run=np.ones(2, dtype=np.int64))
    >>> Offset().contribution(c, Shape(), [0.003]).tolist()
    [0.003, 0.003]
    """

    name = "offset"
    is_datum = True
    needs = "nothing"
    card = Card(
        title="Offset",
        plot=(
            "Every deviation is shifted by the same amount, in both directions and in every run; in the plot against "
            "position the whole curve lies above or below zero."
        ),
        cause=(
            "The zero of the axis and the zero of the instrument were set at different places: reference point, "
            "datum of the laser, home position."
        ),
        consequence="None on distances; every absolute position is off by the same amount.",
        action="Set the instrument to zero at the reference point, or correct the reference point of the axis.",
        invariant_to="position, direction, feed, time and temperature.",
        source="ISO 230-2 leaves the datum free: only differences of deviations count.",
    )

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return a column of ones, shape (rows, 1)."""
        return np.ones((conditions.rows, 1))

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return the offset."""
        return (Amplitude("offset", *units.shown),)
