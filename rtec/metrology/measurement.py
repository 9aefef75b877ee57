"""A measurement: columns in the internal units with the facts of the axis, and the readings that it holds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from rtec.errors import ArgumentError, FileFormatError
from rtec.metrology.axis_facts import AxisFacts
from rtec.metrology.columns import channel_of_heading
from rtec.metrology.plain_numbers import shown
from rtec.metrology.readings import Floats, Readings, RotaryReadings
from rtec.metrology.tables.choices import as_option

Cells = NDArray[np.float64] | NDArray[np.str_]
"""A column of numbers, or of text."""
_POSITIONS = ("target", "actual", "deviation")


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
class Positions:
    """Those of target, actual and deviation that a file holds or lets be computed, shape (rows,), in one unit."""

    values: Mapping[str, Floats]
    unit: str
    notes: tuple[str, ...]

    @property
    def turn(self) -> float | None:
        """A whole turn of a rotary axis, in the unit; None where it is not known, or the axis is linear."""
        return 360.0 if self.unit == "deg" else None


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
    unknown: Mapping[str, Cells]
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
        every: Iterable[Cells] = (*(column.values for column in self.columns.values()), *self.unknown.values())
        return next(values.size for values in every)

    def line_of(self, row: int) -> int | None:
        """Return the line of the file in which a row stands, counted from 1; None where there is no file."""
        return None if self.lines is None else self.lines[row]

    def called(self, quantity: str, rows: Iterable[int] = ()) -> str:
        """Return what a column is called in a message: the quantity, and the heading of the file where it is another.

        In a table with a column for each pass the ``rows`` that are spoken of tell which.
        """
        heading = self.headings.get(quantity, "")
        if quantity in ("deviation", "actual") and self.passes:
            names = list(dict.fromkeys(self.passes[row] for row in rows))
            heading = names[0] if len(names) == 1 else ""
        return f"{quantity} ({shown(heading)})" if heading else quantity

    def channels(self) -> dict[str, str]:
        """Return the headings of columns of numbers that name no known quantity, by their names without the unit."""
        numeric = (heading for heading, values in self.unknown.items() if values.dtype.kind in "fi")
        return {channel_of_heading(heading)[0]: heading for heading in numeric}

    def with_channel(self, name: str) -> Measurement:
        """Return the measurement with one more known column: a channel, by its name or its heading.

        A name that is no channel changes nothing.

        Examples
        --------
        >>> m = Measurement(source="x", facts={}, columns={}, unknown={"ch3_um": np.array([1.0, 2.0])})
        >>> m.with_channel("ch3").columns["ch3"]
        Column(quantity='ch3', unit='mm', values=array([0.001, 0.002]))
        """
        by_name = self.channels()
        word = name.strip().lower()
        word = next((one for one, heading in by_name.items() if heading.lower() == word), word)
        if word not in by_name or word in self.columns:
            return self
        _, unit = channel_of_heading(by_name[word])
        values = (np.asarray(self.unknown[by_name[word]], dtype=np.float64) + unit.offset) * unit.factor
        others = {heading: cells for heading, cells in self.unknown.items() if heading != by_name[word]}
        return replace(self, columns={**self.columns, word: Column(word, unit.inside, values)}, unknown=others)

    def in_order_of_time(self) -> Measurement:
        """Return the rows as they were taken, where rows of several runs stand mixed, as in a file sorted by target.

        By their times; by runs, and by the times in each, where each run has a clock of its own. Rows that change the
        run less often than every fourth row stay as they are.

        Examples
        --------
        >>> columns = {"run": [1.0, 2, 1, 2], "time": [0.0, 30, 10, 40]}
        >>> m = Measurement(source="x", facts={}, unknown={}, columns={
        ...     name: Column(name, "", np.array(values)) for name, values in columns.items()})
        >>> m.in_order_of_time().columns["run"].values.tolist()
        [1.0, 1.0, 2.0, 2.0]
        """
        if not {"run", "time"} <= set(self.columns):
            return self
        run, time_s = self.columns["run"].values, self.columns["time"].values
        changes, runs = np.count_nonzero(np.diff(run)), np.unique(run).size
        if changes < max(runs, self.rows // 4) or not (np.diff(time_s) < 0.0).any():
            return self
        order = np.argsort(time_s, kind="stable")
        if np.count_nonzero(np.diff(run[order])) >= runs:
            order = np.lexsort((time_s, run))
        note = "rows of several runs stand mixed: they are taken, and counted, in the order of their times"
        return replace(
            self,
            columns={name: replace(column, values=column.values[order]) for name, column in self.columns.items()},
            unknown={name: values[order] for name, values in self.unknown.items()},
            lines=None if self.lines is None else [self.lines[row] for row in order],
            passes=[self.passes[row] for row in order] if self.passes else (),
            notes=(*self.notes, note),
        )

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
        # words in other facts are a guess, which a search says and a test of positioning does not take
        said = {key: text for key, text in self.facts.items() if key == "counts_per_rev"}
        positions = self.positions(AxisFacts(source=self.source, said=said))
        have, unit = positions.values, positions.unit
        if "target" not in have or len(have) == 1:
            named = ", ".join([*(column.heading for column in self.columns.values()), *self.unknown])
            unplaced = next(iter(self.unknown), "HEADING")
            option = as_option(unplaced, "deviation_mm" if "target" in have else "target_mm")
            problem = f"no positioning test in the columns {shown(named)}"
            where = f"where {shown(unplaced)} is one, {option} says so"
            allowed = f"a target with actual positions or deviations; {where}"
            raise FileFormatError(self.source, None, problem, allowed)
        if unit == "count":
            heading = next(self.columns[name].heading for name in _POSITIONS if name in self.columns)
            problem = f"{heading} says nothing of length or angle"
            raise FileFormatError(self.source, None, problem, "a line '# counts_per_rev: 8192'")
        target = have["target"]
        deviation = have["deviation"] if "deviation" in have else have["actual"] - target
        run = self.columns["run"].values if "run" in self.columns else np.ones(self.rows)
        if "direction" in self.columns:
            direction = self.columns["direction"].values
        else:
            direction = self._direction_of_motion(target, run)
        signs, runs = direction.astype(np.int8), run.astype(np.int64)
        if unit == "mm":
            return Readings(target_mm=target, deviation_mm=deviation, direction=signs, run=runs)
        return RotaryReadings(target_deg=target, deviation_deg=deviation, direction=signs, run=runs)

    def positions(self, axis: AxisFacts) -> Positions:
        """Return the position columns in mm, in degrees, or in counts of unknown size; refuse mixtures.

        Raises
        ------
        FileFormatError
            Lengths beside angles, or counts of unknown size beside either.
        ArgumentError, FileFormatError
            Counts a turn that are no number.
        """
        found = {name: self.columns[name] for name in _POSITIONS if name in self.columns}
        counts, notes = None, []
        if any(column.unit == "count" for column in found.values()) and (stated := axis.counts_per_rev()) is not None:
            counts, key = stated
            notes.append(f"{counts:g} counts a revolution, as '{key}' says: positions are in degrees")
        degrees = {"rev": 360.0} if counts is None else {"rev": 360.0, "count": 360.0 / counts}
        units = {name: "deg" if column.unit in degrees else column.unit for name, column in found.items()}
        if len(set(units.values())) > 1:
            problem = "units mixed: " + ", ".join(f"{name} in {unit}" for name, unit in units.items())
            allowed = "all lengths, or all angles"
            if "count" in units.values():
                allowed += "; a line '# counts_per_rev: 8192' turns counts into angles"
            raise FileFormatError(self.source, None, problem, allowed)
        values = {name: column.values * degrees.get(column.unit, 1.0) for name, column in found.items()}
        if values.keys() == {"actual", "deviation"}:
            values["target"] = values["actual"] - values["deviation"]
            notes.append("target: actual less deviation")
        return Positions(values=values, unit=next(iter(units.values()), ""), notes=tuple(notes))

    def _direction_of_motion(self, target: Floats, run: Floats) -> Floats:
        step = direction_of_motion(target, run)
        if not step.all():
            where = f" in run {run[np.flatnonzero(step == 0)[0]]:g}" if step.any() else ""
            problem = f"no direction column, and nothing moves{where}"
            raise FileFormatError(self.source, None, problem, "a column 'direction' of +1, -1")
        return step


def direction_of_motion(target: Floats, run: Floats | NDArray[np.int64]) -> Floats:
    """Return the sign of the motion to each reading within its run, in the order of the readings.

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


def _fill_rests(step: Floats) -> Floats:
    """Give every zero the sign that comes next, and those at the end the sign that came last."""
    moving = np.flatnonzero(step)
    if moving.size == 0:
        return step
    index = np.searchsorted(moving, np.arange(step.size))
    return step[moving[np.minimum(index, moving.size - 1)]]


def measurement_of_readings(readings: Readings | RotaryReadings, facts: Mapping[str, str]) -> Measurement:
    """Return readings as a measurement with facts for its ``# key: value`` lines, to be written as CSV.

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
