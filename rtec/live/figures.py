"""Figures of a live run: how long answers took, how late turns were."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def spread_ms(values: Sequence[float], *, per_ms: float) -> dict[str, float | int | None]:
    """Return number, median, 99th percentile and maximum, in ms.

    Parameters
    ----------
    values
        In any unit.
    per_ms
        How many of that unit make a millisecond.

    Examples
    --------
    >>> spread_ms([0.001, 0.002, 0.009], per_ms=0.001)
    {'number': 3, 'median_ms': 2.0, 'p99_ms': 8.86, 'max_ms': 9.0}
    """
    if not len(values):
        return {"number": 0, "median_ms": None, "p99_ms": None, "max_ms": None}
    ms = np.asarray(values, dtype=np.float64) / per_ms
    median, late = np.percentile(ms, [50, 99])
    return {
        "number": int(ms.size),
        "median_ms": round(float(median), 4),
        "p99_ms": round(float(late), 4),
        "max_ms": round(float(ms.max()), 4),
    }
