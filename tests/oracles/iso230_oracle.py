"""ISO 230-2 figures computed slowly, with Python's statistics module, straight from the definitions of the terms."""

from __future__ import annotations

import statistics
from collections import defaultdict
from collections.abc import Sequence


def oracle_figures(target: Sequence[float], deviation: Sequence[float], direction: Sequence[int]) -> dict[str, float]:
    """Return the figures of a complete bidirectional test with at least two runs, in the unit of the deviations."""
    up: dict[float, list[float]] = defaultdict(list)
    down: dict[float, list[float]] = defaultdict(list)
    for where, value, way in zip(target, deviation, direction, strict=True):
        (up if way > 0 else down)[where].append(value)
    places = sorted(up)
    mean_up = {p: statistics.fmean(up[p]) for p in places}
    mean_down = {p: statistics.fmean(down[p]) for p in places}
    s_up = {p: statistics.stdev(up[p]) for p in places}
    s_down = {p: statistics.stdev(down[p]) for p in places}
    b = {p: mean_up[p] - mean_down[p] for p in places}
    middle = {p: (mean_up[p] + mean_down[p]) / 2 for p in places}
    top_up = max(mean_up[p] + 2 * s_up[p] for p in places)
    bottom_up = min(mean_up[p] - 2 * s_up[p] for p in places)
    top_down = max(mean_down[p] + 2 * s_down[p] for p in places)
    bottom_down = min(mean_down[p] - 2 * s_down[p] for p in places)
    r_up = {p: 4 * s_up[p] for p in places}
    r_down = {p: 4 * s_down[p] for p in places}
    r = {p: max(2 * s_up[p] + 2 * s_down[p] + abs(b[p]), r_up[p], r_down[p]) for p in places}
    means = list(mean_up.values()) + list(mean_down.values())
    return {
        "A": max(top_up, top_down) - min(bottom_up, bottom_down),
        "A_forward": top_up - bottom_up,
        "A_backward": top_down - bottom_down,
        "R": max(r.values()),
        "R_forward": max(r_up.values()),
        "R_backward": max(r_down.values()),
        "E": max(means) - min(means),
        "E_forward": max(mean_up.values()) - min(mean_up.values()),
        "E_backward": max(mean_down.values()) - min(mean_down.values()),
        "M": max(middle.values()) - min(middle.values()),
        "B": max(abs(value) for value in b.values()),
        "B_mean": statistics.fmean(b.values()),
        "max_average_error": max(means) - min(means),
        "max_reversal_error": max(abs(value) for value in b.values()),
        "max_repeat": max(max(up[p] + down[p]) - min(up[p] + down[p]) for p in places),
        "rms": statistics.fmean(value * value for value in deviation) ** 0.5,
        "pp": max(deviation) - min(deviation),
    }
