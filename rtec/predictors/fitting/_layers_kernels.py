"""What neurons do along a direction of the weights."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rtec._jit import kernel


@kernel
def bend(
    level: npt.NDArray[np.float64], first: npt.NDArray[np.float64], second: npt.NDArray[np.float64], given: bool
) -> None:
    """Turn first and second derivatives of what neurons are given into those of their levels, where they stand.

    All of shape (neurons, readings). Without ``given``, the second derivatives of what they are given are zero.
    """
    for j in range(level.shape[0]):
        for i in range(level.shape[1]):
            slope = level[j, i] * (1.0 - level[j, i])
            rise = first[j, i]
            turn = second[j, i] if given else 0.0
            first[j, i] = slope * rise
            second[j, i] = slope * (turn + (1.0 - 2.0 * level[j, i]) * rise * rise)
