"""Compiled LS-SVM.

``features, rows, landmarks, decay, bias, noise, noise share, bias weight, linear``; centre, factor and slope of each
feature; scaled rows; their multipliers; where the landmarks stand among the rows; two lower triangles (of the
landmarks' kernel, and of what the rows leave open of it) as full squares; the pull of the bias on each landmark.
"""

from __future__ import annotations

import math

from rtec._jit import kernel, summing_helper
from rtec.predictors._columns import Floats

HEAD = 9


@summing_helper
def _apart(left: Floats, right: Floats) -> float:
    """Return the squared distance of two rows."""
    total = 0.0
    for k in range(left.size):
        total += (left[k] - right[k]) * (left[k] - right[k])
    return total


@summing_helper
def _product(left: Floats, right: Floats) -> float:
    total = 0.0
    for k in range(left.size):
        total += left[k] * right[k]
    return total


@kernel
def ls_svm_answer(numbers: Floats, columns: Floats, room: Floats, sd: Floats) -> float:
    """Return the value of one row, shape (features,), and write its standard deviation."""
    features, rows, landmarks = int(numbers[0]), int(numbers[1]), int(numbers[2])
    centre = numbers[HEAD : HEAD + features]
    factor = numbers[HEAD + features : HEAD + 2 * features]
    slopes = numbers[HEAD + 2 * features : HEAD + 3 * features]
    linear, first = numbers[8], HEAD + 3 * features
    at = first
    scaled, alike, known = room[:features], room[features : features + rows], room[features + rows :]
    for k in range(features):
        scaled[k] = (columns[k] - centre[k]) * factor[k]
    for i in range(rows):
        alike[i] = math.exp(-numbers[3] * _apart(scaled, numbers[at : at + features]))
        at += features
    found: float = numbers[4] + _product(alike, numbers[at : at + rows]) + _product(slopes, scaled)
    at += rows
    places = numbers[at : at + landmarks]
    at += landmarks
    left, pull = 1.0 + linear * _product(scaled, scaled), 1.0
    for i in range(landmarks):
        row = numbers[at : at + i + 1]
        place = int(places[i])
        point = numbers[first + place * features : first + (place + 1) * features]
        known[i] = (alike[place] + linear * _product(scaled, point) - _product(row[:i], known[:i])) / row[i]
        left -= known[i] * known[i]
        at += landmarks
    square = numbers[6] + max(left, 0.0)
    for i in range(landmarks):
        one = _product(numbers[at : at + i + 1], known[: i + 1])
        square += one * one
        at += landmarks
    pull -= _product(numbers[at : at + landmarks], known[:landmarks])
    sd[0] = numbers[5] * math.sqrt(square + pull * pull / numbers[7])
    return found
