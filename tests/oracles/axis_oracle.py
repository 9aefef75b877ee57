"""Edges of an axis of limited acceleration, from its motion solved piece by piece."""

import math
from itertools import pairwise


def edges(rng, contract, pieces):
    """Return (time in ps, move) of a random motion, without jitter; None where an edge comes back too soon.

    Each piece has a constant acceleration up to the contract's; the speed stays below its highest frequency.
    """
    top, gain = contract.frequency_hz, contract.acceleration_hz_s
    at_s, place, speed = 0.0, rng.uniform(0.0, 0.25), rng.uniform(-1.0, 1.0) * top * rng.choice([1.0, 0.1, 0.01])
    found = []
    for _ in range(pieces):
        rate = rng.uniform(-1.0, 1.0) * gain if rng.random() < 0.5 else rng.choice([-gain, gain])
        duration = rng.uniform(0.0, 1.0) * rng.choice([2e-6, 2e-5, 2e-4])
        if abs(speed + rate * duration) > top:
            rate = 0.0
        turn_s = -speed / rate if rate else math.inf
        for begin, end in ((0.0, min(max(turn_s, 0.0), duration)), (min(max(turn_s, 0.0), duration), duration)):
            found += _crossed(at_s, place, speed, rate, begin, end)
        place += speed * duration + rate * duration**2 / 2.0
        speed += rate * duration
        at_s += duration
    events = [(round(t * 1e12), move) for t, move in found]
    for (before, one), (after, other) in pairwise(events):
        if after <= before or (one != other and after - before < contract.turn_ps):
            return None
    return events if events and events[0][0] >= 1 else None


def _crossed(at_s, place, speed, rate, begin, end):
    """Return when quarters of a cycle are crossed while the axis moves one way."""

    def where(t):
        return place + speed * t + rate * t * t / 2.0

    low, high = where(begin), where(end)
    move = 1 if high > low else -1
    quarters = range(math.floor(low * 4) + 1, math.floor(high * 4) + 1)
    if move < 0:
        quarters = range(math.ceil(low * 4) - 1, math.ceil(high * 4) - 1, -1)
    found = []
    for quarter in quarters:
        early, late = begin, end  # monotonic in between
        for _ in range(80):
            middle = (early + late) / 2.0
            early, late = (middle, late) if (where(middle) - quarter / 4.0) * move < 0.0 else (early, middle)
        found.append((at_s + late, move))
    return found
