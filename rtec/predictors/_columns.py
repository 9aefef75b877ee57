"""Checks shared by everything that is made of columns of numbers: finite, equally long, ascending."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError

Floats = npt.NDArray[np.float64]

LARGEST = 1e6
"""Largest magnitude taken: a position of 1 km in mm; beyond it a unit is wrong, and differences lose their digits."""


def column(name: str, values: npt.ArrayLike, *, rows: int | None = None) -> Floats:
    """Return ``values`` as a read-only copy in one dimension.

    Parameters
    ----------
    name
        Name for the error message.
    values
        Numbers; each finite and within ±``LARGEST``.
    rows
        The length that the column must have, where another one sets it.

    Raises
    ------
    ArgumentError
        Not one-dimensional, of another length, or with a value that is missing, not finite or too large (its row is
        named, counted from 1).

    Examples
    --------
    >>> column("errors_mm", [0.001, float("nan")])
    Traceback (most recent call last):
    rtec.errors.ArgumentError: errors_mm, row 2: nan is not valid; use a finite number within ±1e+06
    """
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ArgumentError(name, repr(values)[:60], "a list of numbers") from None
    if array.ndim != 1:
        raise ArgumentError(name, f"an array of shape {array.shape}", "a list of numbers (one dimension)")
    if rows is not None and array.size != rows:
        raise ArgumentError(name, f"a column of {array.size}", f"{rows} numbers, one for each position")
    bad = np.flatnonzero(~(np.abs(array) <= LARGEST))
    if bad.size:
        row = int(bad[0])
        raise ArgumentError(f"{name}, row {row + 1}", f"{array[row]:g}", f"a finite number within ±{LARGEST:g}")
    array.setflags(write=False)
    return array


def length(name: str, value: float) -> float:
    """Return a length in mm that is clearly above zero.

    Raises
    ------
    ArgumentError
        No finite number, or below a nanometre.

    Examples
    --------
    >>> length("pitch_mm", 6.35)
    6.35
    """
    found = float(column(name, [value])[0])
    if not found >= 1e-6:
        raise ArgumentError(name, found, f"1e-06 to {LARGEST:g} mm")
    return found


def span(name: str, ends: object, *, most: float = LARGEST) -> tuple[float, float]:
    """Return the lower and the upper end of a range.

    Parameters
    ----------
    name
        Name for the error message.
    ends
        Two numbers.
    most
        Largest magnitude of an end.

    Raises
    ------
    ArgumentError
        Not two numbers, one that is too large, or a range without length.

    Examples
    --------
    >>> span("range_mm", [0, 10])
    (0.0, 10.0)
    """
    try:
        low, high = (float(end) for end in ends)  # type: ignore[attr-defined]  # what is no pair is refused below
    except (TypeError, ValueError, OverflowError):
        raise ArgumentError(name, repr(ends)[:60], "its lower and its upper end") from None
    if not low < high:
        raise ArgumentError(name, f"{low:g} to {high:g}", "the lower end first, and a length above 0")
    if max(-low, high) > most:
        raise ArgumentError(name, f"{low:g} to {high:g}", f"ends within ±{most:g}")
    return low, high


def first_disorder(positions: Floats) -> int | None:
    """Return the index of the first position that is not above the one before it, or None.

    Examples
    --------
    >>> first_disorder(np.array([0.0, 1.0, 1.0]))
    2
    """
    disorder = np.flatnonzero(~(np.diff(positions) > 0.0))
    return int(disorder[0]) + 1 if disorder.size else None


def ascending(name: str, values: npt.ArrayLike) -> Floats:
    """Return a column of at least two positions that ascend strictly.

    Raises
    ------
    ArgumentError
        Fewer than two positions, or one that repeats or falls back (its row is named, counted from 1).

    Examples
    --------
    >>> ascending("positions_mm", [0.0, 2.0, 1.0])
    Traceback (most recent call last):
    rtec.errors.ArgumentError: positions_mm, row 3: 1 after 2 is not valid; use strictly ascending positions
    """
    positions = column(name, values)
    if positions.size < 2:
        raise ArgumentError(name, f"a column of {positions.size}", "at least two positions")
    index = first_disorder(positions)
    if index is not None:
        found = f"{positions[index]:.15g} after {positions[index - 1]:.15g}"
        raise ArgumentError(f"{name}, row {index + 1}", found, "strictly ascending positions")
    return positions
