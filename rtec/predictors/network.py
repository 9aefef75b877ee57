"""Pairs of small sigmoid networks as predictors, and the network of the thesis's lathe.

One network describes the error over the whole length, the other the error within one turn of the screw; their outputs
are added (thesis 4.4.2 and Figure 4.6). The direction is an input of 0 or 1, so that it only changes the biases.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.predictors import _kernels, _lathe_weights
from rtec.predictors._columns import column, length, span
from rtec.predictors.protocol import Curve
from rtec.units import MM_PER_INCH

Floats = npt.NDArray[np.float64]

TOUCH_MM = 0.0005
"""A position at most this far below a multiple of the pitch counts as that multiple.

It is half a count of the lathe's scale. The printed cyclic network jumps where the screw has turned once, which no
screw does. An axis at rest at such a target stands up to half a count beside it, and must not fall on the wrong side
of the jump.
"""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SigmoidLayer:
    """One hidden layer of logistic neurons and its linear output neuron.

    The output is ``sum(output_weights * logsig(biases + position_weights * position)) + output_bias`` with
    ``logsig(x) = 1 / (1 + exp(-x))``.

    Parameters
    ----------
    position_weights, forward_biases, reverse_biases, output_weights
        One number a neuron. The reverse biases hold the weight of the direction input (1 in reverse).
    output_bias
        Bias of the output neuron.

    Raises
    ------
    ArgumentError
        Columns of different lengths, or a number that is not finite.

    References
    ----------
    Thesis, section 4.4.2, Figure 4.6.

    Examples
    --------
    >>> SigmoidLayer(position_weights=[1.0], forward_biases=[0.0], reverse_biases=[-2.0], output_weights=[0.002],
    ...              output_bias=-0.001).neurons
    1
    """

    position_weights: Floats
    forward_biases: Floats
    reverse_biases: Floats
    output_weights: Floats
    output_bias: float

    def __post_init__(self) -> None:
        rows = column("position_weights", self.position_weights).size
        for name in ("position_weights", "forward_biases", "reverse_biases", "output_weights"):
            object.__setattr__(self, name, column(name, getattr(self, name), rows=rows))
        object.__setattr__(self, "output_bias", float(column("output_bias", [self.output_bias])[0]))

    @property
    def neurons(self) -> int:
        """Number of hidden neurons."""
        return int(self.position_weights.size)

    @property
    def numbers(self) -> Floats:
        """The layer as it stands in the numbers of a network (see ``_kernels.py``)."""
        columns = (self.position_weights, self.forward_biases, self.reverse_biases, self.output_weights)
        return np.concatenate([[float(self.neurons)], *columns, [self.output_bias]])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SigmoidNetwork(Curve):
    """Error of an axis on a screw: a long-range network plus one that is periodic in the pitch.

    Parameters
    ----------
    long_range
        Network whose input is the position.
    cyclic
        Network whose input is the position modulo the pitch.
    pitch_mm
        Pitch of the screw, above 0 mm.
    range_mm
        Lowest and highest position; beyond them the error is held.
    unit_mm
        Millimetres in the unit of the networks' inputs and outputs.

    Raises
    ------
    ArgumentError
        A pitch or unit not above zero, or a range without length.

    Notes
    -----
    Nothing makes the cyclic network meet itself at the end of a turn. There the error jumps; a position at a multiple
    of the pitch, or at most half a micrometre below it, belongs to the turn that begins.

    Examples
    --------
    >>> flat = SigmoidLayer(position_weights=[0.0], forward_biases=[0.0], reverse_biases=[0.0],
    ...                     output_weights=[0.002], output_bias=0.001)
    >>> axis = SigmoidNetwork(long_range=flat, cyclic=flat, pitch_mm=5.0, range_mm=(0.0, 100.0), unit_mm=1.0)
    >>> float(axis.error_mm(12.0, +1))
    0.004
    """

    long_range: SigmoidLayer
    cyclic: SigmoidLayer
    pitch_mm: float
    range_mm: tuple[float, float]
    unit_mm: float = MM_PER_INCH

    def __post_init__(self) -> None:
        for name in ("pitch_mm", "unit_mm"):
            object.__setattr__(self, name, length(name, getattr(self, name)))
        object.__setattr__(self, "range_mm", span("range_mm", self.range_mm))

    @property
    def function(self) -> Callable[..., float]:
        """The compiled function."""
        return _kernels.network_error

    @property
    def numbers(self) -> Floats:
        """A new array; its layout stands in ``_kernels.py``."""
        head = [*self.range_mm, self.pitch_mm, TOUCH_MM, self.unit_mm]
        return np.concatenate([head, self.long_range.numbers, self.cyclic.numbers])


class LatheNetwork(Curve):
    """Error of the thesis's lathe, z axis, from its printed trained network.

    Thirty neurons for the error along the axis and eight for the error within a turn of the 0.25 inch screw. The
    network was trained from 1 to 40 inches (25.4 to 1016 mm); beyond them the error is held.

    Notes
    -----
    The printed ``calcZ`` returns the compensation, the negative of the sum; this predictor returns the error itself:
    forward from 12 to 71 µm, reverse from 82 to 145 µm. At each multiple of 0.25 inch the printed network jumps: the
    error of the turn that begins is 1.6 µm above that of the turn that ends (forward), 4.8 µm in reverse.

    References
    ----------
    Thesis, section 4.4.2, Appendices D and E.

    Examples
    --------
    >>> lathe = LatheNetwork()
    >>> [round(float(lathe.error_mm(508.0, way)) * 1000, 1) for way in (+1, -1)]
    [38.7, 115.9]
    >>> from rtec.predictors import Outside
    >>> lathe.error_mm(1018.54, +1, outside=Outside.REFUSE)
    Traceback (most recent call last):
    rtec.errors.ArgumentError: position_mm: 1018.54 mm is not allowed; allowed: 25.4 to 1016 mm, the range of the \
predictor; stay inside, or hold the error at the ends
    """

    __slots__ = ()

    @property
    def function(self) -> Callable[..., float]:
        """The compiled function."""
        return _kernels.network_error

    @property
    def network(self) -> SigmoidNetwork:
        """The two networks with their printed numbers."""
        return _lathe()

    @property
    def numbers(self) -> Floats:
        """A new array; its layout stands in ``_kernels.py``."""
        return _lathe().numbers

    @property
    def range_mm(self) -> tuple[float, float]:
        """Positions for which the network was trained: 1 to 40 inches."""
        return _lathe().range_mm

    @property
    def pitch_mm(self) -> float:
        """Pitch of the screw: 0.25 inch."""
        return _lathe().pitch_mm

    def __repr__(self) -> str:
        return "LatheNetwork()"


def _layer(neurons: tuple[_lathe_weights.Neuron, ...], output_bias: float) -> SigmoidLayer:
    weights, forward, reverse, output = np.array(neurons).T
    return SigmoidLayer(
        position_weights=weights,
        forward_biases=forward,
        reverse_biases=reverse,
        output_weights=output,
        output_bias=output_bias,
    )


@functools.cache
def _lathe() -> SigmoidNetwork:
    return SigmoidNetwork(
        long_range=_layer(_lathe_weights.LONG_RANGE, _lathe_weights.LONG_RANGE_BIAS),
        cyclic=_layer(_lathe_weights.CYCLIC, _lathe_weights.CYCLIC_BIAS),
        pitch_mm=0.25 * MM_PER_INCH,
        range_mm=(1.0 * MM_PER_INCH, 40.0 * MM_PER_INCH),
    )
