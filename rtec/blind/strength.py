"""How strong static errors are made: so that each contributes to the readings what the scenario asks for."""

from __future__ import annotations

from rtec.blind.draws import Draw, stream
from rtec.blind.hidden import Hidden, hidden_of, rms
from rtec.blind.plan import Floats
from rtec.blind.scenario import Scenario
from rtec.blind.static_errors import STATIC, StaticError, at_readings


def hide_static(
    scenario: Scenario, seed: int, position_mm: Floats, direction: Floats, hidden: dict[str, Hidden]
) -> list[tuple[StaticError, float]]:
    """Return the static errors of a scenario with the factor of each.

    Parameters
    ----------
    scenario, seed
        What is hidden.
    position_mm, direction
        Of each reading, shape (n,).
    hidden
        Takes down what they are, by name.

    Examples
    --------
    >>> import numpy as np
    >>> taken: dict[str, Hidden] = {}
    >>> parts = hide_static(Scenario(names=("backlash",)), 1, np.array([50.0, 50.0]), np.array([1.0, -1.0]), taken)
    >>> round(parts[0][1], 9), taken["backlash"].parameters[0].value
    (12.0, 12.0)
    """
    sigma_mm = scenario.plan.sigma_um * 1e-3
    parts = []
    for name in (name for name in scenario.names if name in STATIC):
        error = STATIC[name](scenario.plan, stream(seed, Draw.EFFECT, name))
        added = at_readings(scenario.plan, error, position_mm, direction)
        factor = scenario.wanted[name] * sigma_mm / rms(added)
        parts.append((error, factor))
        hidden[name] = hidden_of(name, error.description, error.parameters, factor, added, sigma_mm)
    return parts
