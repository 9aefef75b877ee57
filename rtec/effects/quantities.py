"""What an effect can be a function of, by the names that people give it."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np

from rtec.effects.conditions import Conditions, Floats

MEANT = MappingProxyType({
    "position": "a position", "direction": "a direction", "velocity": "a velocity or feed column, or moving data",
    "acceleration": "moving data", "time": "a time column", "temperature": "one temperature column",
    "spindle": "a spindle speed",
    "since_reversal": "directions", "run": "runs", "load": "a load column", "pressure": "a pressure column",
    "humidity": "a humidity column", "phase_of_pitch": "a stated screw pitch",
    "phase_of_signal": "a stated signal period", "phase_of_turn": "counts a turn, or angles",
})  # fmt: skip
"""Quantities by name, and what data need to have them; beside them a temperature or any column by its own name."""
PHASES = MappingProxyType({
    "phase_of_pitch": "screw_pitch", "phase_of_signal": "signal_period", "phase_of_turn": "revolution",
})  # fmt: skip
"""Where in a period that the file states a position lies."""
SLOW = frozenset({"time", "temperature", "spindle", "run", "load", "pressure", "humidity"})
"""Those that change from repeat to repeat."""


def quantity_of(conditions: Conditions, name: str) -> Floats | None:
    """Return a quantity at each reading, shape (rows,), in its unit inside; None where the data have none.

    Examples
    --------
    >>> c = Conditions(position=np.array([0.0, 5.0]), position_unit="mm", run=np.ones(2, dtype=np.int64))
    >>> quantity_of(c, "position").tolist(), quantity_of(c, "time") is None
    ([0.0, 5.0], True)
    """
    if name.startswith("temperature"):
        several = conditions.temperatures
        alone = next(iter(several.values())) if name == "temperature" and len(several) == 1 else None
        return several.get(name, alone)
    if (name == "position" or name in PHASES) and conditions.time_is_coordinate:
        return None
    if name in PHASES:
        period = getattr(conditions, PHASES[name])
        return None if period is None else np.asarray(conditions.position % period, dtype=np.float64)
    known = {
        "position": conditions.position, "direction": conditions.direction, "velocity": conditions.velocity,
        "acceleration": conditions.acceleration, "time": conditions.time_s, "run": conditions.run,
        "since_reversal": conditions.since_reversal, "load": conditions.load,
        "spindle": conditions.spindle_rpm, "pressure": conditions.pressure_hpa,
        "humidity": conditions.humidity_percent,
    }  # fmt: skip
    found = known[name] if name in known else conditions.others.get(name)
    return None if found is None else np.asarray(found, dtype=np.float64)


def unit_of(conditions: Conditions, name: str) -> str:
    """Return the unit inside of a quantity; empty where it has none, or nobody knows it.

    Examples
    --------
    >>> c = Conditions(position=np.zeros(1), position_unit="deg", run=np.ones(1, dtype=np.int64))
    >>> unit_of(c, "velocity"), unit_of(c, "temperature_bed"), unit_of(c, "oil")
    ('deg/s', 'degC', '')
    """
    place = conditions.position_unit
    known = {
        "position": place, "since_reversal": place, "velocity": f"{place}/s", "acceleration": f"{place}/s^2",
        "time": "s", "spindle": "rpm", "pressure": "hPa", "humidity": "%", **dict.fromkeys(PHASES, place),
    }  # fmt: skip
    return "degC" if name.startswith("temperature") else known.get(name, "")


def is_slow(name: str) -> bool:
    """Return whether a quantity changes from repeat to repeat: time, heat, load, or any unknown column."""
    bare = "temperature" if name.startswith("temperature") else name
    return bare in SLOW or bare not in MEANT


def meant(name: str) -> str:
    """Return what data need to have a quantity, in words."""
    return MEANT.get(name, f"a column {name}")


def missing(conditions: Conditions, name: str) -> str:
    """Return why data have no such quantity."""
    if name == "temperature" and conditions.temperatures:
        return f"several temperature columns: say which ({', '.join(conditions.temperatures)})"
    return f"no {meant(name).removeprefix('a ').removeprefix('one ')}"
