"""An error that approaches an end value: the machine warms up after it was switched on or sped up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from rtec.effects._ladders import ladder
from rtec.effects.conditions import Conditions, Floats, scheduled, too_few_moments
from rtec.effects.protocol import Card, Over, Quantity, ScannedEffect, Shape, Tunable, own_shape, parameter

FEWEST_MOMENTS = 4


@dataclass(frozen=True, slots=True)
class WarmShape(Shape):
    """How fast the end is approached."""

    time_constant: float = field(default=1.0, metadata=parameter(Quantity.CLOCK, "time constant"))


class WarmUp(ScannedEffect):
    """A first-order approach in time.

    Notes
    -----
    ``deviation = final * (1 - exp(-t / time_constant))``: the solution of ``d(deviation)/dt = (final - deviation) /
    time_constant`` from nothing at the first reading.

    Examples
    --------
    >>> t = np.array([0.0, 600.0, 6000.0])
    >>> c = Conditions(position=np.zeros(3), position_unit="mm", run=np.ones(3, dtype=np.int64), time_s=t)
    >>> WarmUp().contribution(c, WarmShape(600.0), [0.01]).round(5).tolist()
    [0.0, 0.00632, 0.01]
    """

    name = "warm_up"
    amplitude = "final"
    over = Over.TIME
    shape_type = WarmShape
    in_time = True
    data_checks = (partial(too_few_moments, fewest=FEWEST_MOMENTS), scheduled)
    card = Card(
        title="Warm-up",
        formula="`final · (1 − exp(−t/time_constant))`",
        needs="a time column",
        plot="Against time the deviation rises fast at first and levels off.",
        cause="Spindle, motor, nut or hydraulics heat the structure after the start, with one time constant.",
        consequence="The first parts of a shift differ from the later ones.",
        action=(
            "Warm the machine up before measuring and working; record temperatures, so that growth can be told from "
            "time."
        ),
        invariant_to="position, direction and feed.",
        source=(
            "Yao et al. (2013), section 4.2: 2.5 h of running, 2 h of cooling; Yee (1992), introduction; ISO 230-3."
        ),
    )

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return time constants from a fiftieth of the measurement to half of it; longer: collinear with drift."""
        lasted = float(np.ptp(conditions.clock))
        return [WarmShape(constant) for constant in ladder(lasted / 50, lasted / 2)] if lasted > 0 else []

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        """Return the time constant, free by a half more or less, up to what was measured."""
        constant = own_shape(shape, WarmShape).time_constant
        lasted = max(float(np.ptp(conditions.clock)), constant)
        return (Tunable("time_constant", constant / 1.5, min(constant * 1.5, lasted)),)

    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        time = self._needed(conditions.time_s, "a time column")
        constants = np.array([own_shape(shape, WarmShape).time_constant for shape in shapes])
        done: Floats = -np.expm1(-time / constants[:, None])
        return done[:, None, :]
