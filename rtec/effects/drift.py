from __future__ import annotations
import numpy as np
from rtec.effects.protocol import *
class Drift(Effect):
    name = "drift"
    needs = "time or row order, repeats"
    in_time = True
    def untestable(self, c):
        return None if np.ptp(c.clock) > 0 else "one moment only"
    def columns(self, c, shape):
        return c.clock[:, None].astype(float)
    def amplitudes(self, shape, units):
        return (Amplitude("rate", units.shown[0] + "/" + units.clock, units.shown[1]),)
