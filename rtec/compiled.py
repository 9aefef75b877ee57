"""Functions of arrays, rtec's own and the user's, as values that compiled loops call by their address."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from typing import Any

import numba

from rtec._jit import by_address, guarded
from rtec.errors import ArgumentError

_ARRAY = numba.float64[::1]
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


@functools.cache
def address_of_function(function: Callable[..., float], what: str) -> Any:
    """Return the address of a function of arrays of float64; one of the user's may raise, and says no number then.

    Parameters
    ----------
    function
        A kernel of rtec, or a function of the user's.
    what
        Its arguments in parentheses, and what it returns.

    Raises
    ------
    ArgumentError
        A function that cannot be compiled.
    """
    own = getattr(function, "__module__", "").startswith("rtec.") and hasattr(function, "py_func")
    arguments = what[: what.index(")")].count(",") + 1
    try:
        return by_address(function if own else guarded(function, arguments), (_ARRAY,) * arguments)
    except (numba.core.errors.NumbaError, TypeError, RuntimeError, ValueError) as error:
        lines = [line.strip() for line in _COLOUR.sub("", str(error)).splitlines()]
        why = next((line for line in lines if line and not line.startswith(("Failed in", "During", "File"))), "")
        name = getattr(function, "__name__", repr(function)[:60])
        raise ArgumentError("function", name, f"a function {what} that numba can compile", why[:200]) from None
