"""The largest value at which nothing fails: up a grid to the first failure, then halving."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

F = TypeVar("F")

STEPS_PER_OCTAVE = 12
RESOLUTION = 0.01
"""Share by which the safe value and the failing one differ at most."""


class Limit(Generic[F]):
    """What a search has found.

    Parameters
    ----------
    safe
        Largest value at which nothing failed; 0.0 where even the smallest one did.
    failure
        What failed just above, or None where nothing ever did.
    """

    def __init__(self, safe: float, failure: F | None) -> None:
        self.safe, self.failure = safe, failure


def largest_safe(
    fails: Callable[[float], F | None], first: float, last: float, *, steps: int = STEPS_PER_OCTAVE
) -> Limit[F]:
    """Return the largest value below the first failure.

    Parameters
    ----------
    fails
        Returns what fails at a value, or None.
    first, last
        Ends of the grid, ascending by equal ratios.
    steps
        Of the grid, an octave.

    Notes
    -----
    Safe values above the first failing one of the grid do not count: what fails at 30 kHz is no machine for 40 kHz.

    Examples
    --------
    >>> limit = largest_safe(lambda hz: "late" if hz > 25_000 else None, 1_000, 1e6)
    >>> 24_750 < limit.safe <= 25_000, limit.failure
    (True, 'late')
    """
    ratio = 2.0 ** (1.0 / steps)
    safe, value = 0.0, first
    failure = fails(value)
    while failure is None and value < last:
        safe, value = value, min(value * ratio, last)
        failure = fails(value)
    if failure is None:
        return Limit(value, None)
    if safe == 0.0:
        return Limit(0.0, failure)
    return halved(fails, safe, value, failure)


def halved(fails: Callable[[float], F | None], safe: float, failing: float, failure: F) -> Limit[F]:
    """Return the limit between a safe value and a failing one."""
    while failing > safe * (1.0 + RESOLUTION):
        middle = (safe * failing) ** 0.5
        found = fails(middle)
        if found is None:
            safe = middle
        else:
            failing, failure = middle, found
    return Limit(safe, failure)
