"""A reversal error that is the same everywhere: play between drive and slide."""

from __future__ import annotations

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Amplitude, Effect, Shape, Units


class Backlash(Effect):
    """Half of the lost motion, with the sign of the direction of approach.

    Notes
    -----
    ``deviation = backlash / 2 * direction``, so that the amplitude is the distance between the forward and the backward
    curve (positive where the forward curve lies higher; play itself leaves the slide behind, which is negative). Where
    a moving log is at rest its direction is 0, and so is the contribution.

    References
    ----------
    Thesis, section 3.1.1: play as the motion of the motor before motion is seen at the point of interest.

    Examples
    --------
    >>> import numpy as np
    >>> way = np.array([1.0, -1.0])
    >>> c = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64), direction=way)
    >>> Backlash().contribution(c, Shape(), [-0.02]).tolist()
    [-0.01, 0.01]
    """

    name = "backlash"
    needs = "both directions"

    def untestable(self, conditions: Conditions) -> str | None:
        """Return why the data cannot show a reversal error, or None."""
        return None if conditions.both_directions else "one direction only"

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return half of the direction, shape (rows, 1)."""
        return self._needed(conditions.direction, "directions of approach")[:, None] / 2

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return the backlash."""
        return (Amplitude("backlash", *units.shown),)
