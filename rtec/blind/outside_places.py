"""Errors of places outside the library: steps and dents, and maps that hold for a part of the time only."""

from __future__ import annotations

import numpy as np

from rtec.blind.circumstances import Circumstances
from rtec.blind.hidden import Parameter
from rtec.blind.outside_waves import time_share, turned, way_share
from rtec.blind.plan import Floats
from rtec.blind.slow_errors import SlowError, of_height

_TERMS = 6
"""Half waves of which a random map is the sum."""


def _smooth(share: Floats, rng: np.random.Generator) -> Floats:
    """Return a random smooth map over the travel, shape (n,)."""
    half_waves = np.arange(1, _TERMS + 1)
    return np.cos(np.pi * share[:, None] * half_waves) @ rng.normal(0.0, 1.0, _TERMS)


def _bump(c: Circumstances, place: Floats | float, width: float) -> Floats:
    """Return a bell at a place, both as shares of the travel, shape (n,)."""
    return np.exp(-0.5 * ((way_share(c) - place) / width) ** 2)


def scale_joints(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a scale glued together from segments: the reading steps at each joint, up and down in turn."""
    joints = int(rng.integers(4, 7))
    places = (np.arange(joints) + rng.uniform(0.2, 0.8, joints)) / joints
    heights = rng.uniform(0.6, 1.4, joints) * np.where(np.arange(joints) % 2, -1.0, 1.0) * rng.choice([-1.0, 1.0])
    added = (way_share(c)[:, None] > places) @ heights
    return of_height(added, "steps at the joints of a scale in segments", Parameter("joints", float(joints), ""))


def gib_dents(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a gib bent at two or three places: the slide dips into each kink and comes out again at once."""
    count = int(rng.integers(2, 4))
    places = (np.arange(count) + rng.uniform(0.2, 0.8, count)) / count
    width = max(0.02, 1.2 / c.plan.targets)
    signs = rng.choice([-1.0, 1.0], count)
    added = np.exp(-np.abs(way_share(c)[:, None] - places) / width) @ signs
    return of_height(added, "sharp dents where a gib is bent", Parameter("width", width * c.plan.span_mm, "mm"))


def one_way_bump(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a chip that a wiper pushes along: a bump felt in one direction only, elsewhere in each run."""
    runs, width = c.plan.runs, rng.uniform(0.05, 0.09)
    places = 0.1 + 0.8 * (np.arange(runs) + rng.uniform(0.2, 0.8, runs)) / runs
    way, sign = float(rng.choice([-1.0, 1.0])), float(rng.choice([-1.0, 1.0]))
    added = np.where(c.direction == way, sign * _bump(c, c.by_run(places), width), 0.0)
    return of_height(
        added, "a bump in one direction only, which moves from run to run", Parameter("direction", way, "")
    )


def late_map(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a guide that took a knock: from then on each direction has a map of its own, where there was none."""
    along, begin = way_share(c), rng.uniform(0.4, 0.6)
    after = np.where(c.direction > 0, _smooth(along, rng), _smooth(along, rng))
    added = np.where(time_share(c) > begin, after, 0.0)
    moment = Parameter("moment", begin * c.length_s, "s")
    return of_height(added, "after a knock, another random map in each direction", moment)


def passing_chip(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a chip under the slide, that falls in at one moment and is carried out at another."""
    place, width = rng.uniform(0.25, 0.75), rng.uniform(0.06, 0.1)
    begin, length = rng.uniform(0.15, 0.4), rng.uniform(0.3, 0.45)
    late, sign = time_share(c), float(rng.choice([-1.0, 1.0]))
    added = np.where((late > begin) & (late < begin + length), sign * _bump(c, place, width), 0.0)
    where = Parameter("place", c.plan.start_mm + place * c.plan.span_mm, "mm")
    return of_height(added, "a bump at one place that is there for a while only", where)


def sliding_joint(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a scale whose second segment lies loose: its joint is elsewhere in each run."""
    runs = c.plan.runs
    places = 0.1 + 0.8 * (rng.permutation(runs) + rng.uniform(0.2, 0.8, runs)) / runs
    sign = float(rng.choice([-1.0, 1.0]))
    added = np.where(way_share(c) > c.by_run(places), 0.5 * sign, -0.5 * sign)
    return of_height(added, "a step at a place that is another one in each run", Parameter("runs", float(runs), ""))


def snapping_map(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a scale that bulges to one side and snaps to the other: its map changes sign at a moment."""
    begin = rng.uniform(0.42, 0.58)
    added = np.where(time_share(c) > begin, -1.0, 1.0) * _smooth(way_share(c), rng)
    moment = Parameter("moment", begin * c.length_s, "s")
    return of_height(added, "a random map that changes its sign at a moment", moment)


def swaying_map(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a column that sways in the sun and out of it: a random map times a slow wave in time."""
    cycles = rng.uniform(1.5, 3.5)
    added = _smooth(way_share(c), rng) * np.sin(2.0 * np.pi * cycles * time_share(c) + turned(rng))
    clock = Parameter("cycle", c.length_s / cycles, "s")
    return of_height(added, "a random map that comes and goes with the time", clock)
