"""An error proportional to position and to temperature: screw or scale grow with heat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rtec.effects._heat import AT_HEAT_RPM, SPINDLE, FollowsHeat, HeatShape, heats_of, rise_of, unchanging
from rtec.effects.conditions import Conditions, Floats, no_spread
from rtec.effects.protocol import Amplitude, Card, Per, Quantity, Shape, Units, own_shape, parameter


@dataclass(frozen=True, slots=True)
class GrowthShape(HeatShape):
    """Also, whether the fixed point may lie elsewhere than at position zero."""

    elsewhere: bool = field(default=False, metadata=parameter(Quantity.CHOICE, "fixed point is not at zero"))


class ThermalGrowth(FollowsHeat):
    """Expansion between position zero and the slide.

    Notes
    -----
    ``deviation = expansion * (position - fixed point) * (temperature - reference temperature)``; steel grows by 11 to
    12 um/m/K. The fixed point is position zero, or where the readings put it. What grows may lag behind the sensor,
    and a model may hold several of these terms, as of `ThermalShift`.

    Examples
    --------
    >>> x, heat = np.array([0.0, 1000.0]), {"temperature": np.array([22.0, 22.0])}
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(2, dtype=np.int64), temperatures=heat)
    >>> ThermalGrowth().contribution(c, GrowthShape(), [11.5e-6]).round(6).tolist()
    [0.0, 0.023]
    """

    name = "thermal_growth"
    shape_type = GrowthShape
    card = Card(
        title="Thermal growth",
        formula="`expansion · (x − fixed_point) · (T − T_ref)`",
        needs="a temperature column that changes by 0.5 K at least, or a spindle that changes its speed",
        plot=(
            "The slope of the deviation against position changes with temperature: runs fan out from the fixed "
            "bearing."
        ),
        cause="Screw, scale or bed expand between the fixed point and the slide; steel by about 11.5 um/m/K.",
        consequence="Lengths grow with temperature; a compensation made cold is wrong when the machine is warm.",
        action=(
            "Compensate by the temperature of screw or scale, cool the screw, or fix the scale at one point; measure "
            "at a stated temperature."
        ),
        invariant_to="direction, feed and order of the readings.",
        source="Yao et al. (2013), section 4.1; thesis, section 3.3; Yee (1992), introduction; ISO 1, ISO 230-3.",
    )

    def untestable(self, conditions: Conditions) -> str | None:
        if not heats_of(conditions):
            return unchanging(conditions)
        return no_spread(conditions) or unchanging(conditions)

    def variants(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        """Return the shape fixed at zero and elsewhere."""
        return [replace(own_shape(shape, GrowthShape), elsewhere=away) for away in (False, True)]

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return position times the rise of temperature, beside the rise where the fixed point is free."""
        own = own_shape(shape, GrowthShape)
        rise = rise_of(conditions, own.sensor, own.lag)
        columns = [conditions.position * rise, rise] if own.elsewhere else [conditions.position * rise]
        return np.column_stack(columns)

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return the coefficient of expansion, in um/m/K (arcsec/deg/K on a rotary axis), and the shift at zero.

        Where the heat of a spindle is followed, both are those of 1000 rev/min.
        """
        own, (unit, factor) = own_shape(shape, GrowthShape), units.per(Per.LENGTH)
        if own.sensor == SPINDLE:
            expansion, at_zero = Amplitude(AT_HEAT_RPM, unit, factor), Amplitude("at_zero", *units.shown)
        else:
            expansion = Amplitude("expansion", f"{unit}/K", factor)
            at_zero = Amplitude("at_zero", *units.per(Per.KELVIN))
        return (expansion, at_zero) if own.elsewhere else (expansion,)

    def summary(self, shape: Shape, amplitudes: Sequence[float], units: Units) -> tuple[tuple[str, float, str], ...]:
        """Return lag, where there is one, and expansion; the fixed point where it is free."""
        found = super().summary(shape, amplitudes, units)
        if not own_shape(shape, GrowthShape).elsewhere or amplitudes[0] == 0.0:
            return found
        return (*found, ("fixed_point", -amplitudes[1] / amplitudes[0], units.position))
