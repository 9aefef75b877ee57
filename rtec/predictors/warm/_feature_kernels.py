"""Compiled lags: what follows a course in first order, exactly, step by step."""

from __future__ import annotations

import math

from rtec._jit import kernel, step
from rtec.predictors._columns import Floats

SHORTEST = 1e-6
"""Share of a lag that passes in a step, below which a ramp has arrived by half of that."""


@step
def followed(state: float, before: float, after: float, passed: float, held: bool) -> float:
    """Return the state after ``passed`` time constants along a ramp or, where the value is held, at ``before``."""
    kept = math.exp(-passed)
    if held:
        return before + (state - before) * kept
    arrived = 1.0 + math.expm1(-passed) / passed if passed > SHORTEST else passed / 2.0
    return before + (after - before) * arrived + (state - before) * kept


@kernel
def follow_course(time_s: Floats, values: Floats, lag_s: float, held: bool, found: Floats) -> None:
    """Write what follows ``values`` into ``found``, in balance at the first row."""
    found[0] = values[0]
    for i in range(1, values.size):
        passed = max(time_s[i] - time_s[i - 1], 0.0) / lag_s
        found[i] = followed(found[i - 1], values[i - 1], values[i], passed, held)
