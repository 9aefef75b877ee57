"""Waves that no single period, amplitude and phase describe: errors outside the library, periodic but for one thing.

All have five cycles or more in the span, and at least three targets in a cycle.
"""

from __future__ import annotations

import numpy as np

from rtec.blind.circumstances import Circumstances
from rtec.blind.hidden import Parameter
from rtec.blind.plan import Floats, Plan
from rtec.blind.slow_errors import SlowError

LONGEST_SHARE = 0.2
"""Of the span, that a period takes: five cycles."""
_SHORTEST_SHARE, _TARGETS_A_CYCLE = 0.06, 3.0


def period_of(plan: Plan, rng: np.random.Generator) -> float:
    """Return a period in mm with five cycles or more in the span of a plan.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> 300.0 / period_of(PLANS["base"], np.random.default_rng(0)) >= 5.0
    True
    """
    return float(rng.uniform(max(_TARGETS_A_CYCLE / plan.targets, _SHORTEST_SHARE), LONGEST_SHARE) * plan.span_mm)


def way_share(c: Circumstances) -> Floats:
    """Return how far along the axis each reading is, from 0 to 1, shape (n,)."""
    return np.clip((c.course.target_mm - c.plan.start_mm) / c.plan.span_mm, 0.0, 1.0)


def time_share(c: Circumstances) -> Floats:
    """Return how late each reading is, from 0 to 1, shape (n,)."""
    return c.measured.time_s / max(c.length_s, 1e-9)


def turned(rng: np.random.Generator) -> float:
    """Return a random phase in radians."""
    return float(rng.uniform(0.0, 2.0 * np.pi))


def _wave(c: Circumstances, period_mm: float, phase: float | Floats) -> Floats:
    """Return a sinusoid of position at each reading, from -1 to 1, shape (n,)."""
    return np.sin(2.0 * np.pi * c.course.target_mm / period_mm + phase)


def _error(added: Floats, description: str, period_mm: float, *more: Parameter) -> SlowError:
    height = Parameter("amplitude", 1.0, "um", scales=True)
    return SlowError(
        added_mm=1e-3 * added,
        description=description,
        parameters=(Parameter("period", period_mm, "mm"), height, *more),
    )


def growing_wave(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return the runout of a screw held at one end only: it bends with the square of the distance from there."""
    period_mm = period_of(c.plan, rng)
    along = way_share(c)
    bent = along if rng.uniform() < 0.5 else 1.0 - along
    added = bent**2 * _wave(c, period_mm, turned(rng))
    return _error(added, "periodic error whose amplitude grows along the axis", period_mm)


def fading_wave(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return the runout of a bearing that runs in: its amplitude decays with the time."""
    period_mm, share = period_of(c.plan, rng), rng.uniform(0.15, 0.3)
    added = np.exp(-time_share(c) / share) * _wave(c, period_mm, turned(rng))
    tau = Parameter("time_constant", share * c.length_s, "s")
    return _error(added, "periodic error whose amplitude decays with the time", period_mm, tau)


def partial_wave(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return the marks of a rack of which one part is worn: a wave there and none elsewhere."""
    period_mm = min(period_of(c.plan, rng), 0.14 * c.plan.span_mm)
    length = rng.uniform(0.35, 0.45)
    begin = rng.uniform(0.05, 0.95 - length)
    along = way_share(c)
    added = np.where((along > begin) & (along < begin + length), _wave(c, period_mm, turned(rng)), 0.0)
    start = Parameter("from", c.plan.start_mm + begin * c.plan.span_mm, "mm")
    return _error(added, "periodic error in one part of the travel only", period_mm, start)


def missing_tooth(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a belt that climbs its teeth one by one, and has lost some: a sawtooth with gaps."""
    plan = c.plan
    period_mm = rng.uniform(max(_TARGETS_A_CYCLE / plan.targets, 0.12), LONGEST_SHARE) * plan.span_mm
    turns = c.course.target_mm / period_mm + rng.uniform()
    number = np.floor(turns)
    first = rng.uniform(0.2, 0.6) * plan.span_mm + plan.start_mm
    lost = int(np.floor(first / period_mm)) + np.arange(2)
    added = np.where(np.isin(number, lost), 0.0, 2.0 * (turns - number) - 1.0)
    return _error(added, "sawtooth of the teeth of a belt, two of them missing", period_mm)


def slipping_wave(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return the runout of a friction wheel, which slips each time it turns round: another phase in each pass."""
    period_mm = period_of(c.plan, rng)
    slip = rng.uniform(1.5, 2.8) * rng.choice([-1.0, 1.0])
    turns = np.concatenate([[0.0], np.cumsum(np.diff(c.direction) != 0)])
    added = _wave(c, period_mm, turned(rng) + slip * turns)
    return _error(
        added, "periodic error of a wheel that slips at each reversal", period_mm, Parameter("slip", slip, "rad")
    )


def breathing_ribs(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a bed whose ribs bulge and sink as its coolant warms and cools: a wave in place times one in time."""
    period_mm, cycles = period_of(c.plan, rng), rng.uniform(2.0, 5.0)
    added = _wave(c, period_mm, turned(rng)) * np.sin(2.0 * np.pi * cycles * time_share(c) + turned(rng))
    clock = Parameter("cycle", c.length_s / cycles, "s")
    return _error(added, "periodic error that swells and sinks with the time", period_mm, clock)


def travelling_wave(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return heat that travels along the bed: a wave in place and time together."""
    period_mm, cycles = period_of(c.plan, rng), rng.uniform(2.0, 5.0) * rng.choice([-1.0, 1.0])
    added = _wave(c, period_mm, turned(rng) + 2.0 * np.pi * cycles * time_share(c))
    clock = Parameter("cycle", c.length_s / cycles, "s")
    return _error(added, "a wave that travels along the axis", period_mm, clock)
