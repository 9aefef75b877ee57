"""Curves over the position, one for each direction: the base of the predictors of this package."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors import _kernels
from rtec.predictors._columns import Floats
from rtec.predictors.binding import CURVE, bound
from rtec.predictors.protocol import Predictor

BESIDE_MM = 1.0
"""Beyond the places of other axes that were measured, where a predictor holds its ends: a corrected axis at the end
of its travel stands beside it by as much as it is corrected."""
Reach = dict[str, tuple[float, float]]


class Curve(ABC):
    """Base of the predictors of this package: curves over the position, one for each direction."""

    __slots__ = ()

    @property
    @abstractmethod
    def function(self) -> Callable[..., float]:
        """The compiled function."""

    @property
    @abstractmethod
    def numbers(self) -> Floats:
        """A new one-dimensional array; its layout stands in ``_kernels.py``."""

    @property
    def reach_mm(self) -> Reach:
        """Lowest and highest position of each other axis that it looks at, by name, in the order of the axes."""
        return {}

    @property
    def inputs(self) -> tuple[str, ...]:
        """Position and direction, then positions of other axes."""
        return (*CURVE, *self.reach_mm)

    @property
    def memory(self) -> Floats:
        """Nothing."""
        return np.empty(0)

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Where the other axes stood, and a little beyond."""
        return {name: (low - BESIDE_MM, high + BESIDE_MM) for name, (low, high) in self.reach_mm.items()}

    @property
    @abstractmethod
    def range_mm(self) -> tuple[float, float]:
        """Lowest and highest position, in mm, for which both directions are known."""

    def error_mm(self, position_mm: npt.ArrayLike, direction: npt.ArrayLike, *others_mm: npt.ArrayLike) -> Floats:
        """Return the error, actual minus target, at each position; beyond ``range_mm`` that of the nearest end.

        Parameters
        ----------
        position_mm
            Positions in mm, of any shape.
        direction
            +1 forward or -1 reverse, of a shape that broadcasts with the positions.
        *others_mm
            Where other axes stand, in mm, in the order of ``inputs``; of such shapes, too.

        Returns
        -------
        numpy.ndarray
            Errors in mm, of the broadcast shape.

        Raises
        ------
        ArgumentError
            A position that is not a finite number, a direction other than +1 and -1, shapes that do not fit, or
            more or fewer axes than the predictor looks at.

        Examples
        --------
        >>> NoError().error_mm([0.0, 12.5], 1)
        array([0., 0.])
        """
        names = self.inputs[len(CURVE) :]
        if len(others_mm) != len(names):
            raise ArgumentError("others_mm", f"{len(others_mm)} columns", ", ".join(names) or "none")
        x, others = _numbers("position_mm", position_mm), list(map(_numbers, names, others_mm))
        given = [x, _directions(direction).astype(np.float64), *others]
        try:
            columns = np.broadcast_arrays(*given)
        except ValueError:
            found = ", ".join(str(each.shape) for each in given[1:])
            raise ArgumentError("direction", f"shape {found}", f"a shape that fits {given[0].shape}") from None
        x_mm, way = columns[0].ravel(), columns[1].astype(np.int64).ravel()
        along = np.array([each.ravel() for each in columns[2:]]).reshape(len(names), x_mm.size)
        error = np.empty(x_mm.size)
        _kernels.errors_along(bound(self), np.array(x_mm), way, along, error)
        return error.reshape(columns[0].shape)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self) or not isinstance(other, Curve):
            return NotImplemented
        if (self.range_mm, self.inputs) != (other.range_mm, other.inputs):
            return False
        return np.array_equal(self.numbers, other.numbers)

    def __hash__(self) -> int:
        return hash((type(self), self.numbers.tobytes()))


class NoError(Curve):
    """Predictor of a perfect axis: zero everywhere.

    Examples
    --------
    >>> float(NoError().error_mm(25.4, -1))
    0.0
    """

    __slots__ = ()
    function = staticmethod(_kernels.no_error)
    range_mm = (-np.inf, np.inf)

    @property
    def numbers(self) -> Floats:
        """None."""
        return np.empty(0)

    def __repr__(self) -> str:
        return "NoError()"


def _numbers(name: str, values: npt.ArrayLike) -> Floats:
    """Return ``values`` as float64, or say which is no finite number."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ArgumentError(name, repr(values)[:60], "finite numbers") from None
    bad = array[~np.isfinite(array)]
    if bad.size:
        raise ArgumentError(name, bad.flat[0], "finite numbers")
    return array


def _directions(direction: npt.ArrayLike) -> npt.NDArray[np.int64]:
    way = _numbers("direction", direction)
    bad = way[np.abs(way) != 1.0]
    if bad.size:
        raise ArgumentError("direction", f"{bad.flat[0]:g}", "+1 (forward) or -1 (reverse)")
    return way.astype(np.int64)


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
    function = property(attrgetter("predictor.function"))
    inputs = property(attrgetter("predictor.inputs"))
    ranges = property(attrgetter("predictor.ranges"))
    range_mm = property(attrgetter("predictor.range_mm"))

    def __post_init__(self) -> None:
        if not (np.isfinite(self.unsure_mm) and self.unsure_mm >= 0.0):
            raise ArgumentError("unsure_mm", self.unsure_mm, "a finite length from 0")

    @property
    def numbers(self) -> Floats:
        """Those of the predictor; what calls the function takes the interval off."""
        return np.array(self.predictor.numbers, dtype=np.float64)
