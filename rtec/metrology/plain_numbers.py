"""Numbers and texts as instruments write them, and how a message shows them."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

PLAIN_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
"""A number as instruments write it: digits of ASCII, a point, an exponent."""
LONGEST_SHOWN = 40
"""Characters of what a file holds that a message shows."""


def shown(text: str) -> str:
    """Return ``text`` quoted and short enough for a one-line message.

    Examples
    --------
    >>> shown("abc")
    "'abc'"
    """
    return repr(text if len(text) <= LONGEST_SHOWN else text[: LONGEST_SHOWN - 3] + "...")


def plain_numbers(lines: list[str], columns: int, delimiter: str | None) -> NDArray[np.float64] | None:
    """Return rows of finite numbers in one quick sweep, shape (rows, columns), or None where anything else is met.

    The lines are those of the rows, of which empty ones are passed over; a delimiter None is white space. None says
    only that a slower reader has to find out what is wrong and where.

    Examples
    --------
    >>> plain_numbers(["1,2", "3,4"], 2, ",").tolist()
    [[1.0, 2.0], [3.0, 4.0]]
    >>> plain_numbers(["1,2", "3,nan"], 2, ",") is None
    True
    """
    if not any(line.strip() for line in lines):
        return None
    try:
        rows = np.loadtxt(lines, delimiter=delimiter, comments=None, ndmin=2)
    except (ValueError, OverflowError):
        return None
    return rows if rows.shape[1] == columns and np.isfinite(rows).all() else None
