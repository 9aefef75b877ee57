"""Compiled linear function: ``features, directions, value, noise``, then centre, coefficients and spread by rows."""

from __future__ import annotations

import math

from rtec._jit import kernel
from rtec.predictors._columns import Floats

HEAD = 4


@kernel
def linear_answer(numbers: Floats, columns: Floats, room: Floats, sd: Floats) -> float:
    """Return the value of one row, shape (features,), and write its standard deviation."""
    features = int(numbers[0])
    centre = numbers[HEAD : HEAD + features]
    slopes = numbers[HEAD + features : HEAD + 2 * features]
    found = float(numbers[2])
    for k in range(features):
        found += slopes[k] * (columns[k] - centre[k])
    square = numbers[3] * numbers[3]
    at = HEAD + 2 * features
    for _ in range(int(numbers[1])):
        row = numbers[at : at + features]
        total = 0.0
        for k in range(features):
            total += row[k] * (columns[k] - centre[k])
        square += total * total
        at += features
    sd[0] = math.sqrt(square)
    return found
