"""The largest step of which all given numbers are whole multiples."""

from __future__ import annotations

import numpy as np

from rtec.effects.conditions import Floats

TOLERANCE = 1e-6
"""Of a step, by which a value may miss its multiple."""
FINEST = 1e-9
"""Of the largest value: finer steps cannot be told from the digits of a double."""
EPS = float(np.finfo(np.float64).eps)


def lattice_step(values: Floats) -> float | None:
    """Return the step, or None where there is none or fewer than three different values occur.

    Euclid's algorithm on the differences of neighbours, which have the smallest errors, then on the values; the step
    is sharpened over all values, and rounded to twelve digits where it remains a step.
    """
    distinct = np.unique(values[np.isfinite(values)])
    if distinct.size < 3:
        return None
    largest = float(np.abs(distinct).max())
    floor = max(FINEST * largest, np.finfo(np.float64).tiny)
    gaps = np.unique(np.diff(distinct))
    gaps = gaps[gaps > floor]
    if gaps.size == 0:
        return None
    step = _common(float(gaps[0]), gaps, floor, largest)
    step = None if step is None else _common(step, distinct, floor, largest)
    if step is None:
        return None
    short = float(f"{step:.12g}")
    for candidate in (short, step):
        if np.all(_miss(distinct, candidate) <= _allowed(candidate, largest)):
            return candidate
    return None


def _common(step: float, values: Floats, floor: float, largest: float) -> float | None:
    """Return the largest common step of ``step`` and all values, or None where it would fall below ``floor``."""
    ordered = values[np.argsort(np.abs(values))]
    reach = 8
    while True:
        # the nearest values first: whole numbers of steps are sure only while the error of the step stays small
        part = ordered[:reach]
        missed = _miss(part, step)
        worst = int(np.argmax(missed))
        if missed[worst] > max(1e-3 * step, 8 * EPS * largest):
            step = _euclid(step, float(missed[worst]), max(floor, 64 * EPS * largest))
            if step <= floor:
                return None
            continue
        counts = np.round(part / step)
        if np.any(counts):
            step = float(counts @ part / (counts @ counts))
        if reach >= ordered.size:
            return step
        reach *= 2


def _euclid(a: float, b: float, floor: float) -> float:
    """Return the common step of two lengths by repeated division; 0 where none above ``floor`` is left."""
    while b > max(1e-3 * a, floor):
        a, b = b, abs(a - b * round(a / b))
    return a if a > floor else 0.0


def _miss(values: Floats, step: float) -> Floats:
    """Return how far each value is from the nearest multiple."""
    missed: Floats = np.abs(values - np.round(values / step) * step)
    return missed


def _allowed(step: float, largest: float) -> float:
    """Return by how much a value may miss: a millionth of a step, and what its own digits lose."""
    return TOLERANCE * step + 4 * EPS * largest
