"""Geometric ladders of scan values: neighbours so near that an exponential between them is not missed."""

from __future__ import annotations

import numpy as np

RATIO = 1.25
"""Of neighbours, at most."""


def ladder(low: float, high: float, ratio: float = RATIO) -> list[float]:
    """Return values from ``low`` to ``high``, each at most ``ratio`` times the one before.

    Examples
    --------
    >>> [round(value, 2) for value in ladder(1.0, 2.0)]
    [1.0, 1.19, 1.41, 1.68, 2.0]
    """
    steps = max(int(np.ceil(np.log(high / low) / np.log(ratio))), 1)
    return [float(value) for value in np.geomspace(low, high, steps + 1)]
