"""An error that comes back every signal period of the scale: its sine and cosine are no perfect ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from rtec.effects._harmonics import Waves, WavesShape
from rtec.effects.conditions import Conditions
from rtec.effects.frequency_grid import phases_seen
from rtec.effects.protocol import Card, Quantity, Shape, parameter

FEWEST_PHASES = 4
HARMONICS = 2
"""Offsets of the two signals come once a signal period, unequal amplitudes and phase errors twice."""


@dataclass(frozen=True, slots=True)
class InterpolationShape(WavesShape):
    """Signal period of the scale, and how many harmonics of it."""

    period: float = field(default=0.02, metadata=parameter(Quantity.POSITION, "signal period"))
    harmonics: int = field(default=HARMONICS, metadata=parameter(Quantity.COUNT, "harmonics"))


class Interpolation(Waves):
    """A Fourier series with the scale's stated signal period.

    Notes
    -----
    ``deviation = sum over k of sin_k sin(2 pi k x / period) + cos_k cos(2 pi k x / period)``, k = 1 (offset of a
    signal) and k = 2 (unequal amplitudes, phase other than 90 degrees).

    Examples
    --------
    >>> import numpy as np
    >>> x = np.array([0.0, 0.005, 0.01])
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(3, dtype=np.int64), signal_period=0.02)
    >>> shape = Interpolation().shapes(c)[0]
    >>> Interpolation().contribution(c, shape, [1e-4, 0.0, 0.0, 0.0]).round(9).tolist()
    [0.0, 0.0001, 0.0]
    """

    name = "interpolation"
    shape_type = InterpolationShape
    card = Card(
        title="Interpolation error of the scale",
        formula="as `cyclic`, with the stated signal period, two harmonics",
        needs="a stated signal period, which the positions show at four phases at least",
        plot=(
            "A wave with the signal period of the scale (micrometres to 0.1 mm), in the spectrum at one and two "
            "cycles a period."
        ),
        cause=(
            "Offset, unequal amplitudes or phase error of the sine and cosine signals: dirt, gap or tilt of the "
            "reading head."
        ),
        consequence="Ripple on surfaces and of speed at slow feeds.",
        action="Clean and adjust the reading head; trim offset, gain and phase.",
        invariant_to="shifts by whole signal periods, direction, slow feeds and time.",
        source="Yee (1992), position feedback signals: two signals 90 degrees apart.",
    )

    def untestable(self, conditions: Conditions) -> str | None:
        period = conditions.signal_period
        if period is None:
            return "no scale_signal_period is stated"
        seen = phases_seen(conditions.places, period)
        if seen >= FEWEST_PHASES:
            return None
        where = f"the scale's signal period ({period:g} {conditions.position_unit})"
        if seen == 1:
            return f"targets lie at whole multiples of {where}: an interpolation error looks constant here"
        return f"targets lie at {seen} phases of {where} only: at least {FEWEST_PHASES} needed"

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        period = conditions.signal_period
        return [] if period is None else [InterpolationShape(period)]
