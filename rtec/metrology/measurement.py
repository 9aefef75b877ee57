"""A measurement: columns in the internal units with the facts of the axis, and the readings that it holds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from rtec.errors import ArgumentError, FileFormatError
from rtec.metrology.plain_numbers import PLAIN_NUMBER, shown
from rtec.metrology.readings import Floats, Readings, RotaryReadings
from rtec.metrology.tables.choices import as_option


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """One column of a measurement.

    Parameters
    ----------
    quantity
        ``target``, ``actual``, ``temperature_nut``, ... as in the contract's table (``command`` is ``target``).
    unit
        Unit inside: ``mm``, ``deg``, ``rev``, ``count``, ``s``, ``mm_s``, ``deg_s``, ``degc``, ``n``, ``a``, ``v``,
        ``nm``, ``hpa``, ``percent``, that of a load, or nothing.
    values
        Shape (rows,), in ``unit``.
    """

    quantity: str
    unit: str
    values: Floats

    @property
    def heading(self) -> str:
        """The heading under which the column is written."""
        return f"{self.quantity}_{self.unit}" if self.unit else self.quantity


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measurement:
    """What a measurement file holds.

    Parameters
    ----------
    source
        Where it came from, for messages.
    facts
        The ``# key: value`` lines, keys in lower case; a key that comes twice keeps both values, a line each.
    columns
        The known columns by quantity.
    unknown
        Columns that name no known quantity, by heading: numbers, or text where a field is no number.
    lines
        Line of the file in which each row stands, counted from 1; None where there is no file.
    notes
        What was guessed when the file was read, and what was left out, in words.
    headings
        What the file calls a column, by quantity, where that is not what we call it.
    passes
        Of a table with a column for each pass: what the file calls the column of each row's reading.

    Examples
    --------
    >>> m = Measurement(source="x", facts={}, columns={"target": Column("target", "mm", np.array([0.0, 1.0]))},
    ...                 unknown={})
    >>> m.rows
    2
    """

    source: str
    facts: Mapping[str, str]
    columns: Mapping[str, Column]
    unknown: Mapping[str, NDArray[np.float64] | NDArray[np.str_]]
    lines: Sequence[int] | None = None
    notes: tuple[str, ...] = ()
    headings: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    passes: Sequence[str] = ()

    def __post_init__(self) -> None:
        sizes = {column.values.shape for column in self.columns.values()}
        sizes |= {values.shape for values in self.unknown.values()}
        if len(sizes) != 1 or any(len(shape) != 1 or shape == (0,) for shape in sizes):
            raise ArgumentError("columns", f"shapes {sorted(sizes)}", "one or more columns, equally long, with rows")
        for key, column in self.columns.items():
            if key != column.quantity:
                raise ArgumentError("columns", f"{key!r} for {column.quantity!r}", "each column under its quantity")

    @property
    def rows(self) -> int:
        """Number of rows."""
        return next(int(values.size) for values in self._all_values())

    def _all_values(self) -> Iterator[NDArray[np.float64] | NDArray[np.str_]]:
        for column in self.columns.values():
            yield column.values
        yield from self.unknown.values()

    def line_of(self, row: int) -> int | None:
        """Return the line of the file in which a row stands, counted from 1; None where there is no file."""
        return None if self.lines is None else self.lines[row]

    def called(self, quantity: str, rows: Iterable[int] = ()) -> str:
        """Return what a column is called in a message: the quantity, and the heading of the file where it is another.

        Parameters
        ----------
        quantity
            Of the column.
        rows
            Those that are spoken of: in a table with a column for each pass they tell which.
        """
        heading = self.headings.get(quantity, "")
        if quantity in ("deviation", "actual") and self.passes:
            names = list(dict.fromkeys(self.passes[row] for row in rows))
            heading = names[0] if len(names) == 1 else ""
        return f"{quantity} ({shown(heading)})" if heading else quantity

    def to_readings(self) -> Readings | RotaryReadings:
        """Return the readings of a positioning test.

        Returns
        -------
        Readings or RotaryReadings
            Rotary where the target is an angle, in revolutions, or in counts with a fact ``counts_per_rev``.

        Raises
        ------
        FileFormatError
            No target with an actual or a deviation, units that do not belong together, a direction that the motion
            does not give.

        Notes
        -----
        Without a run column everything is run 1. Without a direction column the direction is the sign of the motion
        within the run; the first reading of a run, and one at the target of the reading before, take the sign of the
        motion that follows (the axis has overshot and turned).

        Examples
        --------
        >>> target, actual = np.array([0.0, 1, 2, 2, 1]), np.array([0.0, 1, 2, 2.1, 1.1])
        >>> m = Measurement(source="x", facts={}, unknown={}, columns={
        ...     "target": Column("target", "mm", target), "actual": Column("actual", "mm", actual)})
        >>> m.to_readings().direction.tolist()
        [1, 1, 1, -1, -1]
        """
        target, target_unit, deviation, deviation_unit = self._target_and_deviation()
        run = self.columns["run"].values if "run" in self.columns else np.ones(self.rows)
        if "direction" in self.columns:
            direction = self.columns["direction"].values
        else:
            direction = self._direction_of_motion(target, run)
        _refuse_mixture(self.source, target_unit, "deviation", deviation_unit)
        signs, runs = direction.astype(np.int8), run.astype(np.int64)
        if target_unit == "mm":
            return Readings(target_mm=target, deviation_mm=deviation, direction=signs, run=runs)
        return RotaryReadings(target_deg=target, deviation_deg=deviation, direction=signs, run=runs)

    def _target_and_deviation(self) -> tuple[Floats, str, Floats, str]:
        """Return target and deviation with the unit of each, mm or deg."""
        found = {name: self._length_or_angle(name) for name in ("target", "actual", "deviation")}
        target, actual, deviation = found["target"], found["actual"], found["deviation"]
        if target is None and actual is not None and deviation is not None and actual[1] == deviation[1]:
            target = actual[0] - deviation[0], actual[1]
        if deviation is None and actual is not None and target is not None:
            _refuse_mixture(self.source, target[1], "actual", actual[1])
            deviation = actual[0] - target[0], target[1]
        if target is None or deviation is None:
            have = ", ".join([*(column.heading for column in self.columns.values()), *self.unknown])
            unplaced = next(iter(self.unknown), "HEADING")
            option = as_option(unplaced, f"{'target' if target is None else 'deviation'}_mm")
            raise FileFormatError(
                self.source,
                None,
                f"no positioning test in the columns {shown(have)}",
                f"a target with actual positions or deviations; where {shown(unplaced)} is one, {option} says so",
            )
        return *target, *deviation

    def _length_or_angle(self, quantity: str) -> tuple[Floats, str] | None:
        """Return a position column in mm or degrees; counts need the fact ``counts_per_rev``."""
        column = self.columns.get(quantity)
        if column is None:
            return None
        if column.unit == "rev":
            return column.values * 360.0, "deg"
        if column.unit == "count":
            counts = self.number_fact("counts_per_rev")
            if counts is None:
                raise FileFormatError(
                    self.source,
                    None,
                    f"{column.heading} says nothing of length or angle",
                    "a line '# counts_per_rev: 8192'",
                )
            return column.values * (360.0 / counts), "deg"
        return column.values, column.unit

    def number_fact(self, key: str) -> float | None:
        """Return a fact that is a positive plain number, or None where the file does not state it.

        Raises
        ------
        FileFormatError
            The fact is stated and is no positive number.
        """
        text = self.facts.get(key)
        if text is None:
            return None
        if PLAIN_NUMBER.fullmatch(text.strip()) is None or not 0 < float(text) < math.inf:
            raise FileFormatError(self.source, None, f"{key}: {shown(text)} is not valid", "a number above 0")
        return float(text)

    def _direction_of_motion(self, target: Floats, run: Floats) -> Floats:
        step = direction_of_motion(target, run)
        if not step.all():
            what = (
                "nothing moves" if not step.any() else f"nothing moves in run {run[np.flatnonzero(step == 0)[0]]:g}"
            )
            raise FileFormatError(
                self.source, None, f"no direction column, and {what}", "a column 'direction' of +1, -1"
            )
        return step


def direction_of_motion(target: Floats, run: Floats | NDArray[np.int64]) -> Floats:
    """Return the sign of the motion to each reading within its run.

    Parameters
    ----------
    target, run
        Shape (rows,), in the order of the readings.

    Returns
    -------
    ndarray
        Shape (rows,): +1 or −1. The first reading of a run, and one at the target of the reading before, take the
        sign of the motion that follows (the axis has overshot and turned), the last ones of the motion before; 0
        throughout a run in which nothing moves.

    Examples
    --------
    >>> direction_of_motion(np.array([0.0, 1, 2, 2, 1]), np.ones(5)).tolist()
    [1.0, 1.0, 1.0, -1.0, -1.0]
    """
    step = np.zeros(target.size)
    same_run = run[1:] == run[:-1]
    step[1:][same_run] = np.sign(np.diff(target))[same_run]
    starts = np.flatnonzero(np.concatenate(([True], ~same_run)))
    for first, last in zip(starts, [*starts[1:], target.size], strict=True):
        step[first:last] = _fill_rests(step[first:last])
    return step


def _refuse_mixture(source: str, target_unit: str, other: str, other_unit: str) -> None:
    if target_unit != other_unit:
        problem = f"target in {target_unit}, {other} in {other_unit}"
        raise FileFormatError(source, None, problem, "both linear or both angular")


def _fill_rests(step: Floats) -> Floats:
    """Give every zero the sign that comes next, and those at the end the sign that came last."""
    moving = np.flatnonzero(step)
    if moving.size == 0:
        return step
    index = np.searchsorted(moving, np.arange(step.size))
    filled: Floats = step[moving[np.minimum(index, moving.size - 1)]]
    return filled


def measurement_of_readings(readings: Readings | RotaryReadings, facts: Mapping[str, str]) -> Measurement:
    """Return readings as a measurement, to be written as CSV.

    Parameters
    ----------
    readings
        Of a linear or a rotary axis.
    facts
        What else is known, for the ``# key: value`` lines.

    Examples
    --------
    >>> r = Readings(target_mm=[0, 1], deviation_mm=[0, 0.1], direction=[1, 1], run=[1, 1])
    >>> sorted(measurement_of_readings(r, {}).columns)
    ['deviation', 'direction', 'run', 'target']
    """
    if isinstance(readings, Readings):
        unit, target, deviation = "mm", readings.target_mm, readings.deviation_mm
        named = {"temperature_air": readings.air_temperature_degc}
        named["temperature_material"] = readings.material_temperature_degc
    else:
        unit, target, deviation, named = "deg", readings.target_deg, readings.deviation_deg, {}
    columns = [
        Column("run", "", readings.run.astype(np.float64)),
        Column("direction", "", readings.direction.astype(np.float64)),
        Column("target", unit, target),
        Column("deviation", unit, deviation),
        *(Column(name, "degc", values) for name, values in named.items() if values is not None),
    ]
    by_quantity = {column.quantity: column for column in columns}
    return Measurement(source="readings", facts=dict(facts), columns=by_quantity, unknown={})
