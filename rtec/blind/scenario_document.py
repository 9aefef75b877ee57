"""A scenario as a JSON document and back, bit for bit: with its seed it is the hidden axis."""

from __future__ import annotations

import enum
from dataclasses import MISSING, Field, fields
from typing import Any

from rtec.blind.noise import Noise
from rtec.blind.plan import Plan
from rtec.blind.scenario import Scenario


def scenario_document(scenario: Scenario) -> dict[str, Any]:
    """Return a scenario as a JSON document.

    Examples
    --------
    >>> scenario_document(Scenario(names=("drift",)))["plan"]["reading"]
    'position at rest'
    """
    return {
        "names": list(scenario.names),
        "strengths_sigma": list(scenario.strengths),
        "noise": scenario.noise.value,
        "plan": {f.name: _written(getattr(scenario.plan, f.name)) for f in fields(Plan)},
    }


def scenario_from(document: dict[str, Any]) -> Scenario:
    """Return the scenario that a JSON document holds.

    Raises
    ------
    KeyError, TypeError, ValueError
        It holds none.

    Examples
    --------
    >>> scenario = Scenario(names=("drift", "backlash"), strength_sigma=(2.5, 1 / 3))
    >>> scenario_from(scenario_document(scenario)) == scenario
    True
    """
    return Scenario(
        names=tuple(document["names"]),
        strength_sigma=tuple(document["strengths_sigma"]),
        noise=Noise(document["noise"]),
        plan=Plan(**{f.name: _read(f, document["plan"][f.name]) for f in fields(Plan)}),
    )


def _written(value: object) -> object:
    if isinstance(value, enum.Enum):
        return value.value
    return list(value) if isinstance(value, tuple) else value


def _read(field: Field[Any], value: Any) -> Any:
    """Return a field of a plan, of the kind of its default."""
    if isinstance(field.default, enum.Enum):
        return type(field.default)(value)
    if field.default is not MISSING and isinstance(field.default, tuple):
        return tuple(value)
    return value
