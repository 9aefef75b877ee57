"""A model of one's own: a function of what sensors say, with numbers, a memory, and the ranges it was made for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors._columns import LARGEST
from rtec.predictors.binding import CURVE
from rtec.predictors.protocol import Floats


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepModel:
    """What the PC believes of an axis, as a function of its sensors.

    Parameters
    ----------
    function
        ``function(numbers, inputs, memory, sd) -> error in mm``, all four one-dimensional arrays of float64, such
        that numba can compile it. It may keep what it likes in ``memory``, and write the standard deviation of what
        it returns, in mm, into ``sd[0]``. It is called once for every turn of the PC, some 10 ms apart.
    inputs
        Sensors by name, in the order of ``inputs``: ``position`` (mm) and ``direction`` (+1, -1) of the axis, its
        ``velocity`` (mm/s, from one turn of the PC to the next), ``time`` (s, on the PC's clock), ``position_1`` to
        ``position_15`` of all axes (mm), ``temperature_NAME`` (degrees Celsius).
    numbers
        What it computes with.
    memory
        What it remembers at the start.
    range_mm
        Lowest and highest position for which it was made.
    ranges
        Lowest and highest value of other inputs for which it was made: outside, the PC holds the machine.

    Raises
    ------
    ArgumentError
        No inputs, a range of no input or without length, or numbers that are not finite.

    Examples
    --------
    A slope that grows with the temperature of the screw, by 11.5 µm for each metre and degree:

    >>> def grows(numbers, inputs, memory, sd):
    ...     return numbers[0] * (inputs[1] - 20.0) * inputs[0]
    >>> StepModel(function=grows, inputs=("position", "temperature_screw"), numbers=[11.5e-6]).inputs
    ('position', 'temperature_screw')
    """

    function: Callable[..., float]
    inputs: tuple[str, ...] = CURVE
    numbers: npt.ArrayLike = ()
    memory: npt.ArrayLike = ()
    range_mm: tuple[float, float] = (-LARGEST, LARGEST)
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check what can be checked before the machine is known."""
        object.__setattr__(self, "inputs", _names(self.inputs))
        for name in ("numbers", "memory"):
            object.__setattr__(self, name, _finite(name, getattr(self, name)))
        for name, (low, high) in {"position": self.range_mm, **self.ranges}.items():
            if name != "position" and name not in self.inputs:
                raise ArgumentError("ranges", name, f"an input: {', '.join(self.inputs)}")
            if not low < high:
                raise ArgumentError(
                    f"range of {name}", f"{low:g} to {high:g}", "the lower end first, and a length above 0"
                )
        object.__setattr__(self, "ranges", dict(self.ranges))


def _names(given: Sequence[str]) -> tuple[str, ...]:
    names = (given,) if isinstance(given, str) else tuple(given)
    if not names or len(set(names)) != len(names):
        raise ArgumentError("inputs", ", ".join(names) or "none", "one or more sensors by name, each once")
    return names


def _finite(name: str, values: npt.ArrayLike) -> Floats:
    try:
        array = np.array(values, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError, OverflowError):
        raise ArgumentError(name, repr(values)[:60], "a list of numbers") from None
    if not np.isfinite(array).all():
        raise ArgumentError(name, "a number that is not finite", "finite numbers")
    array.setflags(write=False)
    return array
