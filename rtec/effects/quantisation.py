"""Values that come in steps: of an encoder's counts, a display's digits, a file's decimals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Amplitude, Card, Effect, Quantity, Shape, Units, own_shape, parameter

VISIBLE = 0.05
"""Share of a step that the rounding of the positions must vary by, standard deviation; evenly spread it is 0.29."""
DECADES = (1.0, 2.0, 2.5, 5.0)


@dataclass(frozen=True, slots=True)
class QuantisationShape(Shape):
    """The step to which values are rounded."""

    step: float = field(default=1.0, metadata=parameter(Quantity.POSITION, "step"))


class Quantisation(Effect):
    """Rounding to the nearest step.

    Notes
    -----
    A continuous value u is recorded as ``q round(u / q)``, halves to the even neighbour. The column, for data made of
    positions alone, is the rounding error ``q round(x / q) - x`` of the commanded position x: where an axis
    comes to rest at whole counts it is a sawtooth over the positions, with the amplitude 1. It vanishes where all
    positions are whole steps.

    Examples
    --------
    >>> rounding_error(np.array([0.0121, -0.0029]), 0.003).round(9).tolist()
    [-0.0001, -0.0001]
    """

    name = "quantisation"
    shape_type = QuantisationShape
    card = Card(
        title="Quantisation",
        formula="`q · round(u/q) − u`",
        needs="three different values at least",
        plot=(
            "Values lie on a comb of equal steps; residuals fill a band one step wide or are a sawtooth against "
            "position."
        ),
        cause="Counts of the encoder, digits of a display, decimals of a file.",
        consequence=(
            "Nothing below a step shows; the noise floor is at least the step divided by the square root of 12."
        ),
        action="Record more digits, use finer counts, or accept the floor.",
        invariant_to="direction, feed, time and shifts by whole steps.",
        source="Yee (1992), position feedback signals: the resolution is a quarter of the square wave's cycle.",
    )

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return round steps that the positions show, from a hundred thousandth of the span to half a gap."""
        if conditions.places.size < 3:
            return []
        widest = float(np.median(np.diff(conditions.places))) / 2
        low = np.floor(np.log10(1e-5 * conditions.span))
        found = [part * 10.0**power for power in np.arange(low, np.log10(widest) + 1) for part in DECADES]
        off = {step: np.std(rounding_error(conditions.places, step)) for step in found if step <= widest}
        return [QuantisationShape(step) for step, spread in off.items() if spread > VISIBLE * step]

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        return rounding_error(conditions.position, own_shape(shape, QuantisationShape).step)[:, None]

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return the share of the rounding error, 1 where positions are rounded and observed in the same unit."""
        if units.observed == units.position:
            return (Amplitude("share", "", 1.0),)
        unit, factor = units.shown
        return (Amplitude("share", f"{unit}/{units.position}", factor),)


def rounding_error(values: Floats, step: float) -> Floats:
    """Return by how much values change when they are recorded in whole steps, shape (rows,)."""
    return np.round(values / step) * step - values
