"""Errors of one axis by where it and other axes stand: sums of tables, and of tables times an arm."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors import _kernels
from rtec.predictors._columns import Floats, ascending, column, span
from rtec.predictors.binding import CURVE, OF_AXIS, is_other_axis
from rtec.predictors.curve import Curve, Reach


def reach_of(parts: Iterable[Reach]) -> Reach:
    """Return the lowest and highest position of each axis that any part knows, in the order of the axes.

    Examples
    --------
    >>> reach_of([{"position_3": (0.0, 50.0)}, {"position_2": (0.0, 9.0), "position_3": (-1.0, 40.0)}])
    {'position_2': (0.0, 9.0), 'position_3': (-1.0, 50.0)}
    """
    found: Reach = {}
    for part in parts:
        for name, (low, high) in part.items():
            before = found.get(name, (low, high))
            found[name] = min(low, before[0]), max(high, before[1])
    return dict(sorted(found.items(), key=lambda item: int(item[0].removeprefix(OF_AXIS))))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AxisTable:
    """What one axis contributes to the error: a table of its position, linear between its points.

    Raises
    ------
    ArgumentError
        An input that is no position, a direction other than +1, -1 and 0, or columns that do not fit.

    Examples
    --------
    >>> AxisTable(of="position_2", positions_mm=[0, 300], values=[0.0, 0.009]).direction
    0
    """

    of: str
    """Whose position: ``position``, that of the axis itself, or ``position_NUMBER``."""
    positions_mm: Floats
    """Ascending, shape (n,)."""
    values: Floats
    """Shape (n,): errors in mm; with an arm angles in rad. Beyond the ends those of the ends."""
    direction: int = 0
    """+1 or -1: of this direction of motion alone; 0 of both."""
    arm: str | None = None
    """The axis whose position, less the middle of ``arm_mm``, an angle acts on; None without."""
    arm_mm: tuple[float, float] = (0.0, 1.0)
    """Lowest and highest position of that axis, at which it is held."""

    def __post_init__(self) -> None:
        for name in (self.of, self.arm):
            if name is not None and name != CURVE[0] and not is_other_axis(name):
                raise ArgumentError("of" if name == self.of else "arm", repr(name)[:60], "position, or position_2")
        if self.direction not in (0, 1, -1):
            raise ArgumentError("direction", self.direction, "+1, -1, or 0 for both")
        object.__setattr__(self, "positions_mm", ascending("positions_mm", self.positions_mm))
        object.__setattr__(self, "values", column("values", self.values, rows=self.positions_mm.size))
        object.__setattr__(self, "arm_mm", span("arm_mm", self.arm_mm))

    @property
    def reach_mm(self) -> Reach:
        """Lowest and highest position of each other axis that it looks at, by its name."""
        ends = {self.of: (float(self.positions_mm[0]), float(self.positions_mm[-1]))}
        ends |= {} if self.arm is None else {self.arm: self.arm_mm}
        return {name: reach for name, reach in ends.items() if name != CURVE[0]}

    def numbers(self, inputs: Sequence[str]) -> Floats:
        """Return the table as it stands in the numbers of a predictor with these inputs (see ``_kernels.py``)."""
        arm = -1 if self.arm is None else inputs.index(self.arm)
        low, high = self.arm_mm
        head = [inputs.index(self.of), self.direction, arm, low, high, self.positions_mm.size]
        return np.concatenate([np.array(head, dtype=np.float64), self.positions_mm, self.values])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AxisTables(Curve):
    """Error of an axis as a sum of tables.

    What squareness, straightness and angles of a machine do to one axis is such a sum: a straight table of the
    position of another axis is squareness, what bends in it straightness; an angle of one axis acts by how far out
    another one stands.

    Parameters
    ----------
    tables
        What is added.
    range_mm
        Lowest and highest position of the axis for which both directions are known.

    Raises
    ------
    ArgumentError
        No table, or a range without length.

    References
    ----------
    Thesis 6.3; ISO 230-1 for the errors of linear axes.

    Examples
    --------
    Two axes that are 30 µm in a metre out of square:

    >>> own = AxisTable(of="position", positions_mm=[0, 100], values=[0.0, 0.002])
    >>> square = AxisTable(of="position_2", positions_mm=[0, 300], values=[0.0, 0.009])
    >>> both = AxisTables(tables=(own, square), range_mm=(0, 100))
    >>> both.inputs, both.error_mm([50.0, 50.0], 1, [0.0, 300.0]).round(9).tolist()
    (('position', 'direction', 'position_2'), [0.001, 0.01])
    """

    tables: tuple[AxisTable, ...]
    range_mm: tuple[float, float]
    function = staticmethod(_kernels.tables_error)

    def __post_init__(self) -> None:
        if not 1 <= len(self.tables) <= _kernels.MOST_TABLES:
            raise ArgumentError("tables", len(self.tables), f"1 to {_kernels.MOST_TABLES} tables")
        object.__setattr__(self, "range_mm", span("range_mm", self.range_mm))

    @property
    def reach_mm(self) -> Reach:
        """Where the other axes stood, by name."""
        return reach_of(table.reach_mm for table in self.tables)

    @property
    def numbers(self) -> Floats:
        """A new array; its layout stands in ``_kernels.py``."""
        inputs = self.inputs
        tables = [table.numbers(inputs) for table in self.tables]
        return np.concatenate([[*self.range_mm, float(len(tables))], *tables])
