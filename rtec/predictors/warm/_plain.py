"""Reading the plain data of a regressor: names, shapes and finite numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats

Plain: TypeAlias = dict[str, list[float] | list[int] | list[str] | float | int | str]
"""What files take: lists of numbers, in the order of rows, or of names, and single ones."""
MOST_WHOLE = 1_000_000


def number(plain: Mapping[str, Any], name: str, *, above: float = -math.inf) -> float:
    """Return a finite number that is above a limit.

    Raises
    ------
    ArgumentError
        It is missing, no number, or not above the limit.
    """
    value = plain.get(name)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not above < value < math.inf:
        allowed = "a finite number" if above == -math.inf else f"a finite number above {above:g}"
        raise ArgumentError(name, value, allowed)
    return float(value)


def array(plain: Mapping[str, Any], name: str, size: int | None = None, *, least: int = 1) -> Floats:
    """Return a list of finite numbers as an array of so many, or of a multiple of ``least``.

    Raises
    ------
    ArgumentError
        It is missing, holds what is no finite number, or has another length.
    """
    try:
        found = np.array(plain[name], dtype=np.float64)
    except (KeyError, TypeError, ValueError):
        raise ArgumentError(name, plain.get(name) and "a list with other things", "a list of numbers") from None
    if found.ndim != 1 or not np.isfinite(found).all():
        raise ArgumentError(name, "a list with other things", "a list of finite numbers")
    if size is not None and found.size != size:
        raise ArgumentError(name, f"a list of {found.size}", f"{size} numbers")
    if found.size % least:
        raise ArgumentError(name, f"a list of {found.size}", f"a multiple of {least} numbers, one for each feature")
    return found


def whole(plain: Mapping[str, Any], name: str, size: int | None = None) -> list[int]:
    """Return a list of whole numbers from -1 to a million.

    Raises
    ------
    ArgumentError
        It is missing, holds other things, or has another length.
    """
    found = array(plain, name, size)
    if not ((found % 1.0 == 0.0) & (found >= -1.0) & (found <= MOST_WHOLE)).all():
        raise ArgumentError(name, "a list with other things", f"whole numbers up to {MOST_WHOLE}")
    return [int(one) for one in found]


def names(plain: Mapping[str, Any], name: str) -> tuple[str, ...]:
    """Return a list of names.

    Raises
    ------
    ArgumentError
        It is missing, or holds other things.
    """
    found = plain.get(name)
    if not isinstance(found, list | tuple) or not all(isinstance(one, str) for one in found):
        raise ArgumentError(name, found and "a list with other things", "a list of names")
    return tuple(found)
