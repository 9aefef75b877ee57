"""Compiled part of the hysteresis: elements that follow the way until they slip, each at a limit of its own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import kernel


@kernel
def bend(
    position: NDArray[np.float64],
    begins: NDArray[np.bool_],
    first: NDArray[np.float64],
    limits: NDArray[np.float64],
    bent: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Fill ``out`` (distances, rows) with the mean of the elements over the mean of their limits, from -1 to 1.

    ``limits`` has shape (distances, elements); ``first`` is the share of its limit by which every element is bent
    where the way begins (``begins``), shape (distances,). ``bent``, shape (elements,), holds how far each is bent.
    """
    for k in range(limits.shape[0]):
        whole = 0.0
        for e in range(bent.size):
            bent[e] = 0.0
            whole += limits[k, e]
        for i in range(position.size):
            total = 0.0
            way = 0.0 if begins[i] else position[i] - position[i - 1]
            for e in range(bent.size):
                most = limits[k, e]
                state = first[k] * most if begins[i] else bent[e] + way
                bent[e] = min(max(state, -most), most)
                total += bent[e]
            out[k, i] = total / whole
