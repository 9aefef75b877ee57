"""What is to be explained: the observed quantity, its conditions and its repeats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.drive_signals import Resample
from rtec.dataset.repeats import cells_of
from rtec.dataset.standstill import Ints
from rtec.effects import LIBRARY, Conditions, Effect, Floats, Library, Observable, Shape, Units
from rtec.errors import ArgumentError, FileFormatError
from rtec.metrology.columns import axis_of_heading

_ROUNDING, _NOTHING = 1e-12, 1e-100  # a filter turns a constant into nearly a constant: share of the largest value
_STATED = ("screw_pitch", "signal_period", "revolution")  # facts of the axis that one file may take from another
_SCANNED_AT_ONCE = 1 << 23  # numbers of full-rate columns (64 MiB) that a scan holds at one time


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Dataset:
    """A measurement, ready to be explained.

    What depends on the conditions in a nonlinear way (the sign of a velocity) must go through the same filter as the
    observed force did: so columns are computed for every sample and then decimated by ``columns``, never computed
    from decimated conditions. ``coordinates`` are decimated conditions, for pictures and tables only.
    """

    source: str
    """File, for messages."""
    observe: str
    observable: Observable
    """Quantity to be explained (``deviation``, or the name of a column), and its kind, for which there are
    effects."""
    units: Units
    """Units inside."""
    observed: Floats
    """Shape (rows,), in ``units.observed``."""
    conditions: Conditions
    """The same rows; where ``resample`` is given, every sample of the log before it was decimated."""
    cell: Ints
    """Number of the cell of each reading, shape (rows,): readings of one cell were taken under the same conditions
    (target and direction; in a log place, direction and speed) in different passes; −1 without a repeat."""
    stands_for: Floats | None = None
    """How many rows of the file were put together into each, shape (rows,); None where all stayed apart."""
    passage: Ints = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    """Number of the pass, 0, 1, ..., that each reading belongs to: a stretch in one direction within a run. Readings
    of one pass and cell are correlated with each other. Shape (rows,); where it is left out, a run is a pass."""
    block: Ints | None = None
    """Number of the block of each reading, shape (rows,), which ascends: rows of one state of the machine, held out
    together. None where nothing makes blocks."""
    notes: tuple[str, ...] = ()
    """What was done to the file's numbers before (differentiation, decimation, rows left out), in sentences."""
    warnings: tuple[str, ...] = ()
    """What speaks against the file: units, directions or signs that look wrong, outliers, copies, in sentences."""
    unknown: tuple[tuple[str, Floats], ...] = ()
    """Numeric columns that name no known quantity, by heading: they can be looked at, but no effect uses them."""
    resample: Resample | None = None
    """How a column of every sample becomes one of ``rows`` readings; None where nothing was decimated."""
    coordinate: str = "target"
    """Where the position comes from: ``target``, ``actual`` or ``time``; ``velocity`` for a table of readings at
    several speeds, which has no positions (all are 0)."""
    cutoff_hz: float | None = None
    """Of the low pass in front of the derivatives; None where positions were not filtered."""
    rounding: float = 0.0
    """Step in which the file rounds what is observed, in ``units.observed``; 0 where it shows none."""
    library: Library = LIBRARY
    """The effects that may explain it."""
    axis: int | None = None
    """Number of the axis that was measured; None where the file does not say it (``# axis: 1``)."""
    repeat_noise: tuple[float, float] | None = None
    """Standard deviation of all repeats and its degrees of freedom, where these readings are a part of the file."""

    def __post_init__(self) -> None:
        if self.resample is not None and self.conditions.rows != self.resample.samples:
            found = f"{self.conditions.rows} samples"
            raise ArgumentError("dataset", found, f"{self.resample.samples}, as many as the decimation takes")
        if self.passage.size == 0:
            object.__setattr__(self, "passage", np.unique(self.coordinates.run, return_inverse=True)[1])
        columns = (self.observed, self.cell, self.passage, *(values for _, values in self.unknown))
        sizes = {(self.coordinates.rows,), *(values.shape for values in columns)}
        if len(sizes) != 1:
            allowed = "observed, cell, passage and conditions row by row"
            raise ArgumentError("dataset", f"shapes {sorted(sizes)}", allowed)

    @property
    def rows(self) -> int:
        """Number of readings."""
        return int(self.observed.size)

    @property
    def has_repeats(self) -> bool:
        """Whether conditions were repeated, so that there is a noise floor."""
        return bool((self.cell >= 0).any())

    @property
    def in_blocks(self) -> bool:
        """Whether the readings lie in several blocks."""
        return self.block is not None and int(np.ptp(self.block)) > 0

    @property
    def never_changes(self) -> bool:
        """Whether the observed quantity is constant, but for rounding, or too small for its square to be a number."""
        return float(np.ptp(self.observed)) <= _ROUNDING * float(np.abs(self.observed).max()) + _NOTHING

    @property
    def coordinates(self) -> Conditions:
        """The conditions row by row, for pictures and tables."""
        return self.conditions if self.resample is None else self.conditions.take(self.resample.kept)

    @property
    def other_axes_mm(self) -> dict[int, Floats]:
        """Positions of other axes by their numbers, shape (rows,), in mm: columns ``position_NUMBER_UNIT``.

        Raises
        ------
        FileFormatError
            Two columns for one axis, or one for the axis that was measured.
        """
        found: dict[int, Floats] = {}
        for heading, values in self.unknown:
            if (axis := axis_of_heading(heading)) is not None:
                if axis[0] in found or axis[0] == self.axis:
                    what = "the position of the measured" if axis[0] == self.axis else "a second position of its"
                    allowed = "one column for the position of each other axis"
                    raise FileFormatError(self.source, None, f"{heading} is {what} axis", allowed)
                found[axis[0]] = values * axis[1].factor
        return dict(sorted(found.items()))

    def columns(self, effect: Effect, shape: Shape) -> Floats:
        """Return the contribution of unit amplitudes to what is observed, shape (rows, amplitudes)."""
        columns = effect.columns(self.conditions, shape)
        return columns if self.resample is None else self.resample.apply(columns.T).T

    def scan(self, effect: Effect, shapes: Sequence[Shape]) -> Floats:
        """Return the columns of several shapes with as many amplitudes each, shape (shapes, amplitudes, rows)."""
        if self.resample is None:
            return effect.scan(self.conditions, shapes)
        at_once = max(1, _SCANNED_AT_ONCE // effect.scan(self.conditions, shapes[:1]).size)
        parts = [shapes[begin : begin + at_once] for begin in range(0, len(shapes), at_once)]
        return np.concatenate([self.resample.apply(effect.scan(self.conditions, part)) for part in parts])

    def rms(self, values: Floats) -> float:
        """Return the root mean square over all rows of the file; those put together count as many."""
        return float(np.sqrt(np.average(values**2, weights=self.stands_for)))

    def take(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> Dataset:
        """Return some of the readings."""
        columns = {name: getattr(self, name) for name in ("observed", "cell", "passage", "block", "stands_for")}
        found: dict[str, Any] = {name: values[rows] for name, values in columns.items() if values is not None}
        found["unknown"] = tuple((name, values[rows]) for name, values in self.unknown)
        if self.resample is None:
            return replace(self, conditions=self.conditions.take(rows), **found)
        return replace(self, resample=self.resample.take(rows), **found)

    def alone(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> Dataset:
        """Return some of the readings as if there were no others: what one pass alone visited is no repeat now."""
        part = self.take(rows)
        return replace(part, cell=cells_of(part.cell, part.passage))


def warnings_of(data: Dataset, heldout: Dataset | None = None) -> list[str]:
    """Return what speaks against a measurement, and against another one that judges it."""
    others = () if heldout is None or heldout.source == data.source else heldout.warnings
    return [*data.warnings, *(f"{heldout.source}: {text}" for text in others if heldout is not None)]


def same_kind(data: Dataset, like: Dataset) -> Dataset:
    """Return a data set to score on, with the facts of the axis that only the training file (``like``) states.

    Units or kinds of columns that differ, so that a model of one says nothing of the other, are refused.
    """
    mine, theirs = data.conditions, like.conditions
    for what, here, there in (
        ("positions", data.units.position, like.units.position),
        (data.observe, data.units.observed, like.units.observed),
        ("load", data.units.load, like.units.load),
    ):
        if here != there:
            problem = f"units mixed between files: {what} in {here} here, in {there} in {like.source}"
            allowed = "columns and facts of the same kind in both files"
            if "count" in (here, there):
                allowed += "; a fact counts_per_rev turns counts into angles"
            raise FileFormatError(data.source, None, problem, allowed)
    if mine.moving != theirs.moving:
        kinds = {True: "a log of a moving axis", False: "readings at rest"}
        problem = f"{kinds[mine.moving]} here, {kinds[theirs.moving]} in {like.source}"
        raise FileFormatError(data.source, None, problem, "two files of the same kind")
    if lacking := [name for name in _columns(theirs) if name not in _columns(mine)]:
        problem = f"no {', '.join(lacking)} here, but in {like.source}"
        raise FileFormatError(data.source, None, problem, "the same kinds of columns in both files")
    notes = list(data.notes)
    facts: dict[str, Any] = {name: getattr(theirs, name) for name in _STATED if getattr(mine, name) is None}
    facts["reference_temperature_degc"] = theirs.reference_temperature_degc
    if mine.temperatures and mine.reference_temperature_degc != theirs.reference_temperature_degc:
        notes.append(f"reference temperature as in {like.source}: {theirs.reference_temperature_degc:g} degC")
    units = data.units
    if theirs.time_s is None and mine.time_s is not None:
        facts["time_s"], units = None, like.units
        notes.append(f"time is not used: {like.source} has none, and row order counts as time")
    if theirs.time_s is None and not theirs.moving and mine.run.min() > theirs.run.max():
        facts["first_row"] = like.rows
        notes.append(f"its runs follow those of {like.source}: row order goes on from there")
    return replace(data, conditions=replace(mine, **facts), units=units, notes=tuple(notes))


def _columns(conditions: Conditions) -> list[str]:
    """Return the kinds of columns that effects can depend on."""
    names = {"direction": "direction", "time_s": "time", "velocity": "velocity", "acceleration": "acceleration"}
    names |= {"pressure_hpa": "pressure", "humidity_percent": "humidity", "load": "load", "spindle_rpm": "spindle"}
    have = [word for name, word in names.items() if getattr(conditions, name) is not None]
    return have + list(conditions.temperatures)
