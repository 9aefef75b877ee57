"""The Gray code of an incremental encoder: its four states, and the count of each transition.

The code of a pair of levels is ``ab = A + 2 * B``; an angle state ``s`` is 0..3 where the report writes 1..4.

References
----------
Yee (1992), "Alternate RTEC Design A", state table; ``docs/state-tables.md`` holds the tables corrected.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rtec.signal import _checks
from rtec.signal._kernels import DELTA


@dataclass(frozen=True, slots=True, kw_only=True)
class GrayState:
    """One row of the state table."""

    number: int
    """The state as the report counts it, 1..4."""
    a: int
    b: int
    """Levels of the lines in this state, 0 or 1."""

    @property
    def state(self) -> int:
        """The internal angle state 0..3."""
        return self.number - 1

    @property
    def level(self) -> int:
        """The level code ``A + 2 * B``."""
        return self.a + 2 * self.b


STATES: tuple[GrayState, ...] = (
    GrayState(number=1, a=0, b=0),
    GrayState(number=2, a=1, b=0),
    GrayState(number=3, a=1, b=1),
    GrayState(number=4, a=0, b=1),
)
"""The state table in the positive direction: one count from each row to the next, and from the last to the first."""


def _gray(values: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return (values ^ (values >> 1)).astype(np.uint8, copy=False)


def levels_of_states(states: ArrayLike) -> NDArray[np.uint8]:
    """Return the level codes of angle states.

    Parameters
    ----------
    states
        Angle states 0..3, shape (n,).

    Returns
    -------
    numpy.ndarray
        Level codes 0..3, uint8, shape (n,).

    Raises
    ------
    ArgumentError
        A state that is no whole number 0..3.

    Examples
    --------
    >>> levels_of_states([0, 1, 2, 3]).tolist()
    [0, 1, 3, 2]
    """
    return _gray(_checks.codes("states", states, 3))


def states_of_levels(levels: ArrayLike) -> NDArray[np.uint8]:
    """Return the angle states of level codes, the inverse of :func:`levels_of_states`.

    Parameters
    ----------
    levels
        Level codes 0..3, shape (n,).

    Returns
    -------
    numpy.ndarray
        Angle states 0..3, uint8, shape (n,).

    Raises
    ------
    ArgumentError
        A level that is no whole number 0..3.

    Examples
    --------
    >>> states_of_levels([0, 1, 3, 2]).tolist()
    [0, 1, 2, 3]
    """
    return _gray(_checks.codes("levels", levels, 3))


def count_deltas(levels: ArrayLike, initial: int) -> NDArray[np.int64]:
    """Return the count of each transition of a sequence of levels.

    Parameters
    ----------
    levels
        Level codes 0..3 one after another, shape (n,).
    initial
        Level code before the first.

    Returns
    -------
    numpy.ndarray
        +1 in the positive direction, -1 in the negative, 0 no change, ``ILLEGAL`` both lines at once; int64,
        shape (n,).

    Raises
    ------
    ArgumentError
        A level that is no whole number 0..3.

    Examples
    --------
    >>> count_deltas([1, 3, 1, 2], initial=0).tolist()
    [1, 1, -1, 2]
    """
    after = _checks.codes("levels", levels, 3)
    before = np.empty_like(after)
    before[:1] = _checks.code("initial", initial, 3)
    before[1:] = after[:-1]
    return np.take(DELTA, before * 4 + after)
