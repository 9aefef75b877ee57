from __future__ import annotations
import numpy as np
from rtec.effects.protocol import *
class Backlash(Effect):
    name = "backlash"
    needs = "both directions"
    def untestable(self, c):
        return None if c.both_directions else "one direction only"
    def columns(self, c, shape):
        return c.direction[:, None] / 2
    def amplitudes(self, shape, units):
        return (Amplitude("backlash", *units.shown),)
