"""A predictor seen from the axis' home, with a margin beyond its ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.checks import number_within
from rtec.errors import ArgumentError
from rtec.predictors import BidirectionalTable, Predictor, _kernels
from rtec.predictors.protocol import PackedPredictor

GRID_MM = 0.05
"""Of a network, which is tabled: the cyclic error of the lathe's screw has 127 points to a turn."""

MARGIN_MM = 1.0
"""A corrected axis at home stands beside home by as much as it is corrected."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placed(PackedPredictor):
    """Predictor over positions from home; `placed` makes it."""

    kind: int
    packed: npt.NDArray[np.float64]
    range_mm: tuple[float, float]


def placed(predictor: Predictor, *, home_mm: float, margin_mm: float = MARGIN_MM) -> Predictor:
    """Return a predictor over positions from home, known a little beyond its ends.

    Parameters
    ----------
    predictor
        Over positions of the machine.
    home_mm
        Where home is in them.
    margin_mm
        So far beyond its ends the error of the end is taken.

    Raises
    ------
    ArgumentError
        A home at which the predictor knows nothing.

    Examples
    --------
    >>> table = BidirectionalTable(forward_positions_mm=[100, 200], forward_errors_mm=[0.01, 0.02],
    ...                            reverse_positions_mm=[100, 200], reverse_errors_mm=[0.03, 0.04])
    >>> near = placed(table, home_mm=100.0)
    >>> near.error_mm([0.0, 50.0], [1, -1]).round(9).tolist(), near.range_mm
    ([0.01, 0.035], (-1.0, 101.0))
    """
    low, high = predictor.range_mm
    if not low <= number_within("home", home_mm, -1e6, 1e6, unit="mm") <= high:
        allowed = f"{low:g} to {high:g} mm, the range of the predictor"
        raise ArgumentError("home", f"{home_mm:g} mm", allowed, "say where the axis' home is in it")
    if predictor.kind == _kernels.NETWORK:
        points = int((high - low) / GRID_MM) + 2
        predictor = BidirectionalTable.sampled_from(predictor, np.linspace(low, high, points))
    packed = np.array(predictor.packed, dtype=np.float64)
    if predictor.kind == _kernels.TABLE:
        at = 0
        while at < packed.size:
            n = int(packed[at])
            packed[at + 1 : at + 1 + n] -= home_mm
            at += 1 + 2 * n
    margin = number_within("margin_mm", margin_mm, 0.0, 1e3, unit="mm")
    return Placed(kind=predictor.kind, packed=packed, range_mm=(low - home_mm - margin, high - home_mm + margin))
