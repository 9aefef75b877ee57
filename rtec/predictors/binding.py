"""A model bound to the sensors of a machine: what the compiled loops take."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numba
import numpy as np

from rtec._jit import by_address
from rtec.errors import ArgumentError, nearest
from rtec.predictors import _kernels

if TYPE_CHECKING:
    from rtec.predictors.protocol import Model

CURVE = ("position", "direction")
"""Inputs of a curve over the position, one for each direction."""
OF_AXIS, OF_TEMPERATURE = "position_", "temperature_"
_PLACES = {
    "position": _kernels.POSITION,
    "direction": _kernels.DIRECTION,
    "velocity": _kernels.VELOCITY,
    "time": _kernels.TIME,
} | {f"{OF_AXIS}{axis}": _kernels.AXES + axis - 1 for axis in range(1, _kernels.MOST_AXES + 1)}
_ARRAY = numba.float64[::1]


def bound(model: Model, temperatures: Sequence[str] = (), *, places: int = 1) -> tuple[Any, ...]:
    """Return a model as the kernels take it, with room of its own for inputs and memory.

    Parameters
    ----------
    model
        What is believed of an axis.
    temperatures
        Names of the temperature sensors, as in ``temperature_NAME``, in the order in which they are read.

    places
        Number of axes at which it is at work: each has a memory of its own.

    Raises
    ------
    ArgumentError
        An input that no sensor gives, or a function that cannot be compiled.

    Examples
    --------
    >>> from rtec.predictors import NoError
    >>> _, _, wanted, *_ = bound(NoError())
    >>> wanted.tolist()
    [0, 1]
    """
    known = _PLACES | {OF_TEMPERATURE + name: _kernels.TEMPERATURES + k for k, name in enumerate(temperatures)}
    names = tuple(model.inputs)
    for name in names:
        if name not in known:
            here = [*CURVE, "velocity", "time", f"{OF_AXIS}1", *(OF_TEMPERATURE + t for t in temperatures)]
            raise ArgumentError(
                "model", f"an input {name!r}"[:80], f"what is sensed: {', '.join(here)}", nearest(name, here)
            )
    low, high = np.full((2, len(names)), [[-np.inf], [np.inf]])
    for k, name in enumerate(names):
        low[k], high[k] = model.ranges.get(name, (-np.inf, np.inf))
    numbers, memory = (np.array(values, dtype=np.float64) for values in (model.numbers, model.memory))
    wanted = np.array([known[name] for name in names], dtype=np.int64)
    inputs, each = np.zeros(len(names)), np.tile(memory, (places, 1))
    return _address(model.function), numbers, wanted, low, high, inputs, each, np.full(places, np.nan)


def rests(model: Model) -> bool:
    """Return whether a model says the same as long as the axis stands still."""
    return set(model.inputs) <= set(CURVE) and np.size(model.memory) == 0


@functools.cache
def _address(function: Callable[..., float]) -> Any:
    try:
        found = by_address(function, (_ARRAY,) * 4)
    except numba.core.errors.NumbaError as error:
        why = str(error).strip().splitlines()[0][:200]
        allowed = "a function (numbers, inputs, memory, sd) that numba can compile"
        raise ArgumentError("function", getattr(function, "__name__", "?"), allowed, why) from None
    if not callable(getattr(found, "signature", None)) or found.signature().return_type == numba.float64:
        return found
    returned = found.signature().return_type
    raise ArgumentError("function", f"one that returns {returned}", "one that returns a float, the error in mm")
