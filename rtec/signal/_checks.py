"""Checks that every stream passes on its way in: whole picoseconds, strictly increasing; levels from a small set."""

from __future__ import annotations

import operator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rtec.errors import ArgumentError
from rtec.io import brief
from rtec.signal._kernels import NEVER


def whole_numbers(name: str, values: ArrayLike, allowed: str) -> NDArray[np.signedinteger | np.unsignedinteger]:
    """Return ``values`` as a one-dimensional array of whole numbers, not copied where it is one already."""
    try:
        array = np.asarray(values)
    except (ValueError, OverflowError, TypeError) as error:
        raise ArgumentError(name, f"a sequence that is no array ({error})", allowed) from error
    if array.ndim != 1:
        raise ArgumentError(name, f"an array of shape {array.shape}", f"a one-dimensional array: {allowed}")
    if array.size == 0:
        return np.empty(0, dtype=np.int64)
    if array.dtype.kind not in "iu":
        raise ArgumentError(f"{name}[0]", f"{brief(array[0], 60)} of type {array.dtype}", allowed)
    return array


def times_ps(name: str, values: ArrayLike) -> NDArray[np.int64]:
    """Return strictly increasing times inside (-NEVER, NEVER) as int64, read-only and in one block of memory.

    So kernels are compiled once: for arrays with gaps or open to writing they would be compiled anew.
    """
    array = whole_numbers(name, values, "whole picoseconds (int64)")
    if array.size:
        for index in (0, array.size - 1):
            if not -NEVER < int(array[index]) < NEVER:
                raise ArgumentError(f"{name}[{index}]", f"{array[index]} ps", f"times within ±{NEVER - 1} ps")
    late = array[1:] <= array[:-1]
    if late.any():
        index = int(np.argmax(late)) + 1
        raise ArgumentError(
            f"{name}[{index}]", f"{array[index]} ps after {array[index - 1]} ps", "strictly increasing times"
        )
    view = np.ascontiguousarray(array, np.int64).view()
    view.flags.writeable = False
    return view


def codes(name: str, values: ArrayLike, highest: int) -> NDArray[np.uint8]:
    """Return whole numbers 0..``highest`` as uint8, read-only and in one block of memory."""
    allowed = f"a whole number from 0 to {highest}"
    array = whole_numbers(name, values, allowed)
    outside = (array < 0) | (array > highest)
    if outside.any():
        index = int(np.argmax(outside))
        raise ArgumentError(f"{name}[{index}]", array[index], allowed)
    view = np.ascontiguousarray(array, np.uint8).view()
    view.flags.writeable = False
    return view


def code(name: str, value: object, highest: int) -> int:
    """Return ``value`` as a whole number 0..``highest``."""
    number = whole_number(name, value, f"a whole number from 0 to {highest}")
    if not 0 <= number <= highest:
        raise ArgumentError(name, brief(number, 60), f"a whole number from 0 to {highest}")
    return number


def time_ps(name: str, value: object) -> int:
    """Return ``value`` as whole picoseconds within ±NEVER."""
    number = whole_number(name, value, "whole picoseconds")
    if not -NEVER <= number <= NEVER:
        raise ArgumentError(name, f"{brief(number, 60)} ps", f"a time within ±{NEVER} ps")
    return number


def whole_number(name: str, value: object, allowed: str) -> int:
    """Return ``value`` as an int; a float, even a whole one, is refused."""
    try:
        return operator.index(value)  # type: ignore[arg-type]  # refuses what is no whole number
    except TypeError:
        raise ArgumentError(name, brief(value, 60), allowed) from None
