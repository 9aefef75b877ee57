"""A NARX network as the PC's model of an axis: it predicts the deviation from the motion that the PC reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors import _motion_kernels as kernels
from rtec.predictors._columns import LARGEST, Floats
from rtec.predictors.motion_file import MM_OF, KnownMotion, read_motion
from rtec.predictors.narx import Narx

_SENSED = ("velocity", "acceleration")
_BEYOND = 0.02
"""Of the range of a velocity in training: so much farther it may go before the PC holds the machine."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionModel:
    """A trained network of the deviation, stepped at each reading of the PC; steps between two are made up for.

    The acceleration is the difference of velocities; what is remembered begins at rest, with no deviation.

    Raises
    ------
    ArgumentError
        No NARX network, one that predicts something else than a deviation in um or mm, or one with inputs that the
        PC does not sense.

    Examples
    --------
    >>> from rtec.predictors.motion_file import head_of
    >>> from rtec.predictors.narx import NarxShape
    >>> shape = NarxShape(channels=1, neurons=1, input_delays=(0,), feedback_delays=(1,))
    >>> lag = Narx(shape=shape, names=("velocity",), period_s=0.01, middle=[0.0, 0.0], half=[1.0, 1.0],
    ...            weights=[0.0, 0.0, 0.0, 0.0, 0.0, 16.0, 0.0])
    >>> MotionModel(known=KnownMotion(model=lag, head=head_of(lag, "deviation"), name="lag")).inputs
    ('velocity', 'time')
    """

    known: KnownMotion
    unsure_mm: float = 0.0
    """By how much requests are reduced, where the PC is cautious."""
    inputs: tuple[str, ...] = field(default=("velocity", "time"), init=False)
    range_mm: tuple[float, float] = field(default=(-LARGEST, LARGEST), init=False)

    def __post_init__(self) -> None:
        head = self.known.head
        if not isinstance(self.known.model, Narx):
            raise ArgumentError("model", self.known.name, "a NARX network: 'rtec train --dynamic --pick NARX'")
        if head.observe != "deviation" or head.unit not in MM_OF:
            found = f"of {head.observe} in {head.unit or 'no unit'}"
            allowed = "one of the deviation in um or mm: 'rtec train --dynamic --observe deviation'"
            raise ArgumentError("model", found, allowed)
        for name in head.names:
            if name not in _SENSED:
                raise ArgumentError("model", f"with the input {name}", "what the PC reads: velocity, acceleration")

    @property
    def network(self) -> Narx:
        """The network."""
        return cast(Narx, self.known.model)  # checked above

    @property
    def function(self) -> Callable[..., float]:
        """The error in mm, compiled."""
        found: Callable[..., float] = kernels.motion_error
        return found

    @property
    def numbers(self) -> Floats:
        """As `rtec.predictors._motion_kernels` takes them."""
        narx, shape = self.network, self.network.shape
        places = [narx.names.index(name) if name in narx.names else -1 for name in _SENSED]
        head = [narx.period_s, MM_OF[narx.unit], *places, shape.channels, len(shape.input_delays)]
        head += [len(shape.feedback_delays), shape.neurons, float(shape.linear), shape.lags]
        parts = [head, shape.input_delays, shape.feedback_delays, narx.middle, narx.half, narx.weights]
        return np.concatenate([np.asarray(part, dtype=np.float64) for part in parts])

    @property
    def memory(self) -> Floats:
        """Nothing seen yet."""
        shape = self.network.shape
        return np.zeros(kernels.MEMORY_HEAD + shape.channels * (shape.lags + 1) + shape.lags)

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """The trained velocities: outside, the PC holds the machine."""
        narx = self.network
        if "velocity" not in narx.names:
            return {}
        place = narx.names.index("velocity")
        middle, half = float(narx.middle[place]), (1.0 + 2.0 * _BEYOND) * float(narx.half[place])
        return {"velocity": (middle - half, middle + half)}


def model_of_motion(path: str | Path, *, cautious: bool = False) -> MotionModel:
    """Return the network of a file as the PC's model.

    Parameters
    ----------
    path
        Written by ``rtec train --dynamic``.
    cautious
        Whether requests are reduced to what its interval supports.

    Raises
    ------
    RtecError
        As for `read_motion` and `MotionModel`, or caution with a file that has no interval.
    """
    known = read_motion(path)
    if not cautious:
        return MotionModel(known=known)
    if known.interval is None:
        raise ArgumentError("cautious", f"{path} without an interval", "a file with one")
    return MotionModel(known=known, unsure_mm=known.interval * MM_OF.get(known.head.unit, 1.0))
