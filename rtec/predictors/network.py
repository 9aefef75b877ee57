"""The printed network of the thesis's lathe.

Two networks of one hidden layer: one describes the error over the whole length, the other the error within one turn
of the screw; their outputs are added (thesis 4.4.2 and Figure 4.6). The direction is an input of 0 or 1.
"""

from __future__ import annotations

import functools

import numpy as np

from rtec.predictors import _lathe_weights
from rtec.predictors.layered import LayeredNetwork, TrainedNetworks
from rtec.units import MM_PER_INCH


class LatheNetwork(TrainedNetworks):
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
    """

    __slots__ = ()

    def __init__(self) -> None:
        super().__init__(
            networks=_printed(),
            range_mm=(1.0 * MM_PER_INCH, 40.0 * MM_PER_INCH),
            pitch_mm=0.25 * MM_PER_INCH,
        )

    def __repr__(self) -> str:
        return "LatheNetwork()"


def _network(place: str, neurons: tuple[_lathe_weights.Neuron, ...], output_bias: float) -> LayeredNetwork:
    """Return a network over a place and the direction, in inches."""
    position, forward, reverse, output = np.array(neurons).T
    return LayeredNetwork(
        inputs=(place, "direction"),
        middle=np.zeros(2),
        half=np.array([MM_PER_INCH, 1.0]),
        hidden=(len(neurons),),
        weights=np.concatenate([position, reverse - forward, forward, output, [output_bias]]),
        bias_mm=0.0,
        factor_mm=MM_PER_INCH,
    )


@functools.cache
def _printed() -> tuple[LayeredNetwork, ...]:
    return (
        _network("position", _lathe_weights.LONG_RANGE, _lathe_weights.LONG_RANGE_BIAS),
        _network("turn", _lathe_weights.CYCLIC, _lathe_weights.CYCLIC_BIAS),
    )
