from __future__ import annotations
import numpy as np
from rtec.effects.protocol import *
from rtec.effects.conditions import Conditions, Floats

class Offset(Effect):
    name = "offset"
    needs = "nothing"
    def columns(self, c, shape):
        return np.ones((c.rows, 1))
    def amplitudes(self, shape, units):
        return (Amplitude("offset", *units.shown),)
