from __future__ import annotations
import numpy as np
from rtec.effects.protocol import *
class Scale(Effect):
    name = "scale"
    needs = "spread of positions"
    rivals = (Rival("cosine", "", permanent=True), Rival("drift", ""))
    def untestable(self, c):
        return None if c.places.size >= 2 else "one position only"
    def columns(self, c, shape):
        return c.position[:, None].astype(float)
    def amplitudes(self, shape, units):
        return (Amplitude("scale", "um/m", 1e6),)
