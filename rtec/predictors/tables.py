"""Tables of errors as machine tools use them: one direction and a backlash, or both directions.

Between the points of a table the error is linear or a monotone cubic; beyond its ends it is that of the nearest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors._columns import LARGEST, ascending, column, first_disorder
from rtec.predictors.between import Between
from rtec.predictors.curve import Curve
from rtec.predictors.protocol import FORWARD, REVERSE, Predictor

Floats = npt.NDArray[np.float64]

SAME_TARGET_MM = 1e-6
"""Targets closer than this are readings of one target: 1 nm, far above rounding, far below any scale."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UnidirectionalTable(Curve):
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

    @classmethod
    def from_readings(cls, targets_mm: npt.ArrayLike, deviation_mm: npt.ArrayLike, direction: npt.ArrayLike) -> Self:
        """Average repeated readings into a table; the parameters are those of ``BidirectionalTable.from_readings``.

        The backlash is the mean of reverse minus forward over the targets measured in both directions.

        Raises
        ------
        ArgumentError
            As there, and where no target was measured in both directions.

        Examples
        --------
        >>> UnidirectionalTable.from_readings([0, 10, 10, 0], [0.0, 0.002, 0.006, 0.002], [1, 1, -1, -1]).backlash_mm
        0.003
        """
        both = BidirectionalTable.from_readings(targets_mm, deviation_mm, direction)
        after = np.searchsorted(both.forward_positions_mm, both.reverse_positions_mm - SAME_TARGET_MM)
        nearest = np.minimum(after, both.forward_positions_mm.size - 1)
        shared = np.abs(both.forward_positions_mm[nearest] - both.reverse_positions_mm) <= SAME_TARGET_MM
        if not shared.any():
            raise ArgumentError("targets_mm", "no target", "at least one target measured in both directions")
        lost = (both.reverse_errors_mm - both.forward_errors_mm[nearest])[shared]
        return cls(
            positions_mm=both.forward_positions_mm,
            errors_mm=both.forward_errors_mm,
            backlash_mm=float(lost.mean()),
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
        >>> table = UnidirectionalTable.sampled_from(LatheNetwork(), [254.0, 508.0, 762.0])
        >>> round(table.backlash_mm * 1000)
        81
        """
        grid = ascending("grid_mm", grid_mm)
        forward = predictor.error_mm(grid, FORWARD)
        lost = predictor.error_mm(grid, REVERSE) - forward
        return cls(positions_mm=grid, errors_mm=forward, backlash_mm=float(lost.mean()))

    @property
    def function(self) -> Callable[..., float]:
        """The compiled function."""
        return self.between.function

    @property
    def numbers(self) -> Floats:
        """A new array; its layout stands in ``_kernels.py``."""
        return self.between.numbers(
            (self.positions_mm, self.errors_mm), (self.positions_mm, self.errors_mm + self.backlash_mm)
        )

    @property
    def range_mm(self) -> tuple[float, float]:
        """First and last position of the table."""
        return float(self.positions_mm[0]), float(self.positions_mm[-1])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BidirectionalTable(Curve):
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
    def from_readings(cls, targets_mm: npt.ArrayLike, deviation_mm: npt.ArrayLike, direction: npt.ArrayLike) -> Self:
        """Average repeated readings at each target and in each direction.

        Parameters
        ----------
        targets_mm
            Target of each reading in mm, in any order; targets within 1 nm of the next are one target.
        deviation_mm
            Actual minus target of each reading, in mm.
        direction
            +1 or -1, the direction of approach of each reading.

        Raises
        ------
        ArgumentError
            Columns of different lengths, numbers that are not finite, a direction other than +1 and -1, or fewer than
            two targets in a direction.

        Examples
        --------
        >>> table = BidirectionalTable.from_readings(
        ...     [0, 10, 10, 0, 0, 10, 10, 0],
        ...     [0.001, 0.002, 0.006, 0.005, 0.003, 0.002, 0.008, 0.005],
        ...     [+1, +1, -1, -1, +1, +1, -1, -1])
        >>> table.forward_errors_mm, table.reverse_errors_mm
        (array([0.002, 0.002]), array([0.005, 0.007]))
        """
        targets = column("targets_mm", targets_mm)
        deviation = column("deviation_mm", deviation_mm, rows=targets.size)
        way = column("direction", direction, rows=targets.size)
        bad = np.flatnonzero(np.abs(way) != 1.0)
        if bad.size:
            row = int(bad[0])
            raise ArgumentError(f"direction, row {row + 1}", f"{way[row]:g}", "+1 (forward) or -1 (reverse)")
        sides = {sign: _averaged(targets[way == sign], deviation[way == sign]) for sign in (FORWARD, REVERSE)}
        for sign, (positions, _) in sides.items():
            if positions.size < 2:
                raise ArgumentError(
                    "targets_mm", f"{positions.size} in direction {sign:+d}", "at least two targets in each direction"
                )
        return cls(
            forward_positions_mm=sides[FORWARD][0],
            forward_errors_mm=sides[FORWARD][1],
            reverse_positions_mm=sides[REVERSE][0],
            reverse_errors_mm=sides[REVERSE][1],
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
        return cls(
            forward_positions_mm=grid,
            forward_errors_mm=predictor.error_mm(grid, FORWARD),
            reverse_positions_mm=grid,
            reverse_errors_mm=predictor.error_mm(grid, REVERSE),
        )

    @property
    def function(self) -> Callable[..., float]:
        """The compiled function."""
        return self.between.function

    @property
    def numbers(self) -> Floats:
        """A new array; its layout stands in ``_kernels.py``."""
        return self.between.numbers(
            (self.forward_positions_mm, self.forward_errors_mm), (self.reverse_positions_mm, self.reverse_errors_mm)
        )

    @property
    def range_mm(self) -> tuple[float, float]:
        """First and last position that both directions cover."""
        return (
            float(max(self.forward_positions_mm[0], self.reverse_positions_mm[0])),
            float(min(self.forward_positions_mm[-1], self.reverse_positions_mm[-1])),
        )


def _averaged(targets: Floats, deviation: Floats) -> tuple[Floats, Floats]:
    """Return the distinct targets, ascending, and the mean deviation at each."""
    order = np.argsort(targets, kind="stable")
    targets, deviation = targets[order], deviation[order]
    first = np.flatnonzero(np.diff(targets, prepend=-2.0 * LARGEST) > SAME_TARGET_MM)
    counts = np.diff(first, append=targets.size)
    return targets[first], np.add.reduceat(deviation, first) / counts if first.size else deviation
