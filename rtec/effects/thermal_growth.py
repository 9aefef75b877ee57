"""An error proportional to position and to temperature: screw or scale grow with heat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rtec.effects import experiments
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Amplitude, Card, Effect, Quantity, Rival, Shape, Units, own_shape, parameter
from rtec.errors import ArgumentError, nearest

LEAST_CHANGE_K = 0.5


@dataclass(frozen=True, slots=True)
class HeatShape(Shape):
    """Which temperature is followed."""

    sensor: str = field(default="temperature", metadata=parameter(Quantity.TEXT, "sensor"))


def unchanging(conditions: Conditions) -> str | None:
    """Return why the data cannot show what heat does, or None."""
    if not conditions.temperatures:
        return "no temperature column"
    change = max(float(np.ptp(values)) for values in conditions.temperatures.values())
    if change >= LEAST_CHANGE_K:
        return None
    return f"the temperature changes by {change:.2g} degC only: at least {LEAST_CHANGE_K:g} needed"


def changing_sensors(conditions: Conditions) -> Sequence[HeatShape]:
    """Return the sensors whose temperature changes."""
    spread = {name: np.ptp(values) for name, values in conditions.temperatures.items()}
    return [HeatShape(name) for name, change in spread.items() if change >= LEAST_CHANGE_K]


def rise_of(conditions: Conditions, sensor: str) -> Floats:
    """Return what a sensor shows beyond the reference temperature, shape (rows,), in K.

    Raises
    ------
    ArgumentError
        No sensor of this name.
    """
    if sensor not in conditions.temperatures:
        known = conditions.temperatures
        hint = nearest(sensor, known) if known else "the data have no temperature column"
        raise ArgumentError("sensor", sensor, "the name of a temperature column", hint)
    rise: Floats = conditions.temperatures[sensor] - conditions.reference_temperature_degc
    return rise


class ThermalGrowth(Effect):
    """Expansion between position zero and the slide.

    Notes
    -----
    ``deviation = expansion * position * (temperature - reference temperature)``; steel grows by 11 to 12 um/m/K.

    References
    ----------
    Yao et al., section 4.1: temperatures of the machine's key parts among the factors that induce the error; thesis,
    section 3.3: temperatures as input of the correction. ISO 1: the reference is 20 degC.

    Examples
    --------
    >>> x, heat = np.array([0.0, 1000.0]), {"temperature": np.array([22.0, 22.0])}
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(2, dtype=np.int64), temperatures=heat)
    >>> ThermalGrowth().contribution(c, HeatShape(), [11.5e-6]).round(6).tolist()
    [0.0, 0.023]
    """

    name = "thermal_growth"
    needs = "a temperature column that changes by 0.5 K at least"
    shape_type = HeatShape
    in_time = True
    rivals = (
        Rival("pitch_map", experiments.COLD_AND_HOT),
        Rival("scale", experiments.COLD_AND_HOT),
        Rival("warm_up", experiments.OTHER_HEAT),
        Rival("thermal_shift", experiments.HOT_AT_BOTH_ENDS),
        Rival("warm_up_growth", experiments.OTHER_HEAT),
        Rival("refraction", experiments.OTHER_WEATHER),
    )
    card = Card(
        title="Thermal growth",
        plot=(
            "The slope of the deviation against position changes with temperature: cold and hot runs fan out from "
            "the fixed bearing."
        ),
        cause="Screw, scale or bed expand between the fixed point and the slide; steel by about 11.5 um/m/K.",
        consequence="Lengths grow with the temperature; a compensation made cold is wrong when the machine is warm.",
        action=(
            "Compensate with the temperature of the screw or scale, cool the screw, or use a scale that is mounted "
            "at one point; measure at a stated temperature."
        ),
        invariant_to="direction and feed, and the order of the readings: the same temperature gives the same error.",
        source=(
            "Yao et al. (003), section 4.1: temperatures of key parts as inputs of the error; thesis (000), section "
            "3.3; NISTIR 4832, introduction: expansion of bed and lead-screw. ISO 1 and ISO 230-3."
        ),
    )

    def untestable(self, conditions: Conditions) -> str | None:
        """Return why the data cannot show growth, or None."""
        if not conditions.temperatures:
            return unchanging(conditions)
        if conditions.time_is_coordinate:
            return "no positions: what grows with them cannot be seen"
        if conditions.places.size < 2:
            return "one position only"
        return unchanging(conditions)

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return the sensors whose temperature changes."""
        return changing_sensors(conditions)

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return position times the rise of temperature, shape (rows, 1)."""
        grown: Floats = (conditions.position * rise_of(conditions, own_shape(shape, HeatShape).sensor))[:, None]
        return grown

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return the coefficient of expansion, in um/m/K (arcsec/deg/K on a rotary axis)."""
        unit, factor = units.per_length
        return (Amplitude("expansion", f"{unit}/K", factor),)
