"""What the effects of temperature share: the sensor that is followed, a lag behind it, the rise that it shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Effect, Over, Quantity, Shape, Tunable, own_shape, parameter
from rtec.errors import ArgumentError, nearest

LEAST_CHANGE_K = 0.5
"""Of a temperature that shows anything."""
LAGS = (0.02, 0.05, 0.12)
"""Of what the measurement lasted, by which what grows is tried to lag behind a sensor."""
LONGEST_LAG = 0.25
"""Of what it lasted: what lags more follows the time, and not the temperature."""
SLOWEST = 1e-6
"""Share of a lag that passes between two readings, below which a ramp has arrived by half of that."""


@dataclass(frozen=True, slots=True)
class SensorShape(Shape):
    """Which temperature is followed."""

    sensor: str = field(default="temperature", metadata=parameter(Quantity.TEXT, "sensor"))

    @property
    def said_of_it(self) -> str:
        """The name of the sensor where it is one of several."""
        return self.sensor.removeprefix("temperature").removeprefix("_")


@dataclass(frozen=True, slots=True)
class HeatShape(SensorShape):
    """Also, by which time constant what grows lags behind the sensor."""

    lag: float = field(default=0.0, metadata=parameter(Quantity.CLOCK, "lag"))


_S = TypeVar("_S", bound=HeatShape)


def unchanging(conditions: Conditions) -> str | None:
    """Return why the data cannot show what heat does, or None."""
    if not conditions.temperatures:
        return "no temperature column"
    change = max(float(np.ptp(values)) for values in conditions.temperatures.values())
    if change >= LEAST_CHANGE_K:
        return None
    return f"the temperature changes by {change:.2g} degC only: at least {LEAST_CHANGE_K:g} needed"


def with_lags(conditions: Conditions, shape: _S) -> Sequence[_S]:
    """Return a shape that follows its sensor at once, and with lags where there is a time."""
    whole, _ = conditions.path
    if whole.time_s is None:
        return [shape]
    lasted = float(np.ptp(whole.time_s))
    return [shape, *(replace(shape, lag=share * lasted) for share in LAGS if lasted > 0.0)]


def rise_of(conditions: Conditions, sensor: str, lag: float = 0.0) -> Floats:
    """Return what a sensor shows beyond the reference temperature, shape (rows,), in K; behind it by a lag.

    Notes
    -----
    What lags is a body with one time constant, ``lag * dT/dt = sensor - T``, solved for a temperature that goes on
    straight lines from reading to reading, and in balance with the sensor at the first of them.

    Raises
    ------
    ArgumentError
        No sensor of this name, or a lag without time.
    """
    if sensor not in conditions.temperatures:
        known = conditions.temperatures
        hint = nearest(sensor, known) if known else "the data have no temperature column"
        raise ArgumentError("sensor", sensor, "the name of a temperature column", hint)
    if lag > 0.0:
        whole, rows = conditions.path
        if whole.time_s is None:
            raise ArgumentError("lag", lag, "0 for data without a time column")
        return _behind(whole.time_s, whole.temperatures[sensor], lag)[rows] - conditions.reference_temperature_degc
    return conditions.temperatures[sensor] - conditions.reference_temperature_degc


def _behind(time_s: Floats, heat: Floats, lag: float) -> Floats:
    """Return the temperature of a body that follows another in first order, shape (rows,)."""
    passed = np.maximum(np.diff(time_s), 0.0) / lag
    fade = np.exp(-passed)
    # of a ramp of height 1 over the time passed, what has arrived at its end
    arrived = np.where(passed > SLOWEST, 1.0 - (1.0 - fade) / np.maximum(passed, SLOWEST), passed / 2.0)
    steps = np.diff(heat)
    found = np.empty(heat.size)
    found[0] = state = heat[0]
    for i, (kept, came, step, begin) in enumerate(zip(fade, arrived, steps, heat[:-1], strict=True), start=1):
        found[i] = state = begin + step * came + (state - begin) * kept
    return found


class FollowsHeat(Effect):
    """Base of what grows with a temperature: it may lag behind its sensor, and several parts follow a sensor each."""

    over = Over.TEMPERATURE
    in_time = True
    shape_type: type[HeatShape]

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return the sensors whose temperature changes."""
        heats = conditions.temperatures.items()
        return [self.shape_type(name) for name, values in heats if np.ptp(values) >= LEAST_CHANGE_K]

    def tried(self, conditions: Conditions, shape: Shape) -> float:
        """Return the sensors; times the forms of each where it is not the plain one."""
        own = own_shape(shape, HeatShape)
        forms = 1 if own == self.shape_type(own.sensor) else len(self.variants(conditions, shape))
        return float(len(self.shapes(conditions)) * forms)

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        lag = own_shape(shape, HeatShape).lag
        if lag == 0.0:
            return ()
        longest = LONGEST_LAG * float(np.ptp(conditions.path[0].clock))
        return (Tunable("lag", lag / 2.0, max(min(2.0 * lag, longest), lag)),)
