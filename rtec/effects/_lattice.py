"""The largest step of which all given numbers are whole multiples."""

from __future__ import annotations

import numpy as np

from rtec.effects.conditions import Floats

TOLERANCE = 1e-6
"""Of a step, by which a value may miss its multiple."""
FINEST = 1e-9
"""Of the largest value: finer steps cannot be told from the digits of a double."""
SURE = 0.1
"""Of a step: where the step's error times the number of steps stays below, that number is sure."""
UNSURE = 0.25
"""Of a step: with a larger error the number of parts that a step is divided into cannot be told."""
COARSE = 1e-5
"""Of a step, by which a value may miss while the step is not sharpened yet."""
EPS = float(np.finfo(np.float64).eps)


def lattice_step(values: Floats) -> float | None:
    """Return the step, or None where there is none or fewer than three different values occur.

    Euclid's algorithm over the gaps from the smallest on, then over the distances from the first value, then over the
    values; the step is sharpened with each, and rounded to twelve digits where it remains a step. A few values more
    than some 50 000 steps apart may leave it open, which answers None.

    Examples
    --------
    >>> lattice_step(np.array([0.012, -0.003, 0.021, 0.009]))
    0.003
    """
    distinct = np.unique(values[np.isfinite(values)])
    if distinct.size < 3:
        return None
    largest = float(np.abs(distinct).max())
    noise = EPS * largest
    floor = max(FINEST * largest, float(np.finfo(np.float64).tiny))
    gaps = np.unique(np.diff(distinct))
    step, error = float(gaps[0]), noise
    for lengths in (gaps, distinct - distinct[0], distinct):
        if step <= floor:
            return None
        found = _common(step, error, lengths, noise, floor)
        if found is None:
            return None
        step, error = found
    for candidate in (float(f"{step:.12g}"), step):
        if np.all(np.abs(distinct - np.round(distinct / candidate) * candidate) <= TOLERANCE * candidate + 4 * noise):
            return candidate
    return None


def _common(step: float, error: float, lengths: Floats, noise: float, floor: float) -> tuple[float, float] | None:
    """Return the largest common step of ``step`` and all lengths with its error, or None where there is none."""
    ordered = lengths[np.argsort(np.abs(lengths))]
    before = 0
    while True:
        counts = np.round(ordered / step)
        sure = int(np.searchsorted(np.abs(counts) * error, SURE * step, side="right"))
        if sure <= before:
            return None
        part, counts = ordered[:sure], counts[:sure]
        missed = np.abs(part - counts * step)
        slack = noise + np.abs(counts) * error
        off = missed > COARSE * step + slack
        if off.any():
            first = int(np.argmax(off))
            shorter = _euclid(step, float(missed[first]), floor)
            if not floor < shorter < 0.75 * step:
                return None
            parts = round(step / shorter)  # sure unless the division lost too many digits
            if parts**2 * float(slack[first]) > UNSURE * shorter:
                return None
            step, error, before = step / parts, error / parts, 0
            continue
        if np.any(counts):
            step = float(counts @ part / (counts @ counts))
            error = min(error, noise / float(np.abs(counts).max()))
        if sure == ordered.size:
            return step, error
        before = sure


def _euclid(a: float, b: float, floor: float) -> float:
    """Return the common step of two lengths by repeated division; 0 where none above ``floor`` is left."""
    while b > COARSE * a and b > floor:
        a, b = b, abs(a - b * round(a / b))
    return a if b <= COARSE * a else 0.0
