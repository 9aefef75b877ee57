"""How a column is cut into states."""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from rtec.predictors._columns import Floats


class Cutting(StrEnum):
    """What the states of a column have in common."""

    EQUAL_COUNTS = "equal counts"
    EQUAL_WIDTHS = "equal widths"


def cuts_of(values: Floats, states: int, cutting: Cutting) -> Floats:
    """Return where a column is cut, ascending: at most ``states - 1`` places, none where it is constant.

    A cut by counts stands in the middle between two values that occur, so that none is split; a column with few
    values, such as a speed, has a state for each.

    Examples
    --------
    >>> cuts_of(np.array([0.0, 0.0, 0.0, 2000.0, 4000.0]), 8, Cutting.EQUAL_COUNTS).tolist()
    [1000.0, 3000.0]
    >>> cuts_of(np.array([0.0, 1.0, 8.0]), 4, Cutting.EQUAL_WIDTHS).tolist()
    [2.0, 4.0, 6.0]
    """
    found, counts = np.unique(values, return_counts=True)
    if found.size < 2:
        return np.zeros(0)
    if cutting is Cutting.EQUAL_WIDTHS:
        return np.linspace(found[0], found[-1], states + 1)[1:-1]
    between = (found[1:] + found[:-1]) / 2.0
    if found.size <= states:
        return between
    reached = np.cumsum(counts)[:-1]
    wanted = np.arange(1, states) * (values.size / states)
    right = np.clip(np.searchsorted(reached, wanted), 1, reached.size - 1)
    nearer = np.where(wanted - reached[right - 1] <= reached[right] - wanted, right - 1, right)
    chosen: Floats = between[np.unique(nearer)]
    return chosen
