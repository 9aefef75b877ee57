from __future__ import annotations
from dataclasses import dataclass, field, replace
import numpy as np
from rtec.effects.protocol import *
@dataclass(frozen=True, slots=True)
class WarmShape(Shape):
    time_constant: float = field(default=1.0, metadata=parameter(Quantity.CLOCK, "time constant"))
class WarmUp(Effect):
    name = "warm_up"
    shape_type = WarmShape
    contains = frozenset({"drift"})
    in_time = True
    def untestable(self, c):
        return None if c.time_s is not None else "no time column"
    def shapes(self, c):
        s = np.ptp(c.clock)
        return [WarmShape(t) for t in np.geomspace(s / 50, s * 1.0, 24)]
    def columns(self, c, shape):
        return (1 - np.exp(-c.clock / shape.time_constant))[:, None]
    def tunables(self, c, shape):
        return (Tunable("time_constant", shape.time_constant / 1.5, shape.time_constant * 1.5),)
    def amplitudes(self, shape, units):
        return (Amplitude("final", *units.shown),)
@dataclass(frozen=True, slots=True)
class StepShape(Shape):
    moment: float = field(default=1.0, metadata=parameter(Quantity.CLOCK, "moment"))
class LostCounts(Effect):
    name = "lost_counts"
    shape_type = StepShape
    in_time = True
    repeatable = True
    def shapes(self, c):
        t = c.clock
        step = max(1, t.size // 3000)
        return [StepShape(float((t[i - 1] + t[i]) / 2)) for i in range(2, t.size - 1, step)]
    def untestable(self, c):
        return None if c.time_s is not None else "no time column"
    def columns(self, c, shape):
        return (c.clock > shape.moment)[:, None].astype(float)
    def amplitudes(self, shape, units):
        return (Amplitude("step", *units.shown),)
@dataclass(frozen=True, slots=True)
class HeatShape(Shape):
    sensor: str = field(default="temperature", metadata=parameter(Quantity.TEXT, "sensor"))
class ThermalGrowth(Effect):
    name = "thermal_growth"
    shape_type = HeatShape
    in_time = True
    def untestable(self, c):
        if not c.temperatures: return "no temperature column"
        return None if max(np.ptp(v) for v in c.temperatures.values()) > 0.1 else "constant temp"
    def shapes(self, c):
        return [HeatShape(k) for k in c.temperatures]
    def columns(self, c, shape):
        return (c.position * (c.temperatures[shape.sensor] - c.reference_temperature_degc))[:, None]
    def amplitudes(self, shape, units):
        return (Amplitude("expansion", "um/m/K", 1e6),)
@dataclass(frozen=True, slots=True)
class WindupShape(Shape):
    distance: float = field(default=1.0, metadata=parameter(Quantity.POSITION, "distance"))
class Windup(Effect):
    name = "windup"
    shape_type = WindupShape
    def untestable(self, c):
        if not c.both_directions: return "one direction only"
        return None if len(self.shapes(c)) else "no dense points"
    def shapes(self, c):
        d = np.unique(np.round(c.since_reversal, 9)); d = d[d > 0]
        if d.size < 4: return []
        return [WindupShape(t) for t in np.geomspace(d[0] * 0.5, c.span / 2, 16)]
    def columns(self, c, shape):
        return (c.direction / 2 * (1 - np.exp(-c.since_reversal / shape.distance)))[:, None]
    def tunables(self, c, shape):
        return (Tunable("distance", shape.distance / 1.5, shape.distance * 1.5),)
    def amplitudes(self, shape, units):
        return (Amplitude("windup", *units.shown),)
class ServoLag(Effect):
    name = "servo_lag"
    def untestable(self, c):
        return None if c.velocity is not None and np.abs(c.velocity).max() > 0 else "no velocity or feed column"
    def columns(self, c, shape):
        return -c.velocity[:, None]
    def amplitudes(self, shape, units):
        return (Amplitude("lag", "ms", 1e3),)
class AccelerationLag(Effect):
    name = "acceleration_lag"
    def untestable(self, c):
        return None if c.acceleration is not None and np.abs(c.acceleration).max() > 0 else "no moving data"
    def columns(self, c, shape):
        return -c.acceleration[:, None]
    def amplitudes(self, shape, units):
        return (Amplitude("lag", "ms^2", 1e6),)
