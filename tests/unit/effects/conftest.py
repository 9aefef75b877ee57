from collections.abc import Callable

import numpy as np
import pytest

from rtec.effects import Conditions, distance_since_reversal


@pytest.fixture(scope="session")
def bidirectional() -> Callable[..., Conditions]:
    """A static test: runs of targets forward and back again, a reading every five seconds."""

    def build(targets=None, runs=5, **others):
        one_way = np.linspace(3.0, 397.0, 21) if targets is None else np.asarray(targets, dtype=np.float64)
        position = np.tile(np.concatenate([one_way, one_way[::-1]]), runs)
        direction = np.tile(np.repeat([1.0, -1.0], one_way.size), runs)
        run = np.repeat(np.arange(runs, dtype=np.int64), 2 * one_way.size)
        facts = {
            "position": position,
            "position_unit": "mm",
            "run": run,
            "direction": direction,
            "time_s": 5.0 * np.arange(position.size),
            "since_reversal": distance_since_reversal(position, direction, run),
        }
        return Conditions(**{**facts, **others})

    return build


@pytest.fixture(scope="session")
def log() -> Callable[..., Conditions]:
    """A log of a moving axis: x(t) = 100 sin(t) + 3 sin(7 t) mm, at rest for the first tenth."""

    def build(rows=4000, **others):
        t = np.linspace(0.0, 10.0, rows)
        moving = t > 1.0
        s = np.where(moving, t - 1.0, 0.0)
        position = 100.0 * (1 - np.cos(s)) + 3.0 * (1 - np.cos(7 * s))
        velocity = 100.0 * np.sin(s) + 21.0 * np.sin(7 * s)
        acceleration = np.where(moving, 100.0 * np.cos(s) + 147.0 * np.cos(7 * s), 0.0)
        direction = np.where(np.abs(velocity) > 0.1, np.sign(velocity), 0.0)
        facts = {
            "position": position,
            "position_unit": "mm",
            "run": np.ones(rows, dtype=np.int64),
            "direction": direction,
            "time_s": t,
            "velocity": velocity,
            "acceleration": acceleration,
            "moving": True,
        }
        return Conditions(**{**facts, **others})

    return build
