"""How strong static errors are made: so that each contributes to the readings what the scenario asks for."""

from __future__ import annotations

from rtec.blind.draws import Draw, stream
from rtec.blind.hidden import Hidden, hidden_of, rms
from rtec.blind.plan import Floats
from rtec.blind.scenario import Scenario
from rtec.blind.static_errors import STATIC, StaticError, at_readings


def static_errors(
    scenario: Scenario, seed: int, position_mm: Floats, direction: Floats
) -> dict[str, tuple[StaticError, float]]:
    """Return the static errors of a scenario with the factor of each, by name.

    Positions and directions are those of the readings of the first measurement, shape (n,).

    Examples
    --------
    >>> import numpy as np
    >>> parts = static_errors(Scenario(names=("backlash",)), 1, np.array([50.0, 50.0]), np.array([1.0, -1.0]))
    >>> round(parts["backlash"][1], 9)
    12.0
    """
    sigma_mm = scenario.plan.sigma_um * 1e-3
    parts = {}
    for name in (name for name in scenario.names if name in STATIC):
        error = STATIC[name](scenario.plan, stream(seed, Draw.EFFECT, name))
        added = at_readings(scenario.plan, error, position_mm, direction)
        parts[name] = error, scenario.wanted[name] * sigma_mm / rms(added)
    return parts


def hidden_static(
    scenario: Scenario, parts: dict[str, tuple[StaticError, float]], position_mm: Floats, direction: Floats
) -> dict[str, Hidden]:
    """Return what static errors are to the readings of a measurement, by name.

    Examples
    --------
    >>> import numpy as np
    >>> scenario, at, way = Scenario(names=("backlash",)), np.array([50.0, 50.0]), np.array([1.0, -1.0])
    >>> parts = static_errors(scenario, 1, at, way)
    >>> hidden_static(scenario, parts, at, np.ones(2))["backlash"].rms_sigma
    0.0
    """
    sigma_mm = scenario.plan.sigma_um * 1e-3
    found = {}
    for name, (error, factor) in parts.items():
        added = at_readings(scenario.plan, error, position_mm, direction)
        found[name] = hidden_of(name, error.description, error.parameters, factor, rms(added), sigma_mm)
    return found
