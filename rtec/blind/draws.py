"""Streams of random numbers: one of its own for each thing drawn, so that none changes with another."""

from __future__ import annotations

import enum
from dataclasses import dataclass

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Occasion:
    """One measurement of an axis, for which targets, heat, air and noise are drawn anew.

    Raises
    ------
    ArgumentError
        A number that is no whole number from 0 to 2^62.

    Examples
    --------
    >>> first, again = Occasion(seed=1), Occasion(seed=1, number=1)
    >>> float(first.stream(Draw.NOISE).normal()) == float(stream(1, Draw.NOISE).normal())
    True
    >>> float(first.stream(Draw.NOISE).normal()) == float(again.stream(Draw.NOISE).normal())
    False
    """

    seed: int
    """Of the axis, and of its first measurement."""
    number: int = 0
    """0 for the first measurement, another one for each further."""

    def __post_init__(self) -> None:
        """Check the numbers."""
        checked_seed(self.seed)
        whole_within("number", self.number, 0, 1 << 62)

    def stream(self, what: Draw, name: str = "") -> np.random.Generator:
        """Return the stream of one thing that is drawn for this measurement."""
        return stream(self.seed, what, f"{name} {self.number}" if self.number else name)
