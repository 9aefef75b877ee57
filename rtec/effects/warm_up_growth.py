"""Growth that approaches an end value: a screw or scale that warms up, where no sensor says how warm it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rtec.effects.conditions import Conditions, Floats, no_spread
from rtec.effects.protocol import Amplitude, Card, Per, Quantity, Shape, Units, own_shape, parameter
from rtec.effects.warm_up import WarmShape, WarmUp


@dataclass(frozen=True, slots=True)
class WarmGrowthShape(WarmShape):
    """Also, whether the fixed point may lie elsewhere than at position zero."""

    elsewhere: bool = field(default=False, metadata=parameter(Quantity.CHOICE, "fixed point is not at zero"))


class WarmUpGrowth(WarmUp):
    """A first-order approach in time, in proportion to the way from a fixed point.

    Notes
    -----
    ``deviation = growth * (position - fixed point) * (1 - exp(-t / time_constant))``. The fixed point is position
    zero, or where the readings put it.

    Examples
    --------
    >>> t, x = np.array([0.0, 600.0, 6000.0]), np.full(3, 1000.0)
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(3, dtype=np.int64), time_s=t)
    >>> WarmUpGrowth().contribution(c, WarmGrowthShape(600.0), [1e-5]).round(5).tolist()
    [0.0, 0.00632, 0.01]
    """

    name = "warm_up_growth"
    amplitude = "growth"
    amplitude_per = Per.LENGTH
    shape_type = WarmGrowthShape
    card = Card(
        title="Growth during warm-up",
        formula="`growth · x · (1 − exp(−t/time_constant))`",
        needs="a time column, and a spread of positions",
        plot="The slope against position rises fast at first and levels off: runs fan out from the fixed bearing.",
        cause="Screw, scale or bed is heated by its own friction after the start and grows.",
        consequence="Lengths of the first parts of a shift differ from those of the later ones.",
        action="Warm the axis up by moving it, correct by a sensor on the screw, or use a scale.",
        invariant_to="direction and feed.",
        source="Yao et al. (2013), section 4.2; thesis, section 5.2; ISO 230-3.",
    )

    def untestable(self, conditions: Conditions) -> str | None:
        return no_spread(conditions) or super().untestable(conditions)

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return the time constants of a warm-up, fixed at position zero."""
        return [WarmGrowthShape(own_shape(one, WarmShape).time_constant) for one in super().shapes(conditions)]

    def tried(self, conditions: Conditions, shape: Shape) -> float:
        """Return the number of time constants; twice as many where the fixed point is chosen, too."""
        return super().tried(conditions, shape) * (2.0 if own_shape(shape, WarmGrowthShape).elsewhere else 1.0)

    def variants(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        return [replace(own_shape(shape, WarmGrowthShape), elsewhere=away) for away in (False, True)]

    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        return super().scan(conditions, shapes) * conditions.position

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return position times the approach, beside the approach where the fixed point is free."""
        free = own_shape(shape, WarmGrowthShape).elsewhere
        done = super().scan(conditions, [shape])[0, 0]
        return np.column_stack([conditions.position * done, done] if free else [conditions.position * done])

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return the growth, in um/m (arcsec/deg on a rotary axis), and the shift at position zero."""
        growth = super().amplitudes(shape, units)
        free = own_shape(shape, WarmGrowthShape).elsewhere
        return (*growth, Amplitude("at_zero", *units.shown)) if free else growth

    def summary(self, shape: Shape, amplitudes: Sequence[float], units: Units) -> tuple[tuple[str, float, str], ...]:
        """Return time constant and growth; the fixed point where it is free."""
        found = super().summary(shape, amplitudes, units)
        if not own_shape(shape, WarmGrowthShape).elsewhere or amplitudes[0] == 0.0:
            return found
        return (*found, ("fixed_point", -amplitudes[1] / amplitudes[0], units.position))
