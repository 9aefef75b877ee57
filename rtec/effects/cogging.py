"""A force periodic in position: magnets that pull at the teeth of a motor's iron."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtec.effects._harmonics import Waves, WavesShape
from rtec.effects._periodic import Periodic, families
from rtec.effects.conditions import Conditions
from rtec.effects.frequency_grid import frequencies, stated_periods
from rtec.effects.protocol import Card, Observable, Shape, own_shape

PARTS = (1, 2, 3, 4, 5, 6)
"""Which harmonic of its family the strongest line may be."""
MOST_HARMONICS = 12
"""Magnets and slots give more of them than a screw does."""


class Cogging(Waves, Periodic):
    """A Fourier series in position; a model may hold several families (poles and slots).

    Notes
    -----
    ``force = sum over k of sin_k sin(2 pi k x / period) + cos_k cos(2 pi k x / period)``, for moving data and for
    positions held. On a rotary axis whole numbers of cycles a turn are preferred: a motor looks the same after a
    turn.

    Examples
    --------
    >>> x = np.array([0.0, 3.0, 6.0])
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(3, dtype=np.int64))
    >>> Cogging().contribution(c, WavesShape(12.0), [0.25, 0.0]).round(9).tolist()
    [0.0, 0.25, 0.0]
    """

    name = "cogging"
    observable = Observable.DRIVE
    card = Card(
        title="Cogging",
        formula="as `cyclic`, in families",
        needs="a period that the positions resolve and do not alias: six positions at least, moving or held",
        plot=(
            "Force is a wave against position with the period of poles and slots, the same in both directions and at "
            "every slow speed."
        ),
        cause="Magnets pull at the teeth of the motor's iron core.",
        consequence="Ripple of speed at slow feeds; a following error with the pole pitch.",
        action=(
            "Map the current against position at slow constant speed or at rest and feed it forward; skewed magnets "
            "or an ironless motor remove it."
        ),
        invariant_to="direction, speed, time and shifts by whole periods.",
        source=(
            "Erwinski et al. (2019), section 3, Figure 6: a current that repeats every 12 mm, the distance of the "
            "poles."
        ),
    )

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return single waves: the scan over frequencies, whole cycles a turn, the stated pitch and its fractions."""
        scanned = np.concatenate([frequencies(conditions), 1.0 / stated_periods(conditions)])
        return [WavesShape(period) for period in (1.0 / scanned).tolist()]

    def variants(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        """Return families of harmonics that hold the wave found, of whole cycles a turn where that is possible."""
        found = families(conditions, 1.0 / own_shape(shape, WavesShape).period, PARTS, MOST_HARMONICS)
        return [WavesShape(1.0 / base, harmonics) for base, harmonics in found]
