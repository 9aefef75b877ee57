"""Streams of random numbers: one of its own for each thing drawn, so that none changes with another."""

from __future__ import annotations

import enum

import numpy as np

from rtec.checks import whole_within


class Draw(enum.IntEnum):
    """What is drawn."""

    SCENARIO = 0
    COURSE = 1
    NOISE = 2
    HEAT = 3
    SENSOR = 4
    EFFECT = 5
    TRIAL = 6
    PLAN = 7
    WEATHER = 8
    LOAD = 9


def checked_seed(seed: object) -> int:
    """Return a seed.

    Raises
    ------
    ArgumentError
        It is no whole number from 0 to 2^62.

    Examples
    --------
    >>> checked_seed(7)
    7
    """
    return whole_within("seed", seed, 0, 1 << 62)


def stream(seed: int, what: Draw, name: str = "") -> np.random.Generator:
    """Return the stream of one thing, of one effect where it has a name.

    Examples
    --------
    >>> float(stream(1, Draw.NOISE).normal()) == float(stream(1, Draw.NOISE).normal())
    True
    """
    return np.random.default_rng([seed, int(what), *name.encode()])
