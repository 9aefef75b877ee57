"""Tables of errors as machine tools use them: one direction and a backlash, or both directions.

Between the points of a table the error is linear or a monotone cubic; beyond its ends it is that of the nearest.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Self

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors import _kernels
from rtec.predictors._columns import Floats, ascending, column, first_disorder
from rtec.predictors.curve import Curve
from rtec.predictors.protocol import FORWARD, REVERSE, Predictor

SAME_TARGET_MM = 1e-6
"""Targets closer than this are readings of one target: 1 nm, far above rounding, far below any scale."""


class Between(Enum):
    """How the error goes from one point of a table to the next."""

    LINES = "linear"
    """Straight lines, as controls have them (thesis 3.1.1)."""
    CUBIC = "cubic"
    """Monotone cubics (Fritsch and Butland 1984): smooth, and between two points never beyond them."""

    @property
    def function(self) -> Callable[..., float]:
        """The compiled function."""
        return _kernels.table_error if self is Between.LINES else _kernels.cubic_error

    def numbers(self, *ways: tuple[Floats, Floats]) -> Floats:
        """Return positions and errors of both directions as the compiled function takes them."""
        return np.concatenate([self._of_one(positions, errors) for positions, errors in ways])

    def _of_one(self, positions: Floats, errors: Floats) -> Floats:
        columns = [np.array([float(positions.size)]), positions, errors]
        if self is Between.CUBIC:
            # a quarter of a second, and most tables are of straight lines
            from scipy.interpolate import PchipInterpolator  # noqa: PLC0415 - see above

            columns.append(PchipInterpolator(positions, errors).derivative()(positions))
        return np.concatenate(columns)


class ErrorTable(Curve):
    """Base of the tables: positions and errors of both directions, and what is said between them."""

    __slots__ = ()
    between: Between

    @property
    @abstractmethod
    def ways(self) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """Positions and errors of the forward direction, then those of the reverse direction, in mm."""

    @property
    def function(self) -> Callable[..., float]:
        """The compiled function."""
        return self.between.function

    @property
    def numbers(self) -> Floats:
        """A new array; its layout stands in ``_kernels.py``."""
        return self.between.numbers(*self.ways)

    @property
    def range_mm(self) -> tuple[float, float]:
        """First and last position that both directions cover."""
        (forward, _), (reverse, _) = self.ways
        return float(max(forward[0], reverse[0])), float(min(forward[-1], reverse[-1]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UnidirectionalTable(ErrorTable):
    """Errors of the forward direction, and one backlash for the whole axis.

    Parameters
    ----------
    positions_mm
        Positions in mm, at least two, strictly ascending.
    errors_mm
        Error, actual minus target, in mm at each position when moving forward. The compensation is its negative.
    backlash_mm
        Error in reverse minus error forward, in mm: positive where the reverse curve lies above the forward curve (as
        on the thesis's lathe), negative where it lies below (as in the thesis's Figure 3.1).
    between
        What it says between the positions.

    Raises
    ------
    ArgumentError
        Positions unsorted, repeated or missing (the row is named), columns of different lengths, numbers that are not
        finite.

    References
    ----------
    Thesis, section 3.1.1 and Table 3-1.

    Examples
    --------
    >>> table = UnidirectionalTable(positions_mm=[0.0, 25.4, 50.8], errors_mm=[-0.001, -0.001, 0.001],
    ...                             backlash_mm=-0.004)
    >>> table.error_mm([38.1, 60.0], [+1, -1]).round(6)
    array([ 0.   , -0.003])
    """

    positions_mm: Floats
    errors_mm: Floats
    backlash_mm: float
    between: Between = Between.LINES

    def __post_init__(self) -> None:
        positions = ascending("positions_mm", self.positions_mm)
        object.__setattr__(self, "positions_mm", positions)
        object.__setattr__(self, "errors_mm", column("errors_mm", self.errors_mm, rows=positions.size))
        object.__setattr__(self, "backlash_mm", float(column("backlash_mm", [self.backlash_mm])[0]))

    @property
    def ways(self) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """The errors, and the same raised by the backlash."""
        return (self.positions_mm, self.errors_mm), (self.positions_mm, self.errors_mm + self.backlash_mm)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BidirectionalTable(ErrorTable):
    """Errors of each direction by themselves; the backlash is their difference.

    Parameters
    ----------
    forward_positions_mm, reverse_positions_mm
        Positions in mm, at least two in each direction, strictly ascending; the reverse listing may descend
        throughout, in the order of the motion, as the thesis's Table 3-3 does. The two stretches overlap.
    forward_errors_mm, reverse_errors_mm
        Error, actual minus target, in mm at each position. The compensation is its negative.
    between
        What it says between the positions.

    Raises
    ------
    ArgumentError
        Positions unsorted, repeated or missing (the row is named), columns of different lengths, numbers that are not
        finite, directions that have no stretch in common.

    References
    ----------
    Thesis, section 3.1.2, Tables 3-2 and 3-3.

    Examples
    --------
    The thesis's Tables 3-2 and 3-3 (there in inches):

    >>> table = BidirectionalTable(
    ...     forward_positions_mm=[0, 1, 2, 3, 4], forward_errors_mm=[0.001, 0.001, 0, -0.001, -0.002],
    ...     reverse_positions_mm=[4, 3, 2, 1, 0], reverse_errors_mm=[-0.004, -0.003, -0.002, -0.001, -0.001])
    >>> table.error_mm([1.5, 3.5], [+1, -1])
    array([ 0.0005, -0.0035])
    """

    forward_positions_mm: Floats
    forward_errors_mm: Floats
    reverse_positions_mm: Floats
    reverse_errors_mm: Floats
    between: Between = Between.LINES

    def __post_init__(self) -> None:
        forward = ascending("forward_positions_mm", self.forward_positions_mm)
        reverse = column("reverse_positions_mm", self.reverse_positions_mm)
        reverse_errors = column("reverse_errors_mm", self.reverse_errors_mm, rows=reverse.size)
        if reverse.size > 1 and first_disorder(reverse[::-1]) is None:
            reverse, reverse_errors = reverse[::-1], reverse_errors[::-1]
        object.__setattr__(self, "forward_positions_mm", forward)
        object.__setattr__(
            self, "forward_errors_mm", column("forward_errors_mm", self.forward_errors_mm, rows=forward.size)
        )
        object.__setattr__(self, "reverse_positions_mm", ascending("reverse_positions_mm", reverse))
        object.__setattr__(self, "reverse_errors_mm", column("reverse_errors_mm", reverse_errors))
        low, high = self.range_mm
        if not low < high:
            raise ArgumentError(
                "reverse_positions_mm",
                f"{reverse[0]:g} to {reverse[-1]:g} mm",
                f"positions that overlap those of the forward direction, {forward[0]:g} to {forward[-1]:g} mm",
            )

    @classmethod
    def on_grid(
        cls,
        positions_mm: Floats,
        forward_mm: Floats,
        reverse_mm: Floats,
        between: Between = Between.LINES,
    ) -> Self:
        """Return the table of two errors at the same positions, shape (n,) each, in mm; it refuses what a table does.

        Examples
        --------
        >>> table = BidirectionalTable.on_grid(np.array([0.0, 10.0]), np.zeros(2), np.full(2, 0.004))
        >>> table.error_mm([5.0, 5.0], [1, -1]).tolist()
        [0.0, 0.004]
        """
        return cls(
            forward_positions_mm=positions_mm,
            forward_errors_mm=forward_mm,
            reverse_positions_mm=positions_mm,
            reverse_errors_mm=reverse_mm,
            between=between,
        )

    @classmethod
    def sampled_from(cls, predictor: Predictor, grid_mm: npt.ArrayLike) -> Self:
        """Return the table that a perfect measurement of ``predictor`` on a grid would give.

        Parameters
        ----------
        predictor
            What is measured.
        grid_mm
            Positions in mm, strictly ascending.

        Examples
        --------
        >>> from rtec.predictors import LatheNetwork
        >>> table = BidirectionalTable.sampled_from(LatheNetwork(), [254.0, 508.0, 762.0])
        >>> (table.reverse_errors_mm * 1000).round()
        array([112., 116., 118.])
        """
        grid = ascending("grid_mm", grid_mm)
        return cls.on_grid(grid, predictor.error_mm(grid, FORWARD), predictor.error_mm(grid, REVERSE))

    @property
    def ways(self) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """Those of each direction."""
        forward = self.forward_positions_mm, self.forward_errors_mm
        return forward, (self.reverse_positions_mm, self.reverse_errors_mm)
