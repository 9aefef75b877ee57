"""Functions of arrays, rtec's own and the user's, as values that compiled loops call by their address."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import numpy.typing as npt

from firmware_model._jit import address_of
from rtec._jit import guarded
from rtec.errors import ArgumentError

_ARRAY = numba.float64[::1]
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


@functools.cache
def address_of_function(function: Callable[..., float], arguments: tuple[str, ...], returned: str) -> Any:
    """Return the address of a function of arrays of float64; one of the user's may raise, and says no number then.

    Parameters
    ----------
    function
        A kernel of rtec, or a function of the user's.
    arguments
        Their names, for the error message: three or four of a user's.
    returned
        What it returns.

    Raises
    ------
    ArgumentError
        A function that cannot be compiled.
    """
    own = getattr(function, "__module__", "").startswith("rtec.") and hasattr(function, "py_func")
    try:
        return address_of(function if own else guarded(function, len(arguments)), (_ARRAY,) * len(arguments))
    except (numba.core.errors.NumbaError, TypeError, RuntimeError, ValueError) as error:
        lines = [line.strip() for line in _COLOUR.sub("", str(error)).splitlines()]
        why = next((line for line in lines if line and not line.startswith(("Failed in", "During", "File"))), "")
        name = getattr(function, "__name__", repr(function)[:60])
        what = f"a function ({', '.join(arguments)}) of {returned} that numba can compile"
        raise ArgumentError("function", name, what, why[:200]) from None


def finite_array(name: str, values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return numbers for such a function as a read-only copy in one dimension.

    Raises
    ------
    ArgumentError
        No numbers, or one that is not finite.

    Examples
    --------
    >>> finite_array("numbers", (1, 2.5)).tolist()
    [1.0, 2.5]
    """
    try:
        array = np.array(values, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError, OverflowError):
        raise ArgumentError(name, repr(values)[:60], "a list of numbers") from None
    if not np.isfinite(array).all():
        raise ArgumentError(name, "a number that is not finite", "finite numbers")
    array.setflags(write=False)
    return array
