"""An error proportional to position: the lead of the screw or the factor of the scale is wrong."""

from __future__ import annotations

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Amplitude, Effect, Shape, Units


class Scale(Effect):
    """A straight line through position zero.

    Notes
    -----
    ``deviation = scale * position``; on a linear axis in um/m, which is parts in a million.

    Examples
    --------
    >>> import numpy as np
    >>> c = Conditions(position=np.array([0.0, 500.0]), position_unit="mm", run=np.ones(2, dtype=np.int64))
    >>> Scale().contribution(c, Shape(), [20e-6]).tolist()
    [0.0, 0.01]
    """

    name = "scale"
    needs = "spread of positions"

    def untestable(self, conditions: Conditions) -> str | None:
        """Return why the data cannot show a slope, or None."""
        return None if conditions.places.size >= 2 else "one position only"

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return the position, shape (rows, 1)."""
        return conditions.position[:, None].astype(float)

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return the slope, in um/m (arcsec/deg on a rotary axis)."""
        return (Amplitude("scale", *units.per_length),)
