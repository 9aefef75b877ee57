"""Which quantity of a measurement is to be explained, and over which coordinate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtec.dataset.axis_facts import AxisFacts, in_axis_unit
from rtec.effects import Observable
from rtec.effects.conditions import Floats
from rtec.errors import ArgumentError, FileFormatError, nearest
from rtec.metrology import Measurement
from rtec.metrology.columns import quantity_of_heading

DRIVE = ("force", "current", "torque", "voltage")
"""Quantities of a drive."""
_NEVER_OBSERVED = ("run", "direction", "time", "target")
_POSITIONS = ("target", "actual", "deviation")
_FULL_TURN_DEG = 360.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Positions:
    """The position columns of a file, in mm, degrees or counts, all of one unit.

    Parameters
    ----------
    target, actual, deviation
        Shape (rows,); None where the file neither holds them nor lets them be computed.
    unit
        ``mm``, ``deg``, ``count``, or nothing where the file has none of the three.
    notes
        What was taken from where, in sentences.
    """

    target: Floats | None
    actual: Floats | None
    deviation: Floats | None
    unit: str
    notes: tuple[str, ...]

    @property
    def turn(self) -> float | None:
        """A whole turn of a rotary axis, in the unit; None where it is not known, or the axis is linear."""
        return _FULL_TURN_DEG if self.unit == "deg" else None


def positions_of(measurement: Measurement, facts: AxisFacts) -> Positions:
    """Return the position columns of a measurement in one unit.

    Raises
    ------
    FileFormatError
        Linear and angular columns in one file, or counts of unknown size beside another unit.
    """
    found = {name: measurement.columns[name] for name in _POSITIONS if name in measurement.columns}
    counts, notes = None, []
    if any(column.unit == "count" for column in found.values()) and (stated := facts.counts_per_rev()) is not None:
        counts, key = stated
        notes.append(f"{counts:g} counts a revolution, as '{key}' says: positions are in degrees")
    values, units = {}, {}
    for name, column in found.items():
        values[name], units[name] = in_axis_unit(column, counts)
    if len(set(units.values())) > 1:
        problem = "units mixed: " + ", ".join(f"{name} in {unit}" for name, unit in units.items())
        allowed = "all lengths, or all angles"
        if "count" in units.values():
            allowed += "; a line '# counts_per_rev: 8192' turns counts into angles"
        raise FileFormatError(measurement.source, None, problem, allowed)
    target, actual, deviation = (values.get(name) for name in _POSITIONS)
    if target is None and actual is not None and deviation is not None:
        target = actual - deviation
        notes.append("target: actual less deviation")
    return Positions(
        target=target,
        actual=actual,
        deviation=deviation,
        unit=next(iter(units.values()), ""),
        notes=tuple(notes),
    )


def deviation_of(positions: Positions) -> Floats | None:
    """Return the deviation: as given, else actual less target; None where there is neither."""
    if positions.deviation is not None or positions.actual is None or positions.target is None:
        return positions.deviation
    difference = positions.actual - positions.target
    turn = positions.turn
    if turn is not None and max(np.ptp(positions.actual), np.ptp(positions.target)) <= turn:
        # one of the two may be through zero already, the other not yet
        difference = np.where(np.abs(difference) > turn / 2, (difference + turn / 2) % turn - turn / 2, difference)
    return difference


def observed_quantity(measurement: Measurement, observe: str | None) -> str:
    """Return the quantity to be explained.

    Parameters
    ----------
    measurement
        The file.
    observe
        A quantity or a heading of the file; None for ``deviation`` where it is known, else for the one column of a
        drive.

    Raises
    ------
    ArgumentError
        ``observe`` names no quantity of the file.
    FileFormatError
        Nothing was asked for, and there is nothing or more than one quantity to explain.
    """
    columns = measurement.columns
    possible = [name for name in columns if name not in _NEVER_OBSERVED and name != "deviation"]
    if "deviation" in columns or {"actual", "target"} <= set(columns):
        possible.insert(0, "deviation")
    if observe is not None:
        word = observe.strip().lower()
        named = quantity_of_heading(word)
        quantity = word if named is None else named[0]
        if quantity in possible:
            return quantity
        if not possible:
            problem = f"nothing to explain in the columns {_headings(measurement)}"
            raise FileFormatError(measurement.source, None, problem, "a column of a deviation, force or current")
        raise ArgumentError("--observe", repr(observe[:60]), ", ".join(possible), nearest(quantity, possible))
    if possible[:1] == ["deviation"]:
        return "deviation"
    drive = [name for name in possible if name in DRIVE]
    if len(drive) == 1:
        return drive[0]
    choices = drive or possible
    problem = f"no deviation to explain in the columns {_headings(measurement)}"
    allowed = "target with actual or deviation, or a force or current"
    if choices:
        problem += f", and {'several' if len(choices) > 1 else 'only'} other quantities"
        allowed = " or ".join(f"--observe {name}" for name in choices)
    raise FileFormatError(measurement.source, None, problem, allowed)


def observable_of(quantity: str) -> Observable:
    """Return what kind of quantity is observed.

    Examples
    --------
    >>> observable_of("force").value, observable_of("temperature").value
    ('drive', 'deviation')
    """
    return Observable.DRIVE if quantity in DRIVE else Observable.DEVIATION


def coordinate_of(quantity: str, positions: Positions, preferred: str | None) -> str:
    """Return which column is the position: ``target``, ``actual`` or ``time``.

    A deviation belongs to the target, a force to where the axis really is.
    """
    order = ["actual", "target"] if quantity in DRIVE else ["target", "actual"]
    have = [name for name in order if getattr(positions, name) is not None and name != quantity]
    if preferred in (*have, "time"):
        return preferred
    return have[0] if have else "time"


def _headings(measurement: Measurement) -> str:
    every = ", ".join([*(column.heading for column in measurement.columns.values()), *measurement.unknown])
    return repr(every if len(every) <= 200 else every[:197] + "...")
