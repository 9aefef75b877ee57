from __future__ import annotations
from dataclasses import dataclass, field, replace
import numpy as np
from rtec.effects.protocol import *
@dataclass(frozen=True, slots=True)
class CyclicShape(Shape):
    period: float = field(default=1.0, metadata=parameter(Quantity.POSITION, "period"))
    harmonics: int = field(default=1, metadata=parameter(Quantity.COUNT, "harmonics"))
    by_direction: bool = field(default=False, metadata=parameter(Quantity.CHOICE, "by_direction"))
def frequencies(c):
    places = c.places
    if places.size < 6: return np.empty(0)
    gaps = np.diff(places)
    step = float(np.median(gaps))
    regular = np.abs(gaps - step).max() < 0.05 * step
    top = 0.5 / step if regular else 1.0 / step
    top = min(top*(1-0.5/places.size), 1500/c.span)
    return np.arange(1.0 / c.span, top, 0.2 / c.span)
class Cyclic(Effect):
    name = "cyclic"
    shape_type = CyclicShape
    contains = frozenset({"eccentricity", "interpolation"})
    def untestable(self, c):
        return None if frequencies(c).size else "too few positions"
    def shapes(self, c):
        return [CyclicShape(1.0 / f) for f in frequencies(c)]
    def variants(self, c, shape):
        f = frequencies(c)
        top = f[-1]
        out = []
        for m in (1, 2, 3, 4, 5):
            base = 1 / shape.period / m
            if base < 1.0 / c.span * 0.99: break
            for h in range(m, 9):
                if h * base > top * 1.01: break
                out.append(CyclicShape(1 / base, h, False))
                if c.both_directions: out.append(CyclicShape(1 / base, h, True))
        return out
    def tunables(self, c, shape):
        d = 0.3 * shape.period**2 / c.span
        return (Tunable("period", shape.period - d, shape.period + d),)
    def columns(self, c, shape):
        angle = 2 * np.pi * c.position / shape.period
        cols = []
        for h in range(1, shape.harmonics + 1):
            cols += [np.sin(h * angle), np.cos(h * angle)]
        if shape.by_direction:
            cols += [x * c.direction for x in cols]
        return np.stack(cols, 1)
    def scan(self, c, shapes):
        f = np.array([1 / s.period for s in shapes])
        a = (2 * np.pi * f)[:, None] * c.position
        return np.stack([np.sin(a), np.cos(a)], 1)
    def amplitudes(self, shape, units):
        return tuple(Amplitude(f"a{i}", *units.shown) for i in range(2 * shape.harmonics * (1 + shape.by_direction)))
