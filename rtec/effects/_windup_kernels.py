"""Compiled part of the wind-up: a first-order element over the way travelled, which remembers what it was."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rtec._jit import kernel
from rtec.effects.conditions import Floats


@kernel
def wind_up(position: Floats, begins: NDArray[np.bool_], first: Floats, distance: Floats, out: Floats) -> None:
    """Fill ``out`` (distances, rows) with the share that is wound up, from -1 to 1.

    ``first`` is the share with which each motion begins, one number for each distance times the direction at first,
    shape (distances, rows); only its values where ``begins`` is true are read.
    """
    for k in range(distance.size):
        share = 0.0
        for i in range(position.size):
            if begins[i]:
                share = first[k, i]
            else:
                way = position[i] - position[i - 1]
                if way > 0.0:
                    share = 1.0 - (1.0 - share) * math.exp(-way / distance[k])
                elif way < 0.0:
                    share = (1.0 + share) * math.exp(way / distance[k]) - 1.0
            out[k, i] = share
