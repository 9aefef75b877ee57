"""What the drive moves, where that is more than a rigid axis: a function of what the position loop asks for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rtec.axis._plant_kernels import INPUTS, MOST_STATE, no_plant
from rtec.compiled import address_of_function, finite_array
from rtec.errors import ArgumentError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plant:
    """What the position loop moves, in place of a rigid axis behind a velocity loop with a lag.

    Raises
    ------
    ArgumentError
        No function, too many numbers of state, or one that is not finite.

    Examples
    --------
    A velocity loop that follows at once:

    >>> def at_once(numbers, inputs, state):
    ...     return (inputs[0] - inputs[1]) / inputs[3]
    >>> Plant(function=at_once).state.tolist()
    [0.0]
    """

    function: Callable[..., float]
    """``function(numbers, inputs, state) -> acceleration`` in mm/s², all three one-dimensional arrays of float64,
    such that numba can compile it. ``inputs`` are the velocity that the position loop asks for (mm/s), velocity
    (mm/s) and position (mm) of what the encoder sees, the length of the tick (s) and the time at its beginning (s),
    the position that the controller has counted (mm), and the acceleration of the command (mm/s²).
    The acceleration is that of what the encoder sees, and holds for the tick. ``state`` is its own to keep, but for
    ``state[0]``: by how much the slide stands beyond what the encoder sees, in mm."""
    numbers: npt.NDArray[np.float64] = ()  # type: ignore[assignment]  # any list of numbers
    """What it computes with."""
    state: npt.NDArray[np.float64] = (0.0,)  # type: ignore[assignment]  # as above
    """What it begins with: one number to 32."""
    outputs: tuple[str, ...] = ()
    """Names, with units, of ``state[1]`` and those that follow, which a trace of the run records."""

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise ArgumentError("function", repr(self.function)[:60], "a function (numbers, inputs, state)")
        for name in ("numbers", "state"):
            object.__setattr__(self, name, finite_array(name, getattr(self, name)))
        if not 1 <= self.state.size <= MOST_STATE:
            raise ArgumentError("state", f"{self.state.size} numbers", f"1 to {MOST_STATE}")
        if len(self.outputs) >= self.state.size:
            allowed = f"at most {self.state.size - 1}, as its state has {self.state.size}"
            raise ArgumentError("outputs", f"{len(self.outputs)} names", allowed)


def bound_plant(plant: Plant | None, *, places: int = 1) -> tuple[Any, ...]:
    """Return a plant as the kernels take it, with a state for each of so many axes; None is a rigid axis."""
    function: Callable[..., float] = no_plant if plant is None else plant.function
    numbers, state = np.empty(0), np.zeros(MOST_STATE)
    if plant is not None:
        numbers = np.array(plant.numbers)
        state[: plant.state.size] = plant.state
    address = address_of_function(function, ("numbers", "inputs", "state"), "the acceleration in mm/s²")
    return address, numbers, np.zeros(INPUTS), np.tile(state, (places, 1))
