"""What a model offers: a compiled function of what sensors say, with its numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol, runtime_checkable

import numpy.typing as npt

from rtec.predictors._columns import Floats

FORWARD = 1
"""Direction of motion towards larger positions."""
REVERSE = -1
"""Direction of motion towards smaller positions."""


@runtime_checkable
class Model(Protocol):
    """The PC's model of an axis: its error as a function of what sensors say.

    The error is the deviation, actual minus target, in mm (ISO 230-2). It is what was measured; a compensation is its
    negative. The function is compiled; `rtec.predictors._kernels` says what it takes.
    """

    @property
    def function(self) -> Callable[..., float]:
        """The error in mm as ``function(numbers, inputs, memory, sd)``, that numba can compile."""

    @property
    def inputs(self) -> tuple[str, ...]:
        """Sensors by name: position, direction, velocity, time, position_1 to position_15, those of heat.

        Those of heat are temperature_NAME and spindle_speed.
        """

    @property
    def numbers(self) -> npt.ArrayLike:
        """One-dimensional: what the function computes with."""

    @property
    def memory(self) -> npt.ArrayLike:
        """One-dimensional: what the function remembers at the start."""

    @property
    def range_mm(self) -> tuple[float, float]:
        """Lowest and highest position, in mm, for which both directions are known."""

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Lowest and highest value of other inputs for which the model was made; without, all."""


@runtime_checkable
class Predictor(Model, Protocol):
    """A model of position and direction, a curve for each direction; perhaps of where other axes stand, too."""

    def error_mm(self, position_mm: npt.ArrayLike, direction: npt.ArrayLike, *others_mm: npt.ArrayLike) -> Floats:
        """Return the error in mm at each position."""
