"""What is to be explained: the observed quantity, its conditions, its repeats, and blocks to hold out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.drive_signals import Resample
from rtec.effects import Conditions, Effect, Floats, Observable, Shape, Units
from rtec.errors import ArgumentError

Ints = NDArray[np.int64]

_ROUNDING = 1e-12
"""Share of the largest value that is rounding: a filter turns a constant into nearly a constant."""
_NOTHING = 1e-100

_SCANNED_AT_ONCE = 1 << 23
"""Numbers of full-rate columns (64 MiB) that a scan holds at one time."""


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
        The same rows; where ``resample`` is given, every sample of the log before it was decimated.
    cell
        Number of the cell of each reading: readings of one cell were taken under the same conditions (target and
        direction) in different runs; −1 where a reading has no repeat. Shape (rows,).
    block
        Number of the block that each reading is held out with, 0, 1, ...; shape (rows,).
    held_out_by
        What a block is: a ``run`` (or a group of runs) or a ``stretch`` of readings.
    notes
        What was done to the file's numbers before (differentiation, decimation, rows left out), in sentences.
    unknown
        Numeric columns that name no known quantity, by heading: they can be looked at, but no effect uses them.
    resample
        How a column that was computed for every sample becomes one of ``rows`` readings; None where nothing was
        decimated.
    coordinate
        Where the position comes from: ``target``, ``actual`` or ``time``.
    cutoff_hz
        Of the low pass in front of the derivatives; None where positions were not filtered.

    Notes
    -----
    What depends on the conditions in a nonlinear way (the sign of a velocity) must go through the same filter as the
    observed force did: so columns are computed for every sample and then decimated by ``columns``, never computed
    from decimated conditions. ``coordinates`` are decimated conditions, for pictures and tables only.
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
    held_out_by: str = "stretch"
    resample: Resample | None = None
    coordinate: str = "target"
    cutoff_hz: float | None = None

    def __post_init__(self) -> None:
        """Check that everything has the same rows."""
        sizes = {self.observed.shape, self.cell.shape, self.block.shape, *(x.shape for _, x in self.unknown)}
        if self.resample is None:
            sizes.add(self.conditions.position.shape)
        else:
            sizes.add((self.resample.rows,))
            if self.conditions.rows != self.resample.samples:
                found = f"{self.conditions.rows} samples"
                raise ArgumentError("dataset", found, f"{self.resample.samples}, as many as the decimation takes")
        if len(sizes) != 1:
            raise ArgumentError(
                "dataset", f"shapes {sorted(sizes)}", "observed, cell, block and conditions row by row"
            )

    @property
    def rows(self) -> int:
        """Number of readings."""
        return int(self.observed.size)

    @property
    def has_repeats(self) -> bool:
        """Whether conditions were repeated, so that there is a noise floor."""
        return bool((self.cell >= 0).any())

    @property
    def never_changes(self) -> bool:
        """Whether the observed quantity is constant, but for rounding, or too small for its square to be a number."""
        return float(np.ptp(self.observed)) <= _ROUNDING * float(np.abs(self.observed).max()) + _NOTHING

    @property
    def coordinates(self) -> Conditions:
        """The conditions row by row, for pictures, blocks and tables."""
        return self.conditions if self.resample is None else self.conditions.take(self.resample.kept)

    def columns(self, effect: Effect, shape: Shape) -> Floats:
        """Return the contribution of unit amplitudes to what is observed, shape (rows, amplitudes)."""
        columns = effect.columns(self.conditions, shape)
        return columns if self.resample is None else self.resample.apply(columns)

    def scan(self, effect: Effect, shapes: Sequence[Shape]) -> Floats:
        """Return the columns of several shapes with as many amplitudes each, shape (shapes, amplitudes, rows)."""
        if self.resample is None:
            return effect.scan(self.conditions, shapes)
        first = effect.scan(self.conditions, shapes[:1])
        at_once = max(1, _SCANNED_AT_ONCE // first.size)
        found = np.empty((len(shapes), first.shape[1], self.rows))
        for begin in range(0, len(shapes), at_once):
            full = effect.scan(self.conditions, shapes[begin : begin + at_once])
            found[begin : begin + at_once] = self.resample.apply_rows(full)
        return found

    def take(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> Dataset:
        """Return some of the readings."""
        return replace(
            self,
            observed=self.observed[rows],
            conditions=self.conditions.take(rows) if self.resample is None else self.conditions,
            resample=None if self.resample is None else self.resample.take(rows),
            cell=self.cell[rows],
            block=self.block[rows],
            unknown=tuple((name, values[rows]) for name, values in self.unknown),
        )
