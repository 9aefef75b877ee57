"""A predictor whose corrections are reduced to what its interval supports."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors.curve import Curve
from rtec.predictors.protocol import Predictor


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cautious(Curve):
    """The end of a predictor's interval that is nearer to zero.

    What is asked for is surely there, with the probability of the interval; what may be there is left to the axis.

    Parameters
    ----------
    predictor
        The predictor to be reduced.
    unsure_mm
        Half width of its interval, in mm.

    Raises
    ------
    ArgumentError
        A half width that is no finite length.

    Examples
    --------
    >>> from rtec.predictors import UnidirectionalTable
    >>> table = UnidirectionalTable(positions_mm=[0.0, 10.0], errors_mm=[0.001, 0.005], backlash_mm=0.0)
    >>> Cautious(predictor=table, unsure_mm=0.002).error_mm([0.0, 10.0], +1)
    array([0.   , 0.003])
    """

    predictor: Predictor
    unsure_mm: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.unsure_mm) and self.unsure_mm >= 0.0):
            raise ArgumentError("unsure_mm", self.unsure_mm, "a finite length from 0")

    @property
    def function(self) -> Callable[..., float]:
        """That of the predictor; what calls it takes the interval off."""
        return self.predictor.function

    @property
    def inputs(self) -> tuple[str, ...]:
        """Those of the predictor."""
        return tuple(self.predictor.inputs)

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Those of the predictor."""
        return self.predictor.ranges

    @property
    def numbers(self) -> npt.NDArray[np.float64]:
        """Those of the predictor."""
        return np.array(self.predictor.numbers, dtype=np.float64)

    @property
    def range_mm(self) -> tuple[float, float]:
        """That of the predictor."""
        return self.predictor.range_mm
