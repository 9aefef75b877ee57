"""Compiled part of the hysteresis: elements that follow the way until they slip, each at a limit of its own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import kernel
from rtec.effects.conditions import Floats


@kernel
def bend(
    position: Floats, begins: NDArray[np.bool_], first: Floats, slips: Floats, bent: Floats, out: Floats
) -> None:
    """Fill ``out`` (distances, rows) with the mean force of the elements over that at which each slips, from -1 to 1.

    ``slips``, the way over which an element bends until it slips, has shape (distances, elements); ``first`` is the
    share by which every element is bent where the way begins (``begins``), shape (distances,). ``bent``, shape
    (elements,), holds the share by which each is bent.
    """
    for k in range(slips.shape[0]):
        for i in range(position.size):
            total = 0.0
            way = 0.0 if begins[i] else position[i] - position[i - 1]
            for e in range(bent.size):
                state = first[k] if begins[i] else bent[e] + way / slips[k, e]
                bent[e] = min(max(state, -1.0), 1.0)
                total += bent[e]
            out[k, i] = total / bent.size
