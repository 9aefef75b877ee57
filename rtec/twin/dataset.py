"""What is to be explained: the observed quantity, its conditions, its repeats, and blocks to hold out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rtec.effects import Conditions, Floats, Observable, Units
from rtec.errors import ArgumentError

Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Dataset:
    """A measurement, ready to be explained.

    Parameters
    ----------
    source
        File, for messages.
    observe
        Quantity to be explained: ``deviation``, or the name of a column.
    observable
        What kind of quantity that is, which decides which effects are in question.
    units
        Units inside.
    observed
        Shape (rows,), in ``units.observed``.
    conditions
        The same rows.
    cell
        Number of the cell of each reading: readings of one cell were taken under the same conditions (target and
        direction) in different runs; −1 where a reading has no repeat. Shape (rows,).
    block
        Number of the block that each reading is held out with, 0, 1, ...; shape (rows,).
    notes
        What was done to the file's numbers before (differentiation, decimation, rows left out), in sentences.
    unknown
        Numeric columns that name no known quantity, by heading: they can be looked at, but no effect uses them.
    """

    source: str
    observe: str
    observable: Observable
    units: Units
    observed: Floats
    conditions: Conditions
    cell: Ints
    block: Ints
    notes: tuple[str, ...] = ()
    unknown: tuple[tuple[str, Floats], ...] = ()

    def __post_init__(self) -> None:
        """Check that everything has the same rows."""
        sizes = {self.observed.shape, self.cell.shape, self.block.shape, self.conditions.position.shape}
        if len(sizes) != 1:
            raise ArgumentError("dataset", f"shapes {sorted(sizes)}", "observed, cell, block and conditions row by row")

    @property
    def rows(self) -> int:
        """Number of readings."""
        return int(self.observed.size)

    @property
    def has_repeats(self) -> bool:
        """Whether conditions were repeated, so that there is a noise floor."""
        return bool((self.cell >= 0).any())

    def take(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> Dataset:
        """Return some of the readings."""
        return replace(
            self,
            observed=self.observed[rows],
            conditions=self.conditions.take(rows),
            cell=self.cell[rows],
            block=self.block[rows],
            unknown=tuple((name, values[rows]) for name, values in self.unknown),
        )
