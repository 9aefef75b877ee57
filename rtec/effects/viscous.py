"""A force proportional to velocity: the shearing of lubricant, eddy currents."""

from __future__ import annotations

import numpy as np

from rtec.effects._drive import per_speed
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Amplitude, Effect, Observable, Shape, Units


class Viscous(Effect):
    """Friction that grows with speed.

    Notes
    -----
    ``force = viscous * velocity``.

    References
    ----------
    Erwinski et al. (2019), section 3: the part of friction that is a linear function of speed.

    Examples
    --------
    >>> v = np.array([0.0, -50.0])
    >>> c = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64), velocity=v)
    >>> Viscous().contribution(c, Shape(), [0.2]).tolist()
    [0.0, -10.0]
    """

    name = "viscous"
    observable = Observable.DRIVE
    needs = "moving data; several speeds to tell it from coulomb"
    not_negative = True

    def untestable(self, conditions: Conditions) -> str | None:
        """Return why the data cannot show friction that grows with speed, or None."""
        if conditions.velocity is None:
            return "no velocity or feed column"
        return None if np.any(conditions.velocity) else "the velocity is zero throughout"

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return the velocity, shape (rows, 1)."""
        return self._needed(conditions.velocity, "a velocity or feed column")[:, None].astype(float)

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return the coefficient, in N/(m/s) on a linear axis."""
        return (Amplitude("viscous", *per_speed(units)),)
