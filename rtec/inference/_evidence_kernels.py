"""Log marginal likelihoods of normal amplitudes and noise, and the prior scales that make them largest.

``products`` are those of the columns and, last, the readings with each other, shape (columns + 1, columns + 1);
``upper`` is room for as many numbers. Python makes all arrays: numpy's functions take a second to compile.
"""

from __future__ import annotations

import numpy as np

from rtec._jit import helper, kernel
from rtec.dataset.standstill import Ints
from rtec.effects import Floats

_GAIN = 1e-9
_ROUNDS = 12


@helper
def put(places: Ints, values: Ints) -> None:
    """Copy an array into another."""
    for b in range(places.size):
        places[b] = values[b]


@helper
def eliminate(upper: Floats, size: int, count: int) -> float:
    """Factorise the first columns of an upper triangle, take them out of the rest; return the log of the pivots."""
    total = 0.0
    for k in range(count):
        pivot = np.sqrt(upper[k, k])
        total += np.log(pivot)
        for j in range(k + 1, size):
            upper[k, j] /= pivot
        for i in range(k + 1, size):
            factor = upper[k, i]
            for j in range(i, size):
                upper[i, j] -= factor * upper[k, j]
    return total


@helper
def at_places(
    products: Floats, readings: float, block: Ints, ladder: Floats, places: Ints, upper: Floats
) -> float:  # fmt: skip
    """Return the log marginal likelihood for the places of blocks on the ladder."""
    n = block.size
    for i in range(n):
        deviation = ladder[places[block[i]]]
        for j in range(i, n):
            upper[i, j] = deviation * products[i, j] * ladder[places[block[j]]]
        upper[i, i] += 1.0
        upper[i, n] = deviation * products[i, n]
    upper[n, n] = products[n, n]
    # the last pivot is what the model leaves: one factorisation gives it and the determinant
    log_pivots = eliminate(upper, n + 1, n)
    return float(-0.5 * readings * np.log(max(upper[n, n], 1e-300)) - log_pivots)


@helper
def without_turned(
    products: Floats, order: Ints, count: int, variance: float, reduced: Floats, row: Floats
) -> float:  # fmt: skip
    """Do as `without_first` does for columns without products with each other; ``row`` is room for one."""
    rest = order.size - count
    for i in range(rest):
        for j in range(rest):
            reduced[i, j] = products[order[count + i], order[count + j]]
    total = 0.0
    for k in range(count):
        pivot = 1.0 + variance * products[order[k], order[k]]
        total += 0.5 * np.log(pivot)
        for j in range(rest):
            row[j] = products[order[k], order[count + j]]
        for i in range(rest):
            factor = row[i] * variance / pivot
            for j in range(rest):
                reduced[i, j] -= factor * row[j]
    return total


@helper
def without_first(
    products: Floats, order: Ints, count: int, deviation: float, turned: bool, reduced: Floats, upper: Floats
) -> float:  # fmt: skip
    """Fill ``reduced`` with what is left of the products once the first columns of an order have been averaged over.

    Returns the log of the pivots. It does not depend on the scales of the rest. Columns that are ``turned`` have no
    products with each other, which takes a fiftieth of the time.
    """
    n = order.size
    if turned:
        return without_turned(products, order, count, deviation * deviation, reduced, upper[0])
    for i in range(n):
        for j in range(i, n):
            upper[i, j] = products[order[i], order[j]]
            if i < count:
                upper[i, j] *= deviation * (deviation if j < count else 1.0)
        if i < count:
            upper[i, i] += 1.0
    total = eliminate(upper, n, count)
    for i in range(n - count):
        for j in range(i, n - count):
            reduced[i, j] = reduced[j, i] = upper[count + i, count + j]
    return total


@helper
def kept(
    products: Floats, readings: float, block: Ints, ladder: Floats, places: Ints, upper: Floats,
    order: Ints, first: int, rest: Ints, turned: bool, reduced: Floats, log_pivots: Floats,
) -> float:  # fmt: skip
    """Return the log marginal likelihood for places, from what the ``first`` block leaves of the columns of the rest.

    That is kept in ``reduced`` and ``log_pivots`` for each of its places; not a number where it is not known yet.
    """
    at = places[first]
    if np.isnan(log_pivots[at]):
        log_pivots[at] = without_first(
            products, order, block.size - rest.size, ladder[at], turned, reduced[at], upper
        )
    return float(at_places(reduced[at], readings, rest, ladder, places, upper) - log_pivots[at])


@kernel
def shift(
    products: Floats, readings: float, block: Ints, ladder: Floats, places: Ints, trial: Ints, upper: Floats,
    order: Ints, first: int, rest: Ints, turned: bool, reduced: Floats, log_pivots: Floats,
) -> float:  # fmt: skip
    """Move all places by one step of the ladder together where that helps; return the best; arrays as of `climb`."""
    start, moved = trial[0], trial[1]
    put(start, places)
    best = kept(products, readings, block, ladder, start, upper, order, first, rest, turned, reduced, log_pivots)
    for step in (-1, 1):
        for b in range(places.size):
            moved[b] = min(max(start[b] + step, 0), ladder.size - 1)
        value = kept(products, readings, block, ladder, moved, upper, order, first, rest, turned, reduced, log_pivots)
        if value > best:
            best = value
            put(places, moved)
    return best


@kernel
def climb(
    products: Floats, readings: float, block: Ints, ladder: Floats, places: Ints, trial: Ints, upper: Floats,
    order: Ints, first: int, rest: Ints, turned: bool, reduced: Floats, log_pivots: Floats,
) -> float:  # fmt: skip
    """Move the places to where the readings are likeliest, block by block; return how likely they are.

    The columns stand in an ``order``, those of the ``first`` block before the others, which belong to the blocks
    ``rest``, and are ``turned`` or not. ``reduced``, shape (ladder, rest + 1, rest + 1), and ``log_pivots`` are what
    `kept` keeps; ``trial``, shape (2, blocks), is room for places.
    """
    moved, together = trial[0], trial[1]
    put(moved, places)
    value = kept(products, readings, block, ladder, places, upper, order, first, rest, turned, reduced, log_pivots)
    for _ in range(_ROUNDS):
        best_block, best_place, best = -1, -1, value + _GAIN
        put(together, places)
        for b in range(places.size):
            was, most = places[b], value
            for place in (was - 1, was + 1):
                if place < 0 or place >= ladder.size:
                    continue
                moved[b] = place
                found = kept(
                    products, readings, block, ladder, moved, upper, order, first, rest, turned, reduced, log_pivots
                )
                if found > most:
                    most = found
                    together[b] = place
                if found > best:
                    best_block, best_place, best = b, place, found
            moved[b] = was
        if best_block < 0:
            break
        # moves of different blocks seldom hinder each other: all that help are tried at once first
        value = kept(
            products, readings, block, ladder, together, upper, order, first, rest, turned, reduced, log_pivots
        )
        if value < best:
            put(together, places)
            together[best_block] = best_place
            value = best
        put(places, together)
        put(moved, together)
    return value
