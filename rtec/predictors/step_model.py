"""A model of one's own: a function of what sensors say, with numbers, a memory, and the ranges it was made for."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy.typing as npt

from rtec.compiled import finite_array
from rtec.errors import ArgumentError
from rtec.predictors import _kernels
from rtec.predictors._columns import LARGEST, span
from rtec.predictors.binding import CURVE, OF_TEMPERATURE


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepModel:
    """The PC's model of an axis, as a function of its sensors.

    Parameters
    ----------
    function
        ``function(numbers, inputs, memory, sd) -> error in mm``, all four one-dimensional arrays of float64, such
        that numba can compile it. It may keep what it likes in ``memory``, and write the standard deviation of what
        it returns, in mm, into ``sd[0]``: the PC then asks for the near end of the 90 % interval. It is called once
        for every turn of the PC, some 10 ms apart.
    inputs
        Sensors by name, in the order of ``inputs``: ``position`` (mm) and ``direction`` (+1, -1) of the axis, its
        ``velocity`` (mm/s, from one reading to the next), ``time`` (s, on the PC's clock), ``position_1`` to
        ``position_15`` of all axes (mm), ``temperature_NAME`` (degrees Celsius), ``spindle_speed`` (rev/min).
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
        if not callable(self.function):
            raise ArgumentError("function", repr(self.function)[:60], "a function (numbers, inputs, memory, sd)")
        object.__setattr__(self, "inputs", _names(self.inputs))
        for name in ("numbers", "memory"):
            object.__setattr__(self, name, finite_array(name, getattr(self, name)))
        if not isinstance(self.ranges, Mapping):
            raise ArgumentError(
                "ranges", repr(self.ranges)[:60], "the lowest and highest value by the name of an input"
            )
        object.__setattr__(self, "range_mm", span("range_mm", self.range_mm))
        ranges = {name: span(f"range of {name}", ends, most=math.inf) for name, ends in self.ranges.items()}
        for name in ranges:
            if name not in self.inputs or name == "position":
                others = ", ".join(other for other in self.inputs if other != "position")
                raise ArgumentError("ranges", str(name)[:60], f"an input: {others}", "positions have range_mm")
        object.__setattr__(self, "ranges", ranges)


def growth(sensor: str, mm_per_k: float, *, from_degc: float = 20.0) -> StepModel:
    """Return the model of an axis that grows in proportion to one temperature, the same everywhere.

    Parameters
    ----------
    sensor
        Name of the temperature sensor.
    mm_per_k
        Growth for each degree.
    from_degc
        Temperature at which there is none.

    Examples
    --------
    >>> growth("screw", 0.002).inputs
    ('temperature_screw',)
    """
    function: Callable[..., float] = _kernels.growth_error
    return StepModel(function=function, inputs=(OF_TEMPERATURE + sensor,), numbers=[from_degc, mm_per_k])


def _names(given: Sequence[str]) -> tuple[str, ...]:
    names = (given,) if isinstance(given, str) else tuple(given) if isinstance(given, Sequence) else ()
    if not names or len(set(names)) != len(names) or not all(isinstance(name, str) for name in names):
        raise ArgumentError(
            "inputs", ", ".join(map(str, names))[:200] or "none", "one or more sensors by name, each once"
        )
    return names
