"""Everything that can be hidden and lies outside the library of effects, and what a plan needs to show it as such."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from rtec.blind import (
    outside_memory as memory,
    outside_places as places,
    outside_times as times,
    outside_waves as waves,
)
from rtec.blind.circumstances import Circumstances
from rtec.blind.slow_errors import SlowError, dwell_reversal, moving_bump


@dataclass(frozen=True, slots=True)
class Kind:
    """An error outside the library.

    Parameters
    ----------
    draw
        Draws it for what was measured.
    runs
        Fewest: with fewer it is a map of position, or a course in time that the library has.
    targets
        Fewest: with fewer its shape cannot be seen.
    """

    draw: Callable[[Circumstances, np.random.Generator], SlowError]
    runs: int = 1
    targets: int = 11


# sums of waves that the library has are not outside: two near periods, or another period on each flank
_ALL = (
    Kind(moving_bump, runs=3),
    Kind(dwell_reversal, runs=3),
    Kind(waves.growing_wave, targets=21),
    Kind(waves.fading_wave, runs=2, targets=21),
    Kind(waves.partial_wave, targets=31),
    Kind(waves.missing_tooth, targets=31),
    Kind(waves.slipping_wave, runs=2, targets=21),
    Kind(waves.breathing_ribs, runs=2, targets=21),
    Kind(waves.travelling_wave, runs=2, targets=21),
    Kind(places.scale_joints, targets=41),
    Kind(places.gib_dents, targets=41),
    Kind(places.one_way_bump, runs=3),
    Kind(places.late_map, runs=2),
    Kind(places.passing_chip, runs=3),
    Kind(places.sliding_joint, runs=3),
    Kind(places.snapping_map, runs=2),
    Kind(places.swaying_map, runs=3),
    Kind(times.room_wave, runs=2),
    Kind(times.pump_cycle, runs=2),
    Kind(times.day_and_night, runs=3),
    Kind(times.breathing_scale, runs=2),
    Kind(times.weather, runs=3),
    Kind(times.turning_drift, runs=3),
    Kind(times.twisting_play, runs=2),
    Kind(times.breathing_play, runs=2),
    Kind(memory.creep_after_rest, runs=3),
    Kind(memory.stick_slip, targets=21),
    Kind(memory.counting_play, runs=3),
    Kind(memory.flipping_play, runs=2),
    Kind(memory.lost_at_reversals, runs=3),
    Kind(memory.worn_in, runs=3),
)
KINDS: Mapping[str, Kind] = MappingProxyType({kind.draw.__name__: kind for kind in _ALL})
"""By name; `chirped_cyclic`, which lies outside as well, is a static error."""
