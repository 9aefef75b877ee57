"""What the effects of temperature share: the sensor that is followed, a lag behind it, the rise that it shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Amplitude, Effect, Over, Quantity, Shape, Tunable, Units, own_shape, parameter
from rtec.errors import ArgumentError, nearest

LEAST_CHANGE_K = 0.5
"""Of a temperature that shows anything."""
LAGS = (0.008, 0.02, 0.05, 0.12, 0.25)
"""Of what the measurement lasted, by which what grows is tried to lag behind a sensor: what lags more follows the
time, and not the temperature."""
SPINDLE = "spindle"
"""Sensor that is the heat of a spindle: `spindle_heat`."""
HEAT_POWER, HEAT_RPM = 5.0 / 3.0, 1000.0
"""Of a bearing: its loss grows as the speed to this power, and counts as 1 at this speed."""
AT_HEAT_RPM = f"at_{HEAT_RPM:.0f}_rpm"
"""Amplitude of what follows the heat of a spindle."""
SLOWEST = 1e-6
"""Share of a lag that passes between two readings, below which a ramp has arrived by half of that."""


@dataclass(frozen=True, slots=True)
class SensorShape(Shape):
    """Which temperature is followed, or `SPINDLE`."""

    sensor: str = field(default="temperature", metadata=parameter(Quantity.TEXT, "sensor"))

    @property
    def said_of_it(self) -> str:
        """The name of the sensor where it is one of several."""
        return self.sensor.removeprefix("temperature").removeprefix("_")


@dataclass(frozen=True, slots=True)
class HeatShape(SensorShape):
    """Also, by which time constant what grows lags behind the sensor."""

    lag: float = field(default=0.0, metadata=parameter(Quantity.CLOCK, "lag"))


def heats_of(conditions: Conditions) -> Mapping[str, Floats]:
    """Return what an axis can be warmed by: temperatures in degC, and the heat of its spindle, by the name of each.

    Notes
    -----
    Palmgren: the fluid friction of a bearing grows as the speed to the power of 2/3, its loss as that to 5/3.

    Examples
    --------
    >>> x = np.zeros(2)
    >>> run, speed = np.ones(2, dtype=np.int64), np.array([0.0, 8000.0])
    >>> c = Conditions(position=x, position_unit="mm", run=run, spindle_rpm=speed)
    >>> heats_of(c)["spindle"].round(9).tolist()
    [0.0, 32.0]
    """
    if conditions.spindle_rpm is None:
        return conditions.temperatures
    return {**conditions.temperatures, SPINDLE: (np.abs(conditions.spindle_rpm) / HEAT_RPM) ** HEAT_POWER}


def unchanging(conditions: Conditions) -> str | None:
    """Return why the data cannot show what heat does, or None."""
    heats = heats_of(conditions)
    if not heats:
        return "no temperature column"
    if any(map(_changes, heats, heats.values())):
        return None
    if not conditions.temperatures:
        return "the spindle never changes its speed, and there is no temperature column"
    change = max(float(np.ptp(values)) for values in conditions.temperatures.values())
    return f"the temperature changes by {change:.2g} degC only: at least {LEAST_CHANGE_K:g} needed"


def _changes(name: str, values: Floats) -> bool:
    return bool(np.ptp(values) > 0.0 if name == SPINDLE else np.ptp(values) >= LEAST_CHANGE_K)


def lags_of(conditions: Conditions) -> tuple[float, ...]:
    """Return by how much what grows is tried to lag behind a sensor: not at all, and more where there is a time."""
    whole, _ = conditions.path
    lasted = 0.0 if whole.time_s is None else float(np.ptp(whole.time_s))
    return (0.0, *(share * lasted for share in LAGS if lasted > 0.0))


def rise_of(conditions: Conditions, sensor: str, lag: float = 0.0) -> Floats:
    """Return what a sensor shows beyond the reference temperature, shape (rows,), in K; behind it by a lag.

    Notes
    -----
    What lags is a body with one time constant, ``lag * dT/dt = sensor - T``, in balance with the sensor at the first
    reading. A temperature goes on straight lines from reading to reading; a spindle keeps its speed until the next.

    Raises
    ------
    ArgumentError
        No sensor of this name, or a lag without time.
    """
    heats, whole = heats_of(conditions), conditions.path[0]
    if sensor not in heats:
        hint = nearest(sensor, heats) if heats else "the data have no temperature column"
        raise ArgumentError("sensor", sensor, "the name of a temperature column", hint)
    if lag == 0.0:
        heat = heats[sensor]
    elif whole.time_s is None:
        raise ArgumentError("lag", lag, "0 for data without a time column")
    else:
        heat = _behind(whole.time_s, heats_of(whole)[sensor], lag, held=sensor == SPINDLE)[conditions.path[1]]
    return heat if sensor == SPINDLE else heat - conditions.reference_temperature_degc


def _behind(time_s: Floats, heat: Floats, lag: float, *, held: bool) -> Floats:
    """Return the temperature of a body that follows another in first order, shape (rows,)."""
    passed = np.maximum(np.diff(time_s), 0.0) / lag
    fade = np.exp(-passed)
    # of a ramp of height 1 over the time passed, what has arrived at its end
    arrived = np.where(passed > SLOWEST, 1.0 - (1.0 - fade) / np.maximum(passed, SLOWEST), passed / 2.0)
    came = np.zeros_like(fade) if held else np.diff(heat) * arrived
    return _followed(fade, heat[:-1] * (1.0 - fade) + came, float(heat[0]))


def _followed(kept: Floats, came: Floats, begin: float) -> Floats:
    """Return a state that keeps a share of itself from step to step, and to which something comes."""
    found = np.empty(kept.size + 1)
    found[0] = state = begin
    for i, (share, more) in enumerate(zip(kept.tolist(), came.tolist(), strict=True), start=1):
        found[i] = state = state * share + more
    return found


class FollowsHeat(Effect):
    """Base of what grows with a temperature: it may lag behind its sensor, and several parts follow a sensor each."""

    over = Over.TEMPERATURE
    in_time = True
    shape_type: type[HeatShape]

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return each sensor that changes, at once and with lags."""
        heats, lags = heats_of(conditions), lags_of(conditions)
        return [self.shape_type(name, lag) for name in heats if _changes(name, heats[name]) for lag in lags]

    def tried(self, conditions: Conditions, shape: Shape) -> float:
        """Return the sensors; times the forms of each where it is not the plain one."""
        own, every = own_shape(shape, HeatShape), self.shapes(conditions)
        sensors = len(every) / len(lags_of(conditions))
        return sensors if own == self.shape_type(own.sensor) else len(every) * len(self.variants(conditions, own))

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        lag = own_shape(shape, HeatShape).lag
        longest = lags_of(conditions)[-1]
        return () if lag == 0.0 else (Tunable("lag", lag / 2.0, max(min(2.0 * lag, longest), lag)),)

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return what a kelvin does, or the heat of a spindle at 1000 rev/min once everything is in balance."""
        if own_shape(shape, HeatShape).sensor == SPINDLE:
            return (Amplitude(AT_HEAT_RPM, *units.shown),)
        return super().amplitudes(shape, units)
