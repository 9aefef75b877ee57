"""Streams of random numbers: one of its own for each thing drawn, so that none changes with another."""

from __future__ import annotations

import enum

import numpy as np


class Draw(enum.IntEnum):
    """What is drawn."""

    SCENARIO = 0
    COURSE = 1
    NOISE = 2
    HEAT = 3
    SENSOR = 4
    EFFECT = 5
    TRIAL = 6


def stream(seed: int, what: Draw, name: str = "") -> np.random.Generator:
    """Return the stream of one thing, of one effect where it has a name.

    Examples
    --------
    >>> float(stream(1, Draw.NOISE).normal()) == float(stream(1, Draw.NOISE).normal())
    True
    """
    return np.random.default_rng([seed, int(what), *name.encode()])
