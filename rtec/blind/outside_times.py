"""Errors in time outside the library: cycles, weather, and lengths or play that change with them."""

from __future__ import annotations

import numpy as np

from rtec.blind.circumstances import Circumstances
from rtec.blind.hidden import Parameter
from rtec.blind.outside_waves import time_share, turned, way_share
from rtec.blind.plan import Floats
from rtec.blind.slow_errors import SlowError


def _error(c: Circumstances, added: Floats, cycles: float, description: str) -> SlowError:
    return SlowError(
        added_mm=1e-3 * added,
        description=description,
        parameters=(
            Parameter("cycle", c.length_s / cycles, "s"),
            Parameter("amplitude", 1.0, "um", scales=True),
        ),
    )


def _clock(c: Circumstances, cycles: float, rng: np.random.Generator) -> Floats:
    """Return a sinusoid in time at each reading, from -1 to 1, shape (n,)."""
    return np.sin(2.0 * np.pi * cycles * time_share(c) + turned(rng))


def _cycles(c: Circumstances, rng: np.random.Generator, *whole: int) -> float:
    """Return how many cycles a wave in time has: so many whole ones and about a half in each run.

    With whole cycles only it would be the same in each run, and nothing would tell it from a map of position.
    """
    return c.plan.runs * float(rng.choice(whole) + rng.uniform(0.3, 0.7))


def room_wave(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a laser's path in a room whose air conditioning switches: a wave in time."""
    cycles = _cycles(c, rng, 1, 2)
    return _error(c, _clock(c, cycles, rng), cycles, "a wave in time, as of the temperature of the room")


def pump_cycle(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a hydraulic pump that holds its pressure between two limits: on and off in time."""
    cycles, on = _cycles(c, rng, 1, 2), rng.uniform(0.3, 0.5)
    turns = cycles * time_share(c) + rng.uniform()
    added = np.where(turns % 1.0 < on, 1.0, 0.0) * rng.choice([-1.0, 1.0])
    return _error(c, added, cycles, "a pump that goes on and off")


def day_and_night(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a bed that grows by day and shrinks by night, with no sensor on it: a length that waves in time."""
    cycles = _cycles(c, rng, 0)
    added = (way_share(c) - rng.uniform(-0.2, 0.2)) * _clock(c, cycles, rng)
    return _error(c, added, cycles, "the bed grows and shrinks from day to night")


def breathing_scale(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a scale that hangs in the draught of a fan with a timer: its length waves quickly about its middle."""
    cycles = _cycles(c, rng, 1, 2)
    return _error(c, (way_share(c) - 0.5) * _clock(c, cycles, rng), cycles, "a length that waves in time")


def weather(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a shop that follows the weather: up and down and up again, no two times alike."""
    slow, fast = _cycles(c, rng, 0), _cycles(c, rng, 1)
    added = _clock(c, slow, rng) + 0.6 * _clock(c, fast, rng)
    return _error(c, added, slow, "a slow course in time with several turns, no drift and no warm-up")


def turning_drift(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a spindle that is switched on in every other run: the drift that it brings turns round with it."""
    half = 2.0 * (c.measured.time_s / c.length_s * c.plan.runs % 2.0)
    added = (np.abs(half - 2.0) - 1.0) * rng.choice([-1.0, 1.0])
    return _error(c, added, c.plan.runs / 2.0, "a drift that turns round from run to run")


def twisting_play(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a screw whose preload passes from one flank to the other as it warms: position, direction and time."""
    late = 2.0 * time_share(c) - 1.0
    added = -(0.2 + way_share(c)) * c.direction * late * rng.choice([-1.0, 1.0])
    return _error(c, added, 1.0, "play in proportion to position and time together")


def breathing_play(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a nut clamped by oil whose pressure waves: play that opens and closes in time."""
    cycles = _cycles(c, rng, 0, 1)
    return _error(c, -c.direction * _clock(c, cycles, rng), cycles, "play that opens and closes in time")
