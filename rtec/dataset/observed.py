"""Which quantity of a measurement is to be explained, and over which coordinate."""

from __future__ import annotations

import numpy as np

from rtec.effects import Observable
from rtec.effects.conditions import Floats
from rtec.errors import FileFormatError, unknown
from rtec.metrology import Measurement, Positions
from rtec.metrology.columns import channel_of_heading, quantity_of_heading

DRIVE = ("force", "current", "torque", "voltage")
"""Quantities of a drive."""
_NEVER_OBSERVED = ("run", "direction", "time", "target", "deviation", "spindle")


def observed_quantity(measurement: Measurement, observe: str | None) -> str:
    """Return the quantity to be explained: one that is asked for by its name or heading, else the deviation or drive.

    An ArgumentError says that the file has no such quantity, a FileFormatError that it has none or too many.
    """
    columns = measurement.columns
    possible = [name for name in columns if name not in _NEVER_OBSERVED]
    if "deviation" in columns or {"actual", "target"} <= set(columns):
        possible.insert(0, "deviation")
    every = ", ".join([*(column.heading for column in columns.values()), *measurement.unknown])
    every = repr(every if len(every) <= 200 else every[:197] + "...")
    if observe is not None:
        word = observe.strip().lower()
        named = quantity_of_heading(word)
        quantity = word if named is None else named[0]
        if quantity not in possible:  # as the file calls it
            called = {channel_of_heading(heading)[0]: name for name, heading in measurement.headings.items()}
            quantity = called.get(channel_of_heading(word)[0], channel_of_heading(word)[0])
        if quantity in possible:
            return quantity
        possible += measurement.channels()
        if not possible:
            problem = f"nothing to explain in the columns {every}"
            raise FileFormatError(measurement.source, None, problem, "a column of a deviation, force or current")
        raise unknown("--observe", observe, possible)
    drive = [name for name in possible if name in DRIVE]
    if possible[:1] == ["deviation"] or len(drive) == 1:
        return "deviation" if possible[0] == "deviation" else drive[0]
    choices = drive or possible
    others = f", and {'several' if len(choices) > 1 else 'only'} other quantities" if choices else ""
    problem = f"no deviation to explain in the columns {every}{others}"
    allowed = " or ".join(f"--observe {name}" for name in choices)
    allowed = allowed or "target with actual or deviation, or a force or current"
    raise FileFormatError(measurement.source, None, problem, allowed)


def observable_of(quantity: str) -> Observable:
    """Return what kind of quantity is observed."""
    return Observable.DRIVE if quantity in DRIVE else Observable.DEVIATION


def coordinate_of(measurement: Measurement, positions: Positions, quantity: str, preferred: str | None) -> str:
    """Return what is the position: ``target``, ``actual``, ``time``; or only a ``velocity``, only a ``temperature``.

    A deviation belongs to the target, a force to where the axis really is. A table of what was read at each speed has
    neither position nor time; nor has one of temperatures. Refused is a file without any of them.
    """
    columns, order = measurement.columns, ("actual", "target") if quantity in DRIVE else ("target", "actual")
    have = [name for name in order if name in positions.values and name != quantity]
    table = "velocity" in columns and "time" not in columns and quantity != "velocity"
    found = preferred if preferred in (*have, "time") else [*have, "velocity" if table else "time"][0]
    if found == "time" and "time" not in columns:
        if any(name.startswith("temperature") and name != quantity for name in columns):
            return "temperature"
        allowed = "a column target_mm, actual_mm, time_s or velocity_mm_s (or other units)"
        raise FileFormatError(measurement.source, None, "neither a position nor a time nor a velocity", allowed)
    return found


def position_of(measurement: Measurement, positions: Positions, coordinate: str) -> tuple[Floats, str]:
    """Return the column that is the position, zeros where there is only a velocity, shape (rows,), and its unit."""
    if coordinate == "velocity":
        return np.zeros(measurement.rows), measurement.columns["velocity"].unit.removesuffix("_s")
    if coordinate == "temperature":
        return np.zeros(measurement.rows), positions.unit
    if coordinate == "time":
        return measurement.columns["time"].values, "s"
    return positions.values[coordinate], positions.unit


def without_wraps(positions: Positions) -> Positions:
    """Return the positions of a log without the jumps of a single-turn counter, with a note."""
    turn, given = positions.turn, positions.values
    if turn is None:
        return positions
    values = {name: x if name == "deviation" else unwrapped(x, turn) for name, x in given.items()}
    if all(values[name] is given[name] for name in given):
        return positions
    if values.keys() == {"target", "actual"}:
        values["deviation"] = _within_a_turn(values["actual"] - values["target"], turn)
    note = "the position jumps by a turn where the single-turn counter starts again: made continuous"
    return Positions(values=values, unit=positions.unit, notes=(*positions.notes, note))


def unwrapped(angle: Floats, turn: float) -> Floats:
    """Return the angle of a single-turn encoder in a log without its jumps at the end of a turn.

    What does not stay within one turn is no single-turn counter and comes back as it is.
    """
    jumps = np.ptp(angle) <= turn and np.abs(np.diff(angle)).max(initial=0.0) > turn / 2
    return np.unwrap(angle, period=turn) if jumps else angle


def _within_a_turn(angle: Floats, turn: float) -> Floats:
    return np.asarray((angle + turn / 2) % turn - turn / 2)


def observed_of(measurement: Measurement, positions: Positions, quantity: str) -> tuple[Floats, str]:
    """Return what is explained, with its unit inside: a deviation as given, else actual less target."""
    turn, values = positions.turn, positions.values
    if quantity in ("deviation", "actual") and quantity in values:
        return values[quantity], positions.unit
    if quantity == "deviation":
        difference = values["actual"] - values["target"]
        if turn is not None and max(np.ptp(values["actual"]), np.ptp(values["target"])) <= turn:
            # one of the two may be through zero already, the other not yet
            difference = np.where(np.abs(difference) > turn / 2, _within_a_turn(difference, turn), difference)
        return difference, positions.unit
    column = measurement.columns[quantity]
    return column.values, column.unit
