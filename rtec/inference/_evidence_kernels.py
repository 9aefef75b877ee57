"""Log marginal likelihoods of normal amplitudes and noise, and the prior scales that make them largest.

``products`` are those of the columns and, last, the readings with each other, shape (columns + 1, columns + 1).
"""

from __future__ import annotations

import numpy as np

from rtec._jit import array_helper, array_kernel
from rtec.dataset.standstill import Ints
from rtec.effects import Floats

_GAIN = 1e-9
_ROUNDS = 12


@array_helper
def eliminate(upper: Floats, count: int) -> float:
    """Factorise the first columns of an upper triangle, take them out of the rest; return the log of the pivots."""
    total = 0.0
    for k in range(count):
        pivot = np.sqrt(upper[k, k])
        total += np.log(pivot)
        for j in range(k + 1, upper.shape[0]):
            upper[k, j] /= pivot
        for i in range(k + 1, upper.shape[0]):
            factor = upper[k, i]
            for j in range(i, upper.shape[0]):
                upper[i, j] -= factor * upper[k, j]
    return total


@array_helper
def log_likelihood(products: Floats, readings: float, deviations: Floats) -> float:
    """Return the log marginal likelihood for one set of prior deviations; a deviation of 0 leaves a column out."""
    used = np.flatnonzero(deviations)
    n, last = used.size, products.shape[0] - 1
    upper = np.empty((n + 1, n + 1))
    for i in range(n):
        a = used[i]
        for j in range(i, n):
            upper[i, j] = deviations[a] * products[a, used[j]] * deviations[used[j]]
        upper[i, i] += 1.0
        upper[i, n] = deviations[a] * products[a, last]
    upper[n, n] = products[last, last]
    # the last pivot is what the model leaves: one factorisation gives it and the determinant
    log_pivots = eliminate(upper, n)
    return float(-0.5 * readings * np.log(max(upper[n, n], 1e-300)) - log_pivots)


@array_helper
def put(places: Ints, values: Ints) -> None:
    """Copy an array into another; as a slice it takes two seconds to compile."""
    for b in range(places.size):
        places[b] = values[b]


@array_helper
def at_places(products: Floats, readings: float, block: Ints, ladder: Floats, places: Ints) -> float:
    """Return the log marginal likelihood for the places of blocks on the ladder."""
    deviations = np.zeros(block.size)
    for c in range(block.size):
        deviations[c] = ladder[places[block[c]]]
    return log_likelihood(products, readings, deviations)


@array_kernel
def shift(products: Floats, readings: float, block: Ints, ladder: Floats, places: Ints) -> float:
    """Move all places by one step of the ladder together where that helps; return the best."""
    start, moved = places.copy(), places.copy()
    best = at_places(products, readings, block, ladder, start)
    for step in (-1, 1):
        for b in range(start.size):
            moved[b] = min(max(start[b] + step, 0), ladder.size - 1)
        value = at_places(products, readings, block, ladder, moved)
        if value > best:
            best = value
            put(places, moved)
    return best


@array_helper
def without_block(products: Floats, own: Ints, rest: Ints, deviation: float, reduced: Floats) -> float:
    """Fill ``reduced`` with what is left of the products of the ``rest`` once columns have been averaged over.

    Returns the log of the pivots. It does not depend on the scales of the rest.
    """
    q, n = own.size, own.size + rest.size
    order = np.concatenate((own, rest))
    upper = np.empty((n, n))
    for i in range(n):
        for j in range(i, n):
            upper[i, j] = products[order[i], order[j]]
            if i < q:
                upper[i, j] *= deviation * (deviation if j < q else 1.0)
        if i < q:
            upper[i, i] += 1.0
    total = eliminate(upper, q)
    for i in range(rest.size):
        for j in range(i, rest.size):
            reduced[i, j] = reduced[j, i] = upper[q + i, q + j]
    return total


@array_helper
def kept(
    products: Floats,
    readings: float,
    block: Ints,
    ladder: Floats,
    places: Ints,
    own: Ints,
    rest: Ints,
    reduced: Floats,
    log_pivots: Floats,
) -> float:
    """Return the log marginal likelihood for places, from what the block of the columns ``own`` leaves of the others.

    That is kept in ``reduced`` and ``log_pivots`` for each of its places; not a number where it is not known yet.
    """
    at = places[block[own[0]]]
    if np.isnan(log_pivots[at]):
        log_pivots[at] = without_block(products, own, rest, ladder[at], reduced[at])
    return float(at_places(reduced[at], readings, block[rest[:-1]], ladder, places) - log_pivots[at])


@array_kernel
def climb(products: Floats, readings: float, block: Ints, ladder: Floats, places: Ints) -> float:
    """Move the places to where the readings are likeliest, block by block; return how likely they are."""
    if places.size == 0:
        return at_places(products, readings, block, ladder, places)
    own = np.flatnonzero(block == np.argmax(np.bincount(block)))
    rest = np.append(np.flatnonzero(block != block[own[0]]), block.size)
    reduced, log_pivots = np.empty((ladder.size, rest.size, rest.size)), np.full(ladder.size, np.nan)
    known = products, readings, block, ladder
    large = own, rest, reduced, log_pivots
    value = kept(*known, places, *large)
    moved = places.copy()
    for _ in range(_ROUNDS):
        together = places.copy()
        best_block, best_place, best = -1, -1, value + _GAIN
        for b in range(places.size):
            was, most = places[b], value
            for place in (was - 1, was + 1):
                if place < 0 or place >= ladder.size:
                    continue
                moved[b] = place
                found = kept(*known, moved, *large)
                if found > most:
                    most = found
                    together[b] = place
                if found > best:
                    best_block, best_place, best = b, place, found
            moved[b] = was
        if best_block < 0:
            break
        # moves of different blocks seldom hinder each other: all that help are tried at once first
        both = kept(*known, together, *large)
        if both >= best:
            put(places, together)
            value = both
        else:
            places[best_block] = best_place
            value = best
        put(moved, places)
    return value
