"""VDI/DGQ 3441 figures with plain sums, straight from the formulae."""

from __future__ import annotations

from collections.abc import Sequence


def oracle_vdi(target: Sequence[float], deviation: Sequence[float], direction: Sequence[int]) -> dict[str, float]:
    """Return the figures of a complete bidirectional test with at least two runs, in the unit of the deviations."""
    high, low, middles, reversals, scatters = [], [], [], [], []
    for place in sorted(set(target)):
        means, spreads = [], []
        for way in (1, -1):
            values = [d for t, d, w in zip(target, deviation, direction, strict=True) if t == place and w == way]
            mean = sum(values) / len(values)
            means.append(mean)
            spreads.append((sum((value - mean) ** 2 for value in values) / (len(values) - 1)) ** 0.5)
        middle, reversal, scatter = sum(means) / 2, abs(means[1] - means[0]), 6 * sum(spreads) / 2
        high.append(middle + (reversal + scatter) / 2)
        low.append(middle - (reversal + scatter) / 2)
        middles.append(middle)
        reversals.append(reversal)
        scatters.append(scatter)
    return {
        "P": max(high) - min(low),
        "Pa": max(middles) - min(middles),
        "U_max": max(reversals),
        "U_mean": sum(reversals) / len(reversals),
        "Ps_max": max(scatters),
        "Ps_mean": sum(scatters) / len(scatters),
    }
