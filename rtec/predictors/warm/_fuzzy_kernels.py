"""Compiled fuzzy network.

``features, components, rules, directions, whether the minimum counts, noise``; centre of the features; axes by
components; centres and widths by rules; consequents by rules, each a constant and slopes; spread by directions.
"""

from __future__ import annotations

import math

from rtec._jit import kernel
from rtec.predictors._columns import Floats

HEAD = 6
OUTSIDE = 1e-6
"""Sum of the weights below which a row lies outside all rules."""


@kernel
def fuzzy_answer(numbers: Floats, columns: Floats, room: Floats, sd: Floats) -> float:
    """Return the value of one row, shape (features,), and write its standard deviation; NaN outside all rules."""
    features, components, rules = int(numbers[0]), int(numbers[1]), int(numbers[2])
    size = components + 1
    level, parts = room[:size], room[size : size + rules * size]
    level[0] = 1.0
    at = HEAD + features
    for j in range(components):
        total = 0.0
        for k in range(features):
            total += numbers[at + k] * (columns[k] - numbers[HEAD + k])
        level[j + 1] = total
        at += features
    widths = at + rules * components
    whole = 0.0
    for i in range(rules):
        farthest, square = 0.0, 0.0
        for j in range(components):
            place = i * components + j
            away = (level[j + 1] - numbers[at + place]) / numbers[widths + place]
            square += away * away
            farthest = max(farthest, away * away)
        weight = math.exp(-0.5 * (farthest if numbers[4] > 0.0 else square))
        whole += weight
        for j in range(size):
            parts[i * size + j] = weight * level[j]
    at = widths + rules * components
    if not whole >= OUTSIDE:
        sd[0] = math.nan
        return math.nan
    found = 0.0
    for k in range(rules * size):
        parts[k] /= whole
        found += numbers[at + k] * parts[k]
    square = numbers[5] * numbers[5]
    for _ in range(int(numbers[3])):
        at += rules * size
        total = 0.0
        for k in range(rules * size):
            total += numbers[at + k] * parts[k]
        square += total * total
    sd[0] = math.sqrt(square)
    return found
