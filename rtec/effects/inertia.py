"""A force proportional to acceleration: the moving mass."""

from __future__ import annotations

import numpy as np

from rtec.effects.conditions import Conditions, Floats, no_acceleration
from rtec.effects.protocol import Card, Effect, Observable, Over, Per, Shape

ONE_FREQUENCY = 0.99
"""Share of the acceleration that goes with the position: beyond, nothing tells the two apart."""


def share_with_position(conditions: Conditions) -> float:
    """Return the share of the acceleration that goes with the position, as where an axis swings: 0 without either."""
    x, a = conditions.position, conditions.acceleration
    if a is None or conditions.time_is_coordinate or np.ptp(x) == 0.0 or np.ptp(a) == 0.0:
        return 0.0
    return float(np.corrcoef(x, a)[0, 1]) ** 2


def one_frequency(conditions: Conditions) -> str | None:
    """Return why the data cannot tell inertia from a spring, or None: where the axis swings at one frequency."""
    alike = share_with_position(conditions) > ONE_FREQUENCY
    return "one frequency: not identifiable from a spring" if alike else None


class Inertia(Effect):
    """Newton's second law.

    Notes
    -----
    ``force = inertia * acceleration``.

    Examples
    --------
    >>> import numpy as np
    >>> a = np.array([0.0, 2000.0])
    >>> c = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64), acceleration=a)
    >>> Inertia().contribution(c, Shape(), [0.1]).tolist()
    [0.0, 200.0]
    """

    name = "inertia"
    over = Over.ACCELERATION
    observable = Observable.DRIVE
    amplitude_per = Per.ACCELERATION
    not_negative = True
    data_checks = (no_acceleration, one_frequency)
    card = Card(
        title="Inertia",
        formula="`inertia · a`",
        needs="moving data with accelerations",
        plot="Force against acceleration is a straight line through zero.",
        cause="The mass of the slide, or the moment of inertia of screw, coupling and motor.",
        consequence="It sets the force that acceleration takes.",
        action=(
            "Enter it as acceleration feed-forward. A difference from the mass by the drawing is a wrong force "
            "constant."
        ),
        invariant_to="position, direction and speed. It cannot be below zero.",
        source=(
            "Erwinski et al. (2019), section 3, Figure 4: 1/M, 3.61 kg identified by a current step; Erwinski et al. "
            "(2016), section I."
        ),
    )

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        return self._needed(conditions.acceleration, "accelerations of a moving axis")[:, None].astype(float)
