"""Plans of many short moves: where each begins and ends, and attacks one after the other.

Lengths are in counts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rtec.axis._aimed import Attack, Make, Place
from rtec.axis.profile import MotionSegments, plan_moves
from rtec.errors import ArgumentError
from rtec.units import PS_PER_S

_FloatArray = NDArray[np.float64]
_IntArray = NDArray[np.int64]
_Table = tuple[_FloatArray, _FloatArray, _FloatArray, _IntArray]
"""Starts, targets, speeds and dwells of moves."""


def planned(
    start: _FloatArray, target: _FloatArray, speed: _FloatArray, dwell_ps: _IntArray, gain: float
) -> MotionSegments:
    """Plan moves in counts."""
    try:
        return plan_moves(start, target, speed, dwell_ps, gain)
    except ArgumentError as error:
        raise ArgumentError("cycles", "a motion longer than 100 days", "fewer, or a higher frequency") from error


def moves(targets: Sequence[float], speeds: Sequence[float]) -> _Table:
    """Return the table of `plan_moves` for moves from count 0 on, without dwells."""
    target = np.array(targets, np.float64)
    start = np.concatenate([[0.0], target[:-1]]) if target.size else target
    return start, target, np.array(speeds, np.float64), np.zeros(target.size, np.int64)


def laid_out(make: Make, place: Place, numbers: range) -> tuple[MotionSegments, _IntArray]:
    """Lay attacks out one after the other, each after a rest whose length makes the aimed crossing come right."""
    attacks = [make(i, place) for i in numbers]
    sizes = np.array([len(attack.targets) for attack in attacks], np.int64)
    homes = np.concatenate([[0.0], np.cumsum([attack.targets[-1] for attack in attacks])])[:-1]
    targets = [home + x for home, attack in zip(homes.tolist(), attacks, strict=True) for x in attack.targets]
    start, target, speed, dwell = moves(targets, [v for attack in attacks for v in attack.speeds])
    ends_ps = [0, *planned(start, target, speed, dwell, place.acceleration).block_end_ps.tolist()]
    asked, rests, now_ps, row = [], [], 0, 0
    for attack, size in zip(attacks, sizes.tolist(), strict=True):
        aimed = row + attack.aimed
        crossing_ps = ends_ps[aimed] - ends_ps[row] + _into_ps(attack, abs(target[aimed] - start[aimed]), place)
        least_ps = now_ps + place.window.pause_ps + max(crossing_ps - attack.lead_ps, 0) + 1
        asked.append(-(-least_ps // place.window.every_ps) * place.window.every_ps)
        rests.append(asked[-1] + attack.lead_ps - crossing_ps - now_ps)
        moved_ps = now_ps + rests[-1] + ends_ps[row + size] - ends_ps[row]
        # an insertion may still be under way when the moves are over: the next rest begins behind it
        late_ps = max(asked[-1] + place.window.end_ps - moved_ps, 0)
        rests.append(late_ps)
        now_ps = moved_ps + late_ps
        row += size
    before, behind = np.cumsum(sizes) - sizes, np.cumsum(sizes)
    places = np.stack([before, behind], axis=1).ravel()
    stands = np.stack([homes, homes + [attack.targets[-1] for attack in attacks]], axis=1).ravel()
    segments = planned(
        np.insert(start, places, stands),
        np.insert(target, places, stands),
        np.insert(speed, places, place.speed),
        np.insert(dwell, places, np.array(rests, np.int64)),
        place.acceleration,
    )
    return segments, np.array(asked, np.int64)


def _into_ps(attack: Attack, length: float, place: Place) -> int:
    """Return how long after the start of its move an attack crosses the aimed line."""
    gain = place.acceleration
    peak = min(attack.speeds[attack.aimed], float(np.sqrt(gain * length)))
    ramp = peak**2 / (2.0 * gain)
    into = attack.into
    if into < ramp:
        taken = np.sqrt(2.0 * into / gain)
    elif into <= length - ramp:
        taken = peak / gain + (into - ramp) / peak
    else:
        taken = 2.0 * peak / gain + (length - 2.0 * ramp) / peak - np.sqrt(2.0 * max(length - into, 0.0) / gain)
    return round(float(taken) * PS_PER_S)
