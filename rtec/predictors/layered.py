"""Trained networks as predictors: sums of networks of logistic neurons, their scaling kept with the weights."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtec.errors import ArgumentError, unknown
from rtec.predictors import _kernels
from rtec.predictors._columns import Floats, column, length, span
from rtec.predictors.axis_tables import reach_of
from rtec.predictors.binding import is_other_axis
from rtec.predictors.curve import Curve, Reach

INPUTS = {"position": (0, _kernels.PLAIN), "direction": (1, _kernels.SIGN), "turn": (0, _kernels.TURN)}
"""What a network may look at: the position, the direction (0 forward, 1 reverse), the place in the turn; and how the
compiled function finds it."""
TOUCH_MM = 0.0005
"""A position at most this far below a multiple of the pitch counts as that multiple.

It is half a count of the lathe's scale. The printed cyclic network jumps where the screw has turned once, which no
screw does. An axis at rest at such a target stands up to half a count beside it, and must not fall on the wrong side
of the jump.
"""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LayeredNetwork:
    """One network of logistic neurons with a linear output.

    Raises
    ------
    ArgumentError
        An unknown input, columns of the wrong length, or numbers that are not finite.

    Examples
    --------
    >>> LayeredNetwork(inputs=("position",), middle=[0.0], half=[10.0], hidden=(1,), weights=[1.0, 0.0, 2.0, -1.0],
    ...                bias_mm=0.0, factor_mm=0.001).weights.size
    4
    """

    inputs: tuple[str, ...]
    """Names of ``INPUTS``, or positions of other axes (``position_NUMBER``), in order."""
    middle: Floats
    half: Floats
    """An input is what it stands for (mm; 0 or 1 for the direction) less its middle, divided by its half width; one
    number an input."""
    hidden: tuple[int, ...]
    """Neurons of each hidden layer."""
    weights: Floats
    """Layer by layer: ``[input, neuron]``, then biases."""
    bias_mm: float
    factor_mm: float
    """The error is ``bias_mm + factor_mm * output``."""

    def __post_init__(self) -> None:
        for name in self.inputs:
            if name not in tuple(INPUTS) and not is_other_axis(name):
                raise unknown("inputs", str(name), [*INPUTS, "position_2"], noun="input")
        if not 1 <= len(self.inputs) <= _kernels.MOST_NEURONS:
            raise ArgumentError("inputs", len(self.inputs), "one or more")
        if not self.hidden or not all(1 <= n <= _kernels.MOST_NEURONS for n in self.hidden):
            found = ", ".join(map(str, self.hidden)) or "no layer"
            raise ArgumentError("hidden", found[:60], f"layers of 1 to {_kernels.MOST_NEURONS} neurons")
        widths = (len(self.inputs), *self.hidden, 1)
        rows = sum((before + 1) * after for before, after in itertools.pairwise(widths))
        for name, size in (("middle", widths[0]), ("half", widths[0]), ("weights", rows)):
            values = column(name, getattr(self, name))
            if values.size != size:
                raise ArgumentError(name, f"{values.size} numbers", f"{size}, for {len(self.inputs)} inputs")
            object.__setattr__(self, name, values)
        if not (self.half > 0.0).all():
            raise ArgumentError("half", f"{self.half.min():g}", "half widths above 0")
        for name in ("bias_mm", "factor_mm"):
            object.__setattr__(self, name, float(column(name, [getattr(self, name)])[0]))

    @property
    def reach_mm(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest position of each other axis that it looks at, by its name."""
        ends = zip(self.inputs, self.middle - self.half, self.middle + self.half, strict=True)
        return {name: (float(low), float(high)) for name, low, high in ends if name not in INPUTS}

    def numbers(self, inputs: Sequence[str]) -> Floats:
        """Return the network as it stands in the numbers of a predictor with these inputs (see ``_kernels.py``)."""
        seen = []
        for name, middle, half in zip(self.inputs, self.middle, self.half, strict=True):
            place, kind = INPUTS[name] if name in INPUTS else (inputs.index(name), _kernels.HELD)
            seen.append([float(place), float(kind), middle, half])
        head = [float(len(self.inputs)), float(len(self.hidden)), *map(float, self.hidden)]
        return np.concatenate([head, *seen, self.weights, [self.bias_mm, self.factor_mm]])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrainedNetworks(Curve):
    """Error of an axis as the sum of one network or several.

    Raises
    ------
    ArgumentError
        No network, a pitch not above zero, or a range without length.

    References
    ----------
    Thesis 5.4 and Figures 5.5, 5.7.

    Examples
    --------
    >>> flat = LayeredNetwork(inputs=("position",), middle=[0.0], half=[10.0], hidden=(1,),
    ...                       weights=[0.0, 0.0, 2.0, 1.0], bias_mm=0.0, factor_mm=0.001)
    >>> float(TrainedNetworks(networks=(flat,), range_mm=(0.0, 10.0)).error_mm(5.0, +1))
    0.002
    """

    networks: tuple[LayeredNetwork, ...]
    """Whose outputs are added."""
    range_mm: tuple[float, float]
    """Lowest and highest position for which they were trained. Beyond, the error of the end is held: a network says
    anything there."""
    pitch_mm: float = 1.0
    """Travel of a turn of the screw; above 0 mm. Without a network that looks at the turn it does not matter."""
    function = staticmethod(_kernels.layered_error)

    def __post_init__(self) -> None:
        if not 1 <= len(self.networks) <= 4:
            raise ArgumentError("networks", len(self.networks), "1 to 4 networks")
        object.__setattr__(self, "pitch_mm", length("pitch_mm", self.pitch_mm))
        object.__setattr__(self, "range_mm", span("range_mm", self.range_mm))

    @property
    def reach_mm(self) -> Reach:
        """Where the other axes stood, by name."""
        return reach_of(network.reach_mm for network in self.networks)

    @property
    def numbers(self) -> Floats:
        """A new array; its layout stands in ``_kernels.py``."""
        inputs = self.inputs
        most = max(n for network in self.networks for n in (len(network.inputs), *network.hidden))
        most = _kernels.EIGHT * math.ceil(most / _kernels.EIGHT)
        head = [*self.range_mm, self.pitch_mm, TOUCH_MM, float(len(self.networks)), float(most)]
        return np.concatenate([head, np.zeros(2 * most), *(network.numbers(inputs) for network in self.networks)])
