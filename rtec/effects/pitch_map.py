from __future__ import annotations
from dataclasses import dataclass, field
import numpy as np
from rtec.effects.protocol import *
from rtec.effects._smooth import node_ladder, smooth_columns
@dataclass(frozen=True, slots=True)
class MapShape(Shape):
    nodes: tuple[float, ...] = field(default=(), metadata=parameter(Quantity.POSITION, "nodes"))
class PitchMap(Effect):
    name = "pitch_map"
    shape_type = MapShape
    contains = frozenset({"offset", "scale", "cosine", "cyclic", "eccentricity", "interpolation"})
    def untestable(self, c):
        return None if node_ladder(c) else f"{c.places.size} positions only"
    def shapes(self, c):
        return [MapShape(n) for n in node_ladder(c)]
    def columns(self, c, shape):
        return smooth_columns(c.position, shape.nodes)
    def freedom(self, shape): return 0
    def amplitudes(self, shape, units):
        return tuple(Amplitude(f"at_{x:g}", *units.shown) for x in shape.nodes)
class BacklashMap(PitchMap):
    name = "backlash_map"
    contains = frozenset({"backlash", "windup"})
    def untestable(self, c):
        return super().untestable(c) or (None if c.both_directions else "one direction only")
    def columns(self, c, shape):
        return smooth_columns(c.position, shape.nodes) * (c.direction / 2)[:, None]
