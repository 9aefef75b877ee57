"""An error that grows steadily in time: instrument, support or axis move slowly against each other."""

from __future__ import annotations

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Card, Effect, Over, Per, Shape


class Drift(Effect):
    """A straight line in time, or in row order where the data have no time.

    Notes
    -----
    ``deviation = rate * clock``, with the clock in seconds since the first reading or in readings.

    Examples
    --------
    >>> c = Conditions(position=np.zeros(3), position_unit="mm", run=np.ones(3, dtype=np.int64))
    >>> Drift().contribution(c, Shape(), [0.5]).tolist()
    [0.0, 0.5, 1.0]
    """

    name = "drift"
    amplitude = "rate"
    amplitude_per = Per.CLOCK
    over = Over.TIME
    in_time = True
    card = Card(
        title="Drift",
        formula="`rate · t`",
        needs="time or row order, with repeats",
        plot="Repeats of a target move steadily: a straight line against time or row order.",
        cause="Support or optics of the instrument creep, room temperature changes slowly, a clamp relaxes.",
        consequence="Time is mixed with position; repeatability looks worse than it is.",
        action=(
            "Return to a datum target often, shorten the measurement, shield it from draughts, let the laser settle."
        ),
        invariant_to="position, direction and feed.",
        source=(
            "ISO 230-2 and ISO 230-3 ask for a check of drift; thesis, section 5.2: four passes took almost 20 hours."
        ),
    )

    def untestable(self, conditions: Conditions) -> str | None:
        return None if np.ptp(conditions.clock) > 0 else "one moment only"

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        return conditions.clock[:, None].astype(float)
